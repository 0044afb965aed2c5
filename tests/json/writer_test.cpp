// SPDX-License-Identifier: Apache-2.0
#include "json/writing/writer.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "encoded.hpp"
#include "texts.hpp"

namespace rowe::json {
namespace writer_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// What `write` makes a writer with ample room write.
template <class Write>
std::string written(Write write) {
  std::array<char, 1024> buffer;
  writer w{buffer};
  write(w);
  EXPECT_FALSE(w.overflowed());
  return std::string{w.text()};
}

std::string in_quotes(std::string_view text) { return tests::concat({"\"", text, "\""}); }

std::string string_of(std::string_view text) {
  return written([text](writer& w) { w.string(text); });
}

TEST(writer, places_commas_between_members_and_elements) {
  EXPECT_EQ(written([](writer& w) {
              w.begin_object();
              w.key("a\"b");
              w.number(1);
              w.key("b");
              w.begin_array();
              w.number(1);
              w.begin_array();
              w.end_array();
              w.begin_object();
              w.end_object();
              w.null();
              w.end_array();
              w.key("c");
              w.raw(R"({"x":1})");
              w.key("d");
              w.begin_object();
              w.key("e");
              w.boolean(false);
              w.end_object();
              w.end_object();
            }),
            R"({"a\"b":1,"b":[1,[],{},null],"c":{"x":1},"d":{"e":false}})");
}

TEST(writer, appends_text_without_commas) {
  EXPECT_EQ(written([](writer& w) {
              w.append(R"({"op":"publish","topic":)");
              w.string("/odom");
              w.append(R"(,"msg":{)");
              w.append("}}");
            }),
            R"({"op":"publish","topic":"/odom","msg":{}})");
}

// An array of these.
template <class... Numbers>
std::string array_of(Numbers... numbers) {
  return written([&](writer& w) {
    w.begin_array();
    (w.number(numbers), ...);
    w.end_array();
  });
}

TEST(writer, writes_integers_of_every_width) {
  EXPECT_EQ(array_of(std::int8_t{-128}, std::uint8_t{255}, std::int16_t{-32768}, std::uint16_t{65535},
                     std::int32_t{-2147483647 - 1}, std::uint32_t{4294967295},
                     std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::uint64_t>::max(), 1L,
                     2ULL),
            "[-128,255,-32768,65535,-2147483648,4294967295,-9223372036854775808,18446744073709551615,1,2]");
}

TEST(writer, writes_doubles_and_floats_as_short_as_they_are) {
  EXPECT_EQ(array_of(0.1, 0.1f, -0.0, 0x1p64), "[0.1,0.1,-0.0,1.8446744073709552e19]");
}

TEST(writer, writes_what_is_no_number_as_null_and_counts_it) {
  std::array<char, 64> buffer;
  writer w{buffer};
  w.begin_array();
  w.number(infinity);
  w.number(-infinity);
  w.number(std::numeric_limits<double>::quiet_NaN());
  w.number(std::numeric_limits<float>::quiet_NaN());
  w.number(1.0);
  w.end_array();
  EXPECT_EQ(w.text(), "[null,null,null,null,1]");
  EXPECT_EQ(w.nonfinite(), 4u);
}

TEST(writer, escapes_quotes_backslashes_and_control_characters) {
  EXPECT_EQ(string_of("say \"hi\"\\"), R"("say \"hi\"\\")");
  EXPECT_EQ(string_of("\b\f\n\r\t"), R"("\b\f\n\r\t")");
  EXPECT_EQ(string_of(std::string_view{"\0\x01\x1f\x7f", 4}), "\"\\u0000\\u0001\\u001f\x7f\"");
  EXPECT_EQ(string_of("a/b"), R"("a/b")");
}

TEST(writer, finds_what_to_escape_at_every_position) {
  for (std::size_t length = 1; length < 20; ++length) {
    for (std::size_t at = 0; at < length; ++at) {
      std::string text(length, 'a');
      text[at] = '"';
      std::string expected = text;
      expected.insert(at, 1, '\\');
      EXPECT_EQ(string_of(text), in_quotes(expected));
      text[at] = '\x1f';
      expected = text;
      expected.replace(at, 1, "\\u001f");
      EXPECT_EQ(string_of(text), in_quotes(expected));
    }
  }
}

TEST(writer, keeps_utf8_as_it_is) {
  for (const std::string_view text :
       {"é", "€", "😀", "aé€😀z", "\xf4\x8f\xbf\xbf", "\xed\x9f\xbf", "\xee\x80\x80"}) {
    EXPECT_EQ(string_of(text), in_quotes(text));
  }
}

TEST(writer, replaces_each_piece_that_is_no_utf8) {
  struct {
    std::string_view text;
    std::string_view expected;
  } const cases[] = {
      {"\x80", "\"\uFFFD\""},
      {"a\xffz", "\"a\uFFFDz\""},
      {"\xc0\xaf", "\"\uFFFD\uFFFD\""},                     // overlong
      {"\xe0\x80\x80", "\"\uFFFD\uFFFD\uFFFD\""},           // overlong
      {"\xed\xa0\x80", "\"\uFFFD\uFFFD\uFFFD\""},           // a surrogate
      {"\xf4\x90\x80\x80", "\"\uFFFD\uFFFD\uFFFD\uFFFD\""}, // beyond Unicode
      {"\xe2\x82", "\"\uFFFD\""},                           // cut off
      {"\xe2\x82z", "\"\uFFFDz\""},
      {"\xf0\x9f\x98", "\"\uFFFD\""},
      {"\xf0\x9f\x98\"", "\"\uFFFD\\\"\""},
      {"\xc3", "\"\uFFFD\""},
  };
  for (const auto& c : cases) {
    std::array<char, 64> buffer;
    writer w{buffer};
    w.string(c.text);
    EXPECT_EQ(w.text(), c.expected);
  }
}

// A text with every kind of piece in it.
void write_everything(writer& w) {
  w.begin_object();
  w.key("text \"and\" more");
  w.string("long enough for whole words, \n, é, \xff, and then some");
  w.key("numbers");
  w.begin_array();
  w.number(0.1234567890123456);
  w.number(-1.5e-300);
  w.number(3.25f);
  w.number(-12345);
  w.number(std::uint64_t{18446744073709551615u});
  w.number(infinity);
  w.end_array();
  w.key("b");
  w.boolean(false);
  w.key("n");
  w.null();
  w.key("r");
  w.raw("[1,2,3]");
  w.append(" ");
  w.end_object();
}

TEST(writer, writes_nothing_beyond_its_buffer_at_any_length) {
  const std::string whole = written(write_everything);
  for (std::size_t length = 0; length <= whole.size() + 50; ++length)
    tests::expect_written_within(length, whole, write_everything);
}

TEST(writer, stays_overflowed_even_where_a_shorter_piece_would_fit) {
  std::array<char, 8> buffer;
  writer w{buffer};
  w.begin_array();
  w.string("much too long for this room");
  w.number(1);
  w.null();
  w.end_array();
  EXPECT_TRUE(w.overflowed());
}

TEST(writer, of_no_buffer_overflows) {
  writer w{std::span<char>{}};
  EXPECT_FALSE(w.overflowed());
  w.append("");
  EXPECT_FALSE(w.overflowed());
  EXPECT_EQ(w.bytes(), 0u);
  w.number(1);
  EXPECT_TRUE(w.overflowed());
}

} // namespace
} // namespace writer_test
} // namespace rowe::json
