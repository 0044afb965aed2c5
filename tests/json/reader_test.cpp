// SPDX-License-Identifier: Apache-2.0
#include "json/reading/reader.hpp"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "equivalence.hpp"
#include "padded.hpp"
#include "scanned.hpp"
#include "texts.hpp"

namespace rowe::json {
namespace reader_test {
namespace {

using namespace std::string_literals;
using tests::concat;
using tests::padded;
using tests::repeat;

class validation : public ::testing::Test {
 protected:
  status validate(std::string_view text) {
    const padded p{text};
    const bool by_tokens = reader_.validate_tokens(p.text());
    const status s = reader_.validate(p.text());
    EXPECT_TRUE(s || !by_tokens) << text;
    if (text.size() > bytes_max) return s;
    // Both judges, whichever the reader asked.
    const fault f = find_fault(p.text(), reader::depth_max_default);
    EXPECT_EQ(f.what == fault_kind::none, s.has_value()) << text;
    judge_by_pieces(text, f);
    return s;
  }
  // Wherever a text is cut, the scanner says the same.
  void judge_by_pieces(std::string_view text, const fault& f) {
    const std::size_t cuts = text.size() <= 200 ? text.size() : 3;
    for (std::size_t cut = 1; cut <= std::max<std::size_t>(cuts, 1); ++cut) {
      std::size_t pieces = 0;
      const scanner in_two =
          tests::scanned(text, reader::depth_max_default, [&] { return pieces++ == 0 ? cut : text.size(); });
      ASSERT_TRUE(in_two.found() == f) << text << " cut at " << cut;
      const scanner in_many = tests::scanned(text, reader::depth_max_default, [&] { return cut; });
      ASSERT_TRUE(in_many.found() == f) << text << " in pieces of " << cut;
      if (f.what != fault_kind::none) continue;
      ASSERT_TRUE(tests::notes_what_is_walked(in_two, text)) << text;
      ASSERT_TRUE(tests::notes_what_is_walked(in_many, text)) << text;
    }
  }
  void accepts(std::initializer_list<std::string_view> texts) {
    for (const std::string_view text : texts) EXPECT_TRUE(validate(text)) << text;
  }
  // Each is wrong at this byte.
  void refuses(std::int64_t at, std::initializer_list<std::string_view> texts) {
    for (const std::string_view text : texts)
      EXPECT_EQ(validate(text).error(), (error{errc::malformed, at})) << text;
  }

