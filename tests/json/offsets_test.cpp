// SPDX-License-Identifier: Apache-2.0
// Descriptions whose members are reached by offsets, as those of tables in C: what is written and read is the
// same as of a type of C++ that says the same.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <rowe/schema.hpp>

#include "encoded.hpp"
#include "json/structs/decoder.hpp"

namespace offsets_test {

struct in_cpp {
  std::int32_t n = 0;
  rowe::fixed_string<7> name;
  rowe::bounded_array<float, 4> list;
  double last = 0;
};
struct in_c {
  double last;
  std::int32_t n;
  std::uint16_t list_count;
  char name[8];
  float list[4];
};

} // namespace offsets_test

template <>
inline constexpr auto rowe::schema<offsets_test::in_cpp> =
    rowe::fields<&offsets_test::in_cpp::n, &offsets_test::in_cpp::name, &offsets_test::in_cpp::list,
                 &offsets_test::in_cpp::last>{}
        .type("test/Offsets");

namespace rowe::json {
namespace offsets_test {
namespace {

using ::offsets_test::in_c;
using ::offsets_test::in_cpp;

const void* itself(const void* at) noexcept { return at; }
std::size_t count_at(const void* at) noexcept {
  std::uint16_t count;
  std::memcpy(&count, at, sizeof count);
  return count;
}
void set_count_at(void* at, std::size_t to) noexcept {
  const auto count = static_cast<std::uint16_t>(to);
  std::memcpy(at, &count, sizeof count);
}

constexpr value_description integer{.kind = value_kind::int32, .bytes = 4};
constexpr value_description real{.kind = value_kind::float64, .bytes = 8};
constexpr value_description single{.kind = value_kind::float32, .bytes = 4};
constexpr value_description text{.kind = value_kind::text, .bytes = 8, .count_max = 7};
constexpr value_description list{
    .kind = value_kind::array, .bytes = 16, .count_max = 4, .element = &single, .elements = &itself};

member_description member(std::string_view name, const value_description& type, std::size_t offset) {
  member_description m;
  m.name = name;
  m.type = &type;
  m.address = &itself;
  m.offset = offset;
  return m;
}

const schema_description& described() {
  static const std::array members = [] {
    std::array all{member("n", integer, offsetof(in_c, n)), member("name", text, offsetof(in_c, name)),
                   member("list", list, offsetof(in_c, list)), member("last", real, offsetof(in_c, last))};
    all[2].count = &count_at;
    all[2].set_count = &set_count_at;
    all[2].count_address = &itself;
    all[2].count_offset = offsetof(in_c, list_count);
    all[2].count_limit = 4;
    return all;
  }();
  static const schema_description all{.type_name = "test/Offsets",
                                      .bytes = sizeof(in_c),
                                      .alignment = alignof(in_c),
                                      .members = members,
                                      .decodable = true};
  return all;
}

std::string encoded(const schema_description& type, const void* value, encoding into) {
  return tests::encoded_by(encoder::compile(type, into).value(), value);
}

TEST(offsets, write_what_a_type_of_cpp_writes) {
  in_cpp there;
  there.n = -7;
  there.last = 0.5;
  there.name = "caf\xc3\xa9";
  for (const float x : {1.5F, 2.5F, 3.5F}) EXPECT_TRUE(there.list.push_back(x));
  in_c here{.last = 0.5, .n = -7, .list_count = 3, .name = "caf\xc3\xa9", .list = {1.5F, 2.5F, 3.5F}};
  for (const encoding into : {encoding::json, encoding::cbor, encoding::ros1})
    EXPECT_EQ(encoded(described(), &here, into), encoded(describe<in_cpp>(), &there, into));

  // A text without an end, and a count beyond the array.
  std::memset(here.name, 'x', sizeof here.name);
  here.list_count = 60000;
  EXPECT_EQ(encoded(described(), &here, encoding::json),
            R"({"n":-7,"name":"xxxxxxx","list":[1.5,2.5,3.5,0],"last":0.5})");
}

TEST(offsets, read_what_a_type_of_cpp_reads) {
  const decoder d = decoder::compile(described()).value();
  in_c here;
  std::memset(&here, 0xa5, sizeof here);
  ASSERT_TRUE(d.decode(R"({"last":1,"list":[2,3],"name":"a\u00e9b","n":4})", &here));
  EXPECT_EQ(here.n, 4);
  EXPECT_EQ(here.last, 1);
  EXPECT_STREQ(here.name, "a\xc3\xa9"
                          "b");
  EXPECT_EQ(here.list_count, 2);
  EXPECT_EQ(here.list[1], 3);
  EXPECT_EQ(here.list[2], 0); // what the text does not say is 0
  ASSERT_TRUE(d.decode(R"({"last":1,"list":[2,3,4,5],"name":"1234567","n":4})", &here));
  EXPECT_STREQ(here.name, "1234567");
  EXPECT_EQ(here.list_count, 4);
  for (const std::string_view wrong : {R"({"last":1,"list":[],"name":"12345678","n":4})",
                                       R"({"last":1,"list":[1,2,3,4,5],"name":"","n":4})"})
    EXPECT_EQ(d.decode(wrong, &here).code(), errc::too_long) << wrong;
}

} // namespace
} // namespace offsets_test
} // namespace rowe::json
