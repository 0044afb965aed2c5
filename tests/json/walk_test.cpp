// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "equivalence.hpp"
#include "padded.hpp"
#include "rt/seed.hpp"
#include "texts.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json {
namespace walk_test {
namespace {

using tests::padded;

value number(std::string_view text) { return {kind::number, text}; }
value string(std::string_view text) { return {kind::string, text}; }

TEST(object_walk, leaves_a_member_alone_where_there_is_none) {
  object_walk walk{R"( {"g":true,"h":null})"};
  member m;
  ASSERT_TRUE(walk.next(m) && walk.next(m));
  EXPECT_FALSE(walk.next(m) || walk.next(m));
  EXPECT_EQ(m.name_raw, "h");
  EXPECT_EQ(m.what.raw, "null");
}

TEST(walks, find_nothing_in_what_is_of_another_kind) {
  member m;
  for (const std::string_view text : {"", " ", "[]", "[1]", "1", "\"{}\"", "null", "{}", " {  } "})
    EXPECT_FALSE(object_walk{text}.next(m)) << text;
  value v;
  for (const std::string_view text : {"", "{}", "{\"a\":1}", "1", "[]", " [ ] "})
    EXPECT_FALSE(array_walk{text}.next(v)) << text;
}

TEST(root, is_the_value_without_the_space_around_it) {
  EXPECT_EQ(root(" \n{\"a\":1}\t").raw, "{\"a\":1}");
  EXPECT_EQ(root(" 12 ").raw, "12");
  EXPECT_EQ(root(" 12 ").type, kind::number);
  EXPECT_EQ(root("").type, kind::null);
}

TEST(root, is_told_to_be_an_object_by_its_first_byte) {
  for (const char* text : {"{}", " \t\n\r{\"a\":1} "}) EXPECT_TRUE(is_object(text)) << text;
  for (const char* text : {"", " ", "[{}]", "\"{\"", "1", " null"}) EXPECT_FALSE(is_object(text)) << text;
}

TEST(find, searches_from_the_start_and_takes_the_first) {
  constexpr std::string_view text = R"({"a":1,"b":2,"a":3,"\u0063":4})";
  EXPECT_EQ(find(text, "b")->raw, "2");
  EXPECT_EQ(find(text, "a")->raw, "1");
  EXPECT_EQ(find(text, "c")->raw, "4");
  EXPECT_FALSE(find(text, "d"));
  EXPECT_FALSE(find(text, ""));
}

TEST(name_is, understands_escapes) {
  const auto is = [](std::string_view raw, std::string_view text) { return name_is({raw, {}}, text); };
  for (const std::string_view op : {"op", "\\u006fp", "o\\u0070"}) EXPECT_TRUE(is(op, "op")) << op;
  for (const std::string_view other : {"\\u006f", "\\u006fpp", "o", "opp", ""})
    EXPECT_FALSE(is(other, "op")) << other;
  EXPECT_TRUE(is("\\ud83d\\ude00\\n", "😀\n"));
  EXPECT_TRUE(is("", ""));
}

TEST(text_is, compares_strings_only) {
  EXPECT_TRUE(text_is(string("\"/odom\""), "/odom"));
  EXPECT_TRUE(text_is(string("\"\\/odom\""), "/odom"));
  EXPECT_TRUE(text_is(string("\"\""), ""));
  EXPECT_FALSE(text_is(string("\"/odom\""), "/odo"));
  EXPECT_FALSE(text_is(number("1"), "1"));
}

TEST(unescape, gives_the_text_itself_when_nothing_is_escaped) {
  constexpr std::string_view text = "plain é 😀";
  const auto result = unescape(text, {});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->data(), text.data());
}

TEST(unescape, resolves_every_escape) {
  EXPECT_EQ(tests::decoded(R"(\"\\\/\b\f\n\r\t)"), "\"\\/\b\f\n\r\t");
  EXPECT_EQ(tests::decoded(R"(\u0041\u00e9\u20ac\ud83d\uDE00)"), "Aé€😀");
  EXPECT_EQ(tests::decoded(R"(\u0000)"), std::string(1, '\0'));
  EXPECT_EQ(tests::decoded(R"(a\nb)"), "a\nb");
  EXPECT_EQ(tests::decoded(R"(\udbff\udfff)"), "\U0010ffff");
}

TEST(unescape, refuses_scratch_that_is_too_small) {
  constexpr std::string_view escaped = R"(ab\n\u20acz)";
  constexpr std::string_view expected = "ab\n€z";
  for (std::size_t bytes = 0; bytes <= escaped.size(); ++bytes) {
    auto scratch = std::make_unique<char[]>(bytes); // exactly so many, for the address sanitizer to watch
    const auto text = unescape(escaped, {scratch.get(), bytes});
    EXPECT_EQ(text.has_value(), bytes >= expected.size()) << bytes;
    if (text) {
      EXPECT_EQ(*text, expected);
    }
  }
}

TEST(to_double, takes_numbers_only) {
  EXPECT_EQ(to_double(number("0.1234567890123456789012345")), 0.1234567890123456789012345);
  EXPECT_FALSE(to_double(string("\"1\"")));
  EXPECT_FALSE(to_double({kind::null, "null"}));
}

TEST(to_double, takes_what_is_too_small_for_zero_and_keeps_its_sign) {
  const std::string small = tests::concat({"0.", tests::repeat("0", 400), "1"});
  for (const std::string& text : std::initializer_list<std::string>{
           "0.0", "-0.0", "-0", "1e-400", "-1e-400", "123456789e-99999999999999999999", small,
           "0e99999999999999999999", "0.1e-9223372036854775807", "0.1e-9223372036854775808"}) {
    EXPECT_EQ(to_double(number(text)), 0.0) << text;
    EXPECT_EQ(std::signbit(*to_double(number(text))), text.starts_with('-')) << text;
  }
}

TEST(to_double, reads_back_what_the_writer_writes) {
  tests::seeded random;
  for (int i = 0; i < 100'000; ++i) {
    const auto x = std::bit_cast<double>(random());
    if (!std::isfinite(x)) continue;
    std::array<char, 64> buffer;
    writer w{buffer};
    w.number(x);
    const auto y = to_double(number(w.text()));
    ASSERT_TRUE(y) << w.text();
    ASSERT_EQ(std::bit_cast<std::uint64_t>(*y), std::bit_cast<std::uint64_t>(x)) << w.text();
  }
}

TEST(to_integer, takes_integers_only) {
  EXPECT_EQ(to_integer(number("0")), 0);
  EXPECT_EQ(to_integer(number("-0")), 0);
  EXPECT_EQ(to_integer(number("9223372036854775807")), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(to_integer(number("-9223372036854775808")), std::numeric_limits<std::int64_t>::min());
  for (const std::string_view text :
       {"9223372036854775808", "-9223372036854775809", "1.0", "1e3", "1E3", "0.0"}) {
    EXPECT_FALSE(to_integer(number(text))) << text;
  }
  EXPECT_FALSE(to_integer(string("\"1\"")));
}

TEST(to_unsigned, takes_integers_from_zero) {
  EXPECT_EQ(to_unsigned(number("18446744073709551615")), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(to_unsigned(number("0")), 0u);
  for (const std::string_view text : {"18446744073709551616", "-1", "1.0", "1e3"}) {
    EXPECT_FALSE(to_unsigned(number(text))) << text;
  }
}

TEST(to_boolean, takes_booleans_only) {
  EXPECT_EQ(to_boolean({kind::boolean, "true"}), true);
  EXPECT_EQ(to_boolean({kind::boolean, "false"}), false);
  EXPECT_FALSE(to_boolean({kind::null, "null"}));
  EXPECT_FALSE(to_boolean(number("1")));
}

// ---- any text ----

// A random document with everything in it, written with odd spacing.
class generator {
 public:
  explicit generator(std::uint64_t s) : random_{s} {}

  std::string document() {
    text_.clear();
    value(0);
    return text_;
  }

 private:
  std::uint64_t below(std::uint64_t n) { return random_() % n; }
  void space() {
    while (below(4) == 0) text_ += " \t\n\r"[below(4)];
  }
  void value(int depth) {
    space();
    const std::uint64_t choice = below(depth < 8 ? 10 : 7);
    if (choice >= 8) {
      object(depth);
    } else if (choice == 7) {
      array(depth);
    } else if (choice >= 5) {
      string();
    } else if (choice >= 2) {
      number();
    } else {
      static constexpr const char* words[] = {"true", "false", "null"};
      text_ += words[below(3)];
    }
    space();
  }
  void array(int depth) {
    text_ += '[';
    for (std::uint64_t i = 0, n = below(5); i < n; ++i) {
      if (i != 0) text_ += ',';
      value(depth + 1);
    }
    if (text_.back() == '[') space();
    text_ += ']';
  }
  void object(int depth) {
    text_ += '{';
    for (std::uint64_t i = 0, n = below(6); i < n; ++i) {
      if (i != 0) text_ += ',';
      space();
      string();
      space();
      text_ += ':';
      value(depth + 1);
    }
    if (text_.back() == '{') space();
    text_ += '}';
  }
  void string() {
    static constexpr const char* pieces[] = {
        "a",       "some longer text ", "\\n", "\\\"", "\\\\", "\\/", "\\u0041", "\\ud83d\\ude00",
        "\\u00e9", "\xc3\xa9",          "{",   "]",    ",",    ":",   "\\u0000", "\xf0\x9f\x98\x80",
        "op"};
    text_ += '"';
    for (std::uint64_t i = 0, n = below(6); i < n; ++i) text_ += pieces[below(std::size(pieces))];
    text_ += '"';
  }
  void number() {
    if (below(2) == 0) text_ += '-';
    text_ += below(3) == 0 ? std::string{"0"} : std::to_string(1 + (random_() >> (1 + below(62))));
    if (below(2) == 0) text_ += tests::concat({".", std::to_string(random_() >> below(64))});
    if (below(3) == 0)
      text_ += tests::concat({below(2) ? "e" : "E", below(2) ? "-" : "", std::to_string(below(250))});
  }

  std::mt19937_64 random_;
  std::string text_;
};

TEST(walkers, find_what_the_dom_finds) {
  const tests::test_seed s;
  generator documents{s};
  simdjson::dom::parser dom;
  reader r = reader::create(1u << 20).value();
  int compared = 0;
  for (int i = 0; i < 20'000; ++i) {
    const padded p{documents.document()};
    ASSERT_TRUE(r.validate(p.text())) << p.text();
    simdjson::dom::element element;
    if (dom.parse(p.text().data(), p.text().size(), false).get(element) == simdjson::SUCCESS) {
      ASSERT_TRUE(tests::same(root(p.text()), element)) << p.text();
      ++compared;
    }
    const auto walked = tests::compare_on_demand(p.text(), p.text().size() + reader::tailroom_bytes, 64);
    ASSERT_TRUE(walked == tests::verdict::same || walked == tests::verdict::unknown) << p.text();
  }
  EXPECT_GT(compared, 10'000);
}

// Visits everything that can be reached.
std::size_t visit(const value& v) {
  std::size_t visited = 1;
  std::array<char, 16> scratch;
  (void)to_string(v, scratch);
  (void)to_double(v);
  (void)to_integer(v);
  (void)to_unsigned(v);
  (void)to_boolean(v);
  (void)text_is(v, "publish");
  array_walk elements{v.raw};
  for (value e; elements.next(e);) visited += visit(e);
  object_walk members{v.raw};
  for (member m; members.next(m);) {
    (void)name_is(m, "op");
    visited += visit(m.what);
  }
  return visited;
}

TEST(walkers, stay_inside_texts_that_were_not_validated) {
  const tests::test_seed s;
  generator documents{s};
  std::mt19937_64 random{s};
  for (int i = 0; i < 20'000; ++i) {
    std::string text = documents.document();
    if (text.size() > 2000) continue;
    for (std::uint64_t k = 0, n = random() % 4; k < n && !text.empty(); ++k) {
      text[random() % text.size()] = "{}[]\",:\\u0-e \xff"[random() % 15];
    }
    const std::size_t bytes = random() % (text.size() + 1);
    // Exactly so many bytes on the heap, for the address sanitizer to watch.
    const auto exact = std::make_unique<char[]>(bytes);
    std::memcpy(exact.get(), text.data(), bytes);
    const std::string_view cut{exact.get(), bytes};
    ASSERT_LE(visit(root(cut)), bytes + 1);
    ASSERT_LE(visit({kind::string, cut}), 2 * bytes + 2);
    (void)find(cut, "op");
  }
}

} // namespace
} // namespace walk_test
} // namespace rowe::json
