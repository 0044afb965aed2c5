// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/c_tables.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include <rowe/schema.hpp>

namespace c_tables_test {

enum class mode : std::uint8_t { off, mapping };
struct inner {
  double x;
};
struct everything {
  bool on;
  std::int64_t serial;
  float ranges[8];
  std::uint32_t range_count;
  rowe::fixed_string<8> frame;
  mode what;
  std::chrono::milliseconds age;
  std::chrono::nanoseconds took;
  std::optional<inner> maybe;
  rowe::bounded_array<inner, 4> path;
  std::array<std::uint8_t, 3> bits, numbers;
  double odd;
};
struct empty {};
struct arrays {
  std::array<std::array<double, 2>, 2> matrix;
};
struct holds_arrays {
  arrays inside;
};
struct vast {
  rowe::fixed_string<1'000'000> texts[100];
};

} // namespace c_tables_test

template <>
inline constexpr auto rowe::schema<c_tables_test::vast> = rowe::fields<&c_tables_test::vast::texts>{};
template <>
inline constexpr auto rowe::names<c_tables_test::mode> =
    rowe::enumerators<c_tables_test::mode::off, c_tables_test::mode::mapping>{};
template <>
inline constexpr auto
    rowe::schema<c_tables_test::inner> = rowe::fields<&c_tables_test::inner::x>{}.type("my_robot/Inner");
template <>
inline constexpr auto rowe::schema<c_tables_test::everything> =
    rowe::fields<&c_tables_test::everything::on, rowe::field<&c_tables_test::everything::serial>.as_string(),
                 rowe::counted<&c_tables_test::everything::ranges, &c_tables_test::everything::range_count>,
                 &c_tables_test::everything::frame, rowe::field<&c_tables_test::everything::what>.by_name(),
                 rowe::field<&c_tables_test::everything::age>.as_seconds(), &c_tables_test::everything::took,
                 &c_tables_test::everything::maybe, &c_tables_test::everything::path,
                 &c_tables_test::everything::bits,
                 rowe::field<&c_tables_test::everything::numbers>.as_numbers(),
                 rowe::field<&c_tables_test::everything::odd, "double \"?">>{};
template <>
inline constexpr auto rowe::schema<c_tables_test::empty> = rowe::fields<>{};
template <>
inline constexpr auto rowe::schema<c_tables_test::arrays> =
    rowe::fields<&c_tables_test::arrays::matrix>{}.type("my_robot/Arrays");
template <>
inline constexpr auto rowe::schema<c_tables_test::holds_arrays> =
    rowe::fields<&c_tables_test::holds_arrays::inside>{};

namespace rowe::tools {
namespace c_tables_test {
namespace {

using namespace ::c_tables_test;

TEST(c_tables, have_a_struct_and_a_table_for_each_type) {
  const c_text made = c_tables({{&describe<everything>(), "/every thing"}});
  EXPECT_TRUE(made.reasons.empty());
  EXPECT_EQ(made.text, R"(#include <rowe/struct.h>

static const struct rowe_name every_thing_what_names[] = {
    {"off", 0},
    {"mapping", 1},
};

struct my_robot_Inner {
  double x;
};
static const struct rowe_member my_robot_Inner_members[] = {
    ROWE_MEMBER(struct my_robot_Inner, x, rowe_member_double),
};
static const struct rowe_struct my_robot_Inner_type = {
    "my_robot/Inner", sizeof(struct my_robot_Inner), my_robot_Inner_members, 1};

struct every_thing {
  bool on;
  int64_t serial;
  float ranges[8];
  uint32_t ranges_count;
  char frame[9];
  uint8_t what;
  int64_t age;
  int64_t took;
  struct my_robot_Inner maybe;
  struct my_robot_Inner path[4];
  uint32_t path_count;
  uint8_t bits[3];
  uint8_t numbers[3];
  double double_;
};
static const struct rowe_member every_thing_members[] = {
    ROWE_MEMBER(struct every_thing, on, rowe_member_bool),
    ROWE_MEMBER(struct every_thing, serial, rowe_member_int64 | rowe_member_as_string),
    ROWE_COUNTED(struct every_thing, ranges, rowe_member_float,
                 NULL, ranges_count, rowe_member_uint32),
    ROWE_MEMBER(struct every_thing, frame, rowe_member_text),
    ROWE_NAMED(struct every_thing, what, rowe_member_uint8, every_thing_what_names),
    ROWE_MEMBER(struct every_thing, age, rowe_member_duration | rowe_member_as_seconds),
    ROWE_MEMBER(struct every_thing, took, rowe_member_duration),
    {"maybe", rowe_member_struct | rowe_member_or_default,
     offsetof(struct every_thing, maybe), sizeof(ROWE_NOWHERE(struct every_thing)->maybe),
     0, 0, 0, &my_robot_Inner_type, NULL, NULL, 0},
    ROWE_COUNTED(struct every_thing, path, rowe_member_struct,
                 &my_robot_Inner_type, path_count, rowe_member_uint32),
    ROWE_ARRAY(struct every_thing, bits, rowe_member_uint8, NULL),
    ROWE_ARRAY(struct every_thing, numbers, rowe_member_uint8 | rowe_member_as_numbers, NULL),
    {"double \042\077", rowe_member_double,
     offsetof(struct every_thing, double_), sizeof(ROWE_NOWHERE(struct every_thing)->double_),
     0, 0, 0, NULL, NULL, NULL, 0},
};
static const struct rowe_struct every_thing_type = {
    NULL, sizeof(struct every_thing), every_thing_members, 12};
)");
}

TEST(c_tables, call_no_two_types_and_no_two_members_alike) {
  const c_text made = c_tables({{&describe<empty>(), "int"}, {&describe<inner>(), "x"}});
  EXPECT_NE(made.text.find("struct int_ {\n  char no_member;\n};\n"), std::string::npos);
  EXPECT_NE(made.text.find(
                "static const struct rowe_struct int__type = {\n    NULL, sizeof(struct int_), NULL, 0};"),
            std::string::npos);
  std::array<member_description, 2> members{describe<inner>().members[0], describe<inner>().members[0]};
  members[0].name = "a-b";
  members[1].name = "a b";
  schema_description twice = describe<inner>();
  twice.members = members;
  const c_text both = c_tables({{&describe<inner>(), ""}, {&twice, ""}});
  EXPECT_NE(both.text.find("struct my_robot_Inner_2 {\n  double a_b;\n  double a_b_2;\n};\n"),
            std::string::npos);
}

TEST(c_tables, leave_out_what_c_does_not_have_and_say_so) {
  const c_text made =
      c_tables({{&describe<holds_arrays>(), "a"}, {&describe<inner>(), "b"}, {&describe<vast>(), "c"}});
  ASSERT_EQ(made.reasons.size(), 2U);
  EXPECT_EQ(made.reasons[0], "the member matrix is an array of arrays or of optionals");
  EXPECT_EQ(made.reasons[1], "the member texts would be larger than 64 MiB");
  EXPECT_EQ(made.text.find("Arrays"), std::string::npos);
  EXPECT_NE(made.text.find("struct my_robot_Inner {"), std::string::npos);
}

} // namespace
} // namespace c_tables_test
} // namespace rowe::tools