  static constexpr std::size_t bytes_max = 64 * 1024;
  reader reader_ = reader::create(bytes_max).value();
};

TEST_F(validation, accepts_values_of_every_kind) {
  accepts({"{}", "[]", "\"\"", "0", "true", "false", "null", "\"a\"", "-1", "[1]", "{\"a\":1}", "[[]]",
           "[{}]", "{\"a\":[]}", "{\"a\":{}}", "[1,2]", "{\"a\":1,\"b\":2}"});
}

TEST_F(validation, accepts_white_space_between_tokens) {
  accepts(
      {" 1", "1 ", "\t1\r\n", " [ ] ", "[ 1 , 2 ]", "{ \"a\" : 1 , \"b\" : [ ] }", "\n\n{}\n", "[\r1\r]"});
}

TEST_F(validation, accepts_numbers_of_every_shape) {
  accepts({"0",   "-0",   "0.0",  "-0.0",  "1",   "-1",     "10",     "1.5",      "-1.5",      "1e5",
           "1E5", "1e+5", "1e-5", "1.5e5", "0e0", "0.0e-0", "1e-400", "4.9e-324", "0.000e400", "1e308"});
  accepts({"0e99999999999999999999", "1e-99999999999999999999", "9223372036854775807", "9223372036854775808",
           "-9223372036854775808", "18446744073709551615", "1.7976931348623157e308",
           "2.2250738585072011e-308", "100000000000000000000e-20", "1.000000000000000000000000000",
           "0.1234567890123456789012345678901234567890"});
}

TEST_F(validation, accepts_integers_beyond_64_bits) {
  // As a browser writes 2^64, and worse.
  accepts({"18446744073709552000", "18446744073709551616", "-9223372036854775809",
           "[1,18446744073709552000,\"a\"]", "{\"stamp\":1700000000000000000000}",
           "-170141183460469231731687303715884105728", concat({"1", repeat("0", 308)})});
}

TEST_F(validation, refuses_what_no_double_can_hold) {
  // Among them the largest exponent that 64 bits hold.
  refuses(0, {"1e400", "-1e400", "123e307", "1e309", "2e308", "1e99999999999999999999",
              "1e9223372036854775807", "1.7976931348623159e308", concat({"1", repeat("0", 309)})});
  refuses(3, {"[1,1e309]"});
  refuses(1, {concat({"[1", repeat("0", 309), "]"})});
  refuses(30, {"{\"a\":18446744073709552000,\"b\":1e400}"});
}

TEST_F(validation, refuses_what_is_no_number) {
  refuses(0, {"+1", ".5", "\xef\xbc\x91"});
  refuses(1, {"01", "00", "-", "--1", "-.5", "0x10", "1_000", "1,5", "1a", "1\f"});
  refuses(2, {"-01", "1.", "1.e5", "1e", "1e.5", "1ex", "[-]", "[0123]"});
  refuses(3, {"1e+", "1e+x", "1e1.5", "1e5e5", "[1 2]", "[1.]"});
  refuses(20, {"18446744073709552000x"});
}

TEST_F(validation, refuses_words_that_are_not_json) {
  for (const std::string_view text :
       {"NaN", "Infinity", "undefined", "True", "NULL", "nan", "inf", "'a'", "a", "/", "#"}) {
    const padded p{text};
    EXPECT_EQ(reader_.validate(p.text()).code(), errc::malformed) << text;
  }
  refuses(1, {"[NaN]", "[Infinity]"});
  refuses(2, {"[-NaN]", "[-Infinity]"});
  refuses(3, {"tru", "trux", "nul"});
  refuses(4, {"true1", "truefalse", "nulll", "fals "});
  refuses(6, {"[true false]"});
  refuses(8, {"{\"a\":tru}"});
}

TEST_F(validation, refuses_what_is_missing_or_superfluous) {
  refuses(0, {"", "]", "}", ",", ":"});
  refuses(1, {"[", "{", "[,1]", "{]", "{,}", "{:1}", "{1:1}", "{a:1}", "{'a':1}", "{null:1}", "{[]:1}"});
  refuses(2, {"  ", "[1", "[1}", "[1:2]", "{}}"});
  refuses(3, {"[1,", "[1,]", "[1,,2]", "[1]]", "[[]"});
  refuses(4, {"{\"a\"", "{\"a\"}", "[\"a\":1]", "{\"a\",\"b\"}"});
  refuses(5, {"{\"a\":", "{\"a\":}", "{\"a\" 1}", "{\"a\"::1}"});
  refuses(6, {"{\"a\":1", "{\"a\":1:2}"});
  refuses(7, {"{\"a\":1,", "{\"a\":1,}", "{\"a\":1 \"b\":2}"});
  refuses(10, {"{\"a\":1,\"b\"}"});
}

TEST_F(validation, refuses_anything_behind_the_value) {
  refuses(2, {"1 2", "{}\0"s, "[]\xc3\xa9", "1 // one"});
  refuses(3, {"{} {}", "\"a\"\"b\"", "[] /* none */"});
  refuses(4, {"[1] x", "null,", "\"a\" 1"});
}

TEST_F(validation, refuses_a_byte_order_mark) {
  refuses(0, {"\xef\xbb\xbf{}", "\xef\xbb\xbf"});
  accepts({"\"\xef\xbb\xbf\""}); // inside a string it is a character
}

TEST_F(validation, refuses_comments_and_odd_white_space) {
  refuses(1, {"[\f]", "[\v]", "[\xc2\xa0]", "[\xe2\x80\xa8]", "[\0]"s, "[\x7f]"});
  refuses(3, {"[1,/*2*/3]"});
}

TEST_F(validation, accepts_every_escape) {
  accepts({R"("\"\\\/\b\f\n\r\t")", R"("\u0000")", R"("\u001f")", R"("\uffff")", R"("\uFFFF")",
           R"("\ud83d\ude00")", R"("\uD83D\uDE00")", R"("\udbff\udfff")", R"("\u2028")", R"({"\u0061":1})",
           R"("\\u12")", R"("\\")"});
}

TEST_F(validation, refuses_bad_escapes) {
  refuses(2, {R"("\a")", R"("\x41")", R"("\0")", R"("\'")", R"("\U0041")", "\"\\\n\"", "\"\\\xc3\xa9\""});
  refuses(3, {R"("\u")", R"("\u 041")", R"({"\x":1})", "[\"\\", "\"\\\""});
  refuses(5, {R"("\u00g0")"});
  refuses(6, {R"("\u004")"});
}

TEST_F(validation, refuses_surrogates_without_their_other_half) {
  refuses(1, {R"("\ud800")", R"("\udc00")", R"("\ud800\ud800")", R"("\ud800a")", R"("\ud800\n")",
              R"("\ud800\u0041")", R"("\udc00\ud800")", R"("\ud800\ue000")", R"("\ud800)", R"("\ud800\)",
              R"("\ud800\u00)", R"("\ud800\u00g0")"});
  refuses(2, {R"("a\udfff")", R"({"\udead":1})"});
}

TEST_F(validation, refuses_control_characters_in_strings) {
  for (char c = 0; c < 0x20; ++c) refuses(2, {"\"a"s + c + "\""});
  refuses(3, {"{\"a\nb\":1}"});
  accepts({"\"\x7f\""});
}

TEST_F(validation, refuses_strings_without_an_end) {
  refuses(1, {"\""});
  refuses(2, {"\"a"});
  refuses(3, {"{\"a"});
  refuses(4, {"[\"a]", "\"a\\\""});
  refuses(6, {"{\"a:1}"});
}

TEST_F(validation, accepts_utf8_to_its_limits) {
  accepts({"\"\xc2\x80\"", "\"\xdf\xbf\"", "\"\xe0\xa0\x80\"", "\"\xed\x9f\xbf\"", "\"\xee\x80\x80\"",
           "\"\xef\xbf\xbf\"", "\"\xf0\x90\x80\x80\"", "\"\xf4\x8f\xbf\xbf\"", "{\"\xc3\xa9\":1}"});
}

TEST_F(validation, refuses_what_is_no_utf8) {
  refuses(0, {"\xff"});
  refuses(1, {"\"\x80\"", "\"\xc3\"", "\"\xc3(\"", "\"\xc0\xaf\"", "\"\xc1\xbf\"", "\"\xe0\x9f\xbf\"",
              "\"\xe2\x82\"", "\"\xe2(\xa1\"", "\"\xed\xa0\x80\"", "\"\xed\xbf\xbf\"", "\"\xf0\x8f\xbf\xbf\"",
              "\"\xf0\x9f\x98\"", "\"\xf4\x90\x80\x80\"", "\"\xf5\x80\x80\x80\"", "\"\xfe\"", "\"\xff\"",
              "\"\xc3"});
  refuses(2, {"\"a\xbf\"", "{\"\xff\":1}", "[\"\xf0\x9f"});
}

TEST_F(validation, accepts_names_that_repeat) {
  accepts({R"({"a":1,"a":2})", R"({"":1,"":2})", R"({"op":"publish","\u006fp":"subscribe"})"});
}

TEST_F(validation, judges_a_text_by_all_of_it) {
  const std::string sample =
      R"({"op":"publish","topic":"\/odom","msg":{"x":-1.5e-3,"ok":[true,null,"\u00e9"],)"
      R"("n":18446744073709552000}})";
  accepts({sample});
  for (std::size_t bytes = 0; bytes < sample.size(); ++bytes) {
    const padded p{std::string_view{sample}.substr(0, bytes)};
    const status s = reader_.validate(p.text());
    ASSERT_FALSE(s) << p.text();
    EXPECT_EQ(s.code(), errc::malformed);
    EXPECT_LE(s.error().value, static_cast<std::int64_t>(bytes));
    EXPECT_NE(find_fault(p.text(), 64).what, fault_kind::none);
  }
}

TEST_F(validation, refuses_by_tokens_alone_what_takes_a_scanner_to_accept) {
  const padded usual{R"({"a":1})"}, digits{concat({"[", repeat("1", 250), "]"})};
  EXPECT_TRUE(reader_.validate_tokens(usual.text()));
  EXPECT_EQ(reader_.last().indexed.size(), 1U);
  EXPECT_FALSE(reader_.validate_tokens(digits.text()));
  EXPECT_TRUE(reader_.last().text.empty());
  EXPECT_TRUE(reader_.validate(digits.text()));
}

TEST_F(validation, knows_the_members_before_a_fault) {
  const padded p{R"({"id":"7","op":1,"x":[1,]})"};
  EXPECT_FALSE(reader_.validate(p.text()));
  const auto members = reader_.members_before_fault();
  ASSERT_EQ(members.size(), 2U);
  EXPECT_EQ(p.text().substr(members[1].name.at, members[1].name.bytes), "op");
  const padded longer{std::string(bytes_max + 1, ' ')};
  EXPECT_FALSE(reader_.validate(longer.text()));
  EXPECT_TRUE(reader_.members_before_fault().empty());
}

TEST_F(validation, never_looks_at_what_stands_behind_the_text) {
  for (const std::string_view behind : {"", "]", "\"", "0", "e5", "\\", "\xff\xff", "}", "null"}) {
    const std::string text = concat({"[1,[2]", behind, repeat("]", reader::tailroom_bytes)});
    EXPECT_EQ(reader_.validate(std::string_view{text}.substr(0, 6)).code(), errc::malformed) << behind;
    const std::string whole = concat({"[1,2]", behind, repeat("]", reader::tailroom_bytes)});
    EXPECT_TRUE(reader_.validate(std::string_view{whole}.substr(0, 5))) << behind;
  }
}

TEST_F(validation, has_a_limit_of_depth) {
  const auto nested = [](std::size_t depth, std::string_view inside) {
    return concat({repeat("[", depth), inside, repeat("]", depth)});
  };
  const auto objects = [](std::size_t depth) {
    return concat({repeat("{\"a\":", depth), "1", repeat("}", depth)});
  };
  for (const std::size_t depth : {1u, 62u, 63u, 64u}) {
    accepts({nested(depth, ""), nested(depth, "1"), objects(depth),
             concat({"[[],", nested(depth - 1, "1"), "]"})});
  }
  for (const std::size_t depth : {65u, 66u, 100u, 10'000u}) {
    EXPECT_EQ(validate(nested(depth, "")).error(), (error{errc::too_deep, 64, 64})) << depth;
    EXPECT_EQ(validate(nested(depth, "1")).error(), (error{errc::too_deep, 64, 64})) << depth;
    EXPECT_EQ(validate(objects(depth)).code(), errc::too_deep) << depth;
    EXPECT_EQ(validate(repeat("[", depth)).code(), errc::too_deep) << depth;
  }
  accepts({nested(64, "18446744073709552000")});
  refuses(64, {nested(64, "1e400")});
}

TEST_F(validation, has_a_limit_of_length) {
  reader small = reader::create(16).value();
  const padded fits{"[1,2,3,4,5,6,78]"}, longer{"[1,2,3,4,5,6,7,8]"};
  EXPECT_TRUE(small.validate(fits.text()));
  EXPECT_EQ(small.validate(longer.text()).error(), (error{errc::too_big, 17, 16}));
  EXPECT_TRUE(small.validate(fits.text()));
}

TEST_F(validation, is_not_disturbed_by_what_came_before) {
  for (int i = 0; i < 3; ++i) {
    accepts({"{\"a\":[1,2,3]}"});
    refuses(11, {"{\"a\":[1,2,3}"});
    refuses(1, {"\"\xff\""});
    refuses(0, {""});
    EXPECT_EQ(validate(repeat("[", 100)).code(), errc::too_deep);
  }
}

TEST_F(validation, takes_texts_up_to_its_limit) {
  const std::string whole = concat({"[\"", repeat("a", 64 * 1024 - 4), "\"]"});
  accepts({whole, concat({"[", repeat("1,", 32 * 1024 - 2), "1]"}),
           concat({"[", repeat("[],", 21 * 1024), "1]"}), std::string(64 * 1024 - 1, ' ') + "1"});
  EXPECT_EQ(validate(whole + " ").code(), errc::too_big);
}

TEST_F(validation, agrees_with_a_full_on_demand_walk) {
  // Texts that one of simdjson's two parsers is known to judge differently from the other.
  for (const std::string_view text :
       {"[1] 2", "1 2", "{\"a\":1} x", "18446744073709552000", "1e400", "[1e400]", "[1,2]]", "\"\\ud800\"",
        "[01]", "[1.]", "-", "[true", "{\"\\x\":1}", "[\"\\x\"]", "[nul]"}) {
    const padded p{text};
    const bool walk = tests::compare_on_demand(p.text(), text.size() + reader::tailroom_bytes, 64) !=
                      tests::verdict::invalid;
    EXPECT_EQ(reader_.validate(p.text()).has_value(), walk) << text;
  }
}

TEST(reader, is_created_within_limits_only) {
  EXPECT_EQ(reader::create(0).code(), errc::bad_argument);
  EXPECT_EQ(reader::create(std::size_t{1} << 32).code(), errc::bad_argument);
  EXPECT_EQ(reader::create(64, 0).code(), errc::bad_argument);
  EXPECT_EQ(reader::create(64, fault_depth_limit + 1).code(), errc::bad_argument);
  EXPECT_TRUE(reader::create(1, 1));
  EXPECT_TRUE(reader::create(1, fault_depth_limit));
}

TEST(reader, can_be_moved) {
  reader a = reader::create(64).value();
  reader b = std::move(a);
  const padded p{"[1]"};
  EXPECT_TRUE(b.validate(p.text()));
  a = std::move(b);
  EXPECT_TRUE(a.validate(p.text()));
}

TEST(reader, of_one_level_refuses_two) {
  reader r = reader::create(64, 1).value();
  const padded one{"[1,{\"a\":2}]"}, flat{"[1,2]"};
  EXPECT_TRUE(r.validate(flat.text()));
  EXPECT_EQ(r.validate(one.text()).error(), (error{errc::too_deep, 3, 1}));
}

} // namespace
} // namespace reader_test
} // namespace rowe::json
