// SPDX-License-Identifier: Apache-2.0
#include "json/writing/splice.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace rowe::json {
namespace splice_test {
namespace {

enum class around : std::uint8_t { nothing, before, behind, both };

// An object with members before and behind a value that is spliced into it.
template <class Write>
void write_spliced(writer& w, around which, Write write) {
  w.begin_object();
  if (which == around::before || which == around::both) {
    w.key("b");
    w.number(1);
  }
  splice value{w};
  write(w);
  value.end("v");
  if (which == around::behind || which == around::both) {
    w.key("e");
    w.number(2);
  }
  w.end_object();
}

template <class Write>
std::string spliced_with(around which, Write write) {
  std::array<char, 256> buffer{};
  writer w{buffer};
  write_spliced(w, which, write);
  EXPECT_FALSE(w.overflowed());
  return std::string{w.text()};
}

std::string spliced(around which, std::string_view value) {
  return spliced_with(which, [value](writer& w) {
    if (!value.empty()) w.raw(value);
  });
}

// Whatever is around it, a value gives these members to the object.
void expect_members(std::string_view value, const std::string& members) {
  const std::string comma = members.empty() ? "" : ",";
  const auto of = [&](around which) {
    const std::string text = spliced(which, value);
    return text.substr(text.find('{')); // behind white space of the value's
  };
  EXPECT_EQ(of(around::both), R"({"b":1,)" + members + comma + R"("e":2})");
  EXPECT_EQ(of(around::before), R"({"b":1)" + comma + members + "}");
  EXPECT_EQ(of(around::behind), "{" + members + comma + R"("e":2})");
  EXPECT_EQ(of(around::nothing), "{" + members + "}");
}

TEST(splice, makes_the_members_of_an_object_those_of_the_one_around_it) {
  expect_members(R"({"x":1,"y":{"z":[]}})", R"("x":1,"y":{"z":[]})");
}

TEST(splice, leaves_no_comma_for_an_object_without_members_or_for_nothing) {
  for (const std::string_view empty : {"{}", "{ }", " {\n\t} ", ""}) expect_members(empty, "");
}

TEST(splice, tolerates_white_space_in_a_users_text) {
  EXPECT_EQ(spliced(around::both, " {\n \"x\" : 1\r\n}\t"), "{\"b\":1 ,\n \"x\" : 1,\"e\":2}");
  EXPECT_EQ(spliced(around::behind, " { \"x\":1 } "), " { \"x\":1,\"e\":2}");
}

TEST(splice, gives_a_name_to_what_is_no_object) {
  for (const std::string value : {"[1,{}]", "\"}\"", "7", "true", "null"})
    expect_members(value, R"("v":)" + value);
}

TEST(splice, takes_what_is_written_piece_by_piece) {
  const auto pieces = [](writer& w) {
    w.begin_object();
    w.key("x");
    w.number(1.5);
    w.key("s");
    w.string("}");
    w.end_object();
  };
  EXPECT_EQ(spliced_with(around::both, pieces), R"({"b":1,"x":1.5,"s":"}","e":2})");
  EXPECT_EQ(spliced_with(around::behind, [](writer& w) { w.number(7); }), R"({"v":7,"e":2})");
}

TEST(splice, can_be_in_an_array_and_in_another_splice) {
  std::array<char, 256> buffer{};
  writer w{buffer};
  w.begin_array();
  w.number(0);
  write_spliced(w, around::behind, [](writer& in) {
    write_spliced(in, around::both, [](writer& inner) { inner.raw(R"({"x":1})"); });
  });
  w.number(9);
  w.end_array();
  EXPECT_EQ(w.text(), R"([0,{"b":1,"x":1,"e":2,"e":2},9])");
}

TEST(splice, writes_all_or_says_that_it_does_not_fit) {
  for (const std::string_view value : {"{}", R"({"x":1})", "[1,2,3]", "7", " {\"x\" : 1} "}) {
    for (const around which : {around::nothing, around::before, around::behind, around::both}) {
      const std::string whole = spliced(which, value);
      bool fitted = false;
      for (std::size_t bytes = 0; bytes <= 64; ++bytes) {
        std::vector<char> buffer(bytes);
        writer w{buffer};
        write_spliced(w, which, [value](writer& in) { in.raw(value); });
        EXPECT_TRUE(w.overflowed() || w.text() == whole) << value << " in " << bytes;
        EXPECT_TRUE(!fitted || !w.overflowed()) << value << " in " << bytes;
        fitted = fitted || !w.overflowed();
      }
      EXPECT_TRUE(fitted) << value;
    }
  }
}

TEST(splice, keeps_what_the_writer_counted) {
  std::array<char, 64> buffer{};
  writer w{buffer};
  write_spliced(w, around::nothing, [](writer& in) { in.number(std::numeric_limits<double>::infinity()); });
  EXPECT_EQ(w.text(), R"({"v":null})");
  EXPECT_EQ(w.nonfinite(), 1U);
}

} // namespace
} // namespace splice_test
} // namespace rowe::json
