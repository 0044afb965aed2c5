// SPDX-License-Identifier: Apache-2.0
// JSON text as CBOR.
#include "json/writing/cbor.hpp"

#include <algorithm>
#include <bit>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "cbor_text.hpp"
#include "encoded.hpp"
#include "rt/seed.hpp"
#include "texts.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json {
namespace cbor_test {
namespace {

using tests::cbor_text;
using tests::repeat;

// Written the same into rooms of every size that suffices, and not at all into a smaller one.
std::string transcoded(std::string_view json) {
  std::string buffer(json.size() * 3 + 16, '\0');
  writer w{buffer};
  cbor::write_json(json, w);
  EXPECT_FALSE(w.overflowed()) << json.substr(0, 100);
  std::string whole{w.text()};
  const auto write_again = [json](writer& narrow) { cbor::write_json(json, narrow); };
  for (std::size_t room = 0; room < whole.size() && room < 300; ++room) {
    tests::expect_written_within(room, whole, write_again);
  }
  tests::expect_written_within(whole.size(), whole, write_again);
  return whole;
}
std::string read_back(std::string_view json) { return cbor_text(transcoded(json)).value_or("not CBOR"); }

TEST(cbor, writes_what_rosbridge_writes) {
  EXPECT_EQ(transcoded(R"({"op":"publish","topic":"/c","msg":{"data":"one"}})"),
            "\xa3\x62op\x67publish\x65topic\x62/c\x63msg\xa1\x64"
            "data\x63one");
}

TEST(cbor, says_the_same_as_the_text) {
  for (const std::string_view same :
       {R"({})", R"([])", R"({"a":[],"b":{}})", R"([1,-1,true,false,null,"",0.1,1e300])", R"("text")", "17",
        R"({"deep":[[[[{"a":[{}]}]]]]})", R"([0,23,24,255,256,65535,65536,4294967295,4294967296])",
        R"([-1,-24,-25,-256,-257,-65536,-65537,-4294967296,-4294967297])", R"(["ö","日本","𝄞"])"}) {
    EXPECT_EQ(read_back(same), same);
  }
  EXPECT_EQ(read_back(" { \"a\" : [ 1 ,\n2 ] } "), R"({"a":[1,2]})");
}

TEST(cbor, keeps_every_digit_of_integers) {
  for (const std::string_view same :
       {"9007199254740993", "-9007199254740993", "9223372036854775807", "-9223372036854775808",
        "18446744073709551615", "-18446744073709551615"})
    EXPECT_EQ(read_back(same), same);
  EXPECT_EQ(read_back("18446744073709551616"), "1.8446744073709552e19"); // beyond 64 bits
}

TEST(cbor, writes_the_nearest_float_in_as_few_bytes_as_hold_it) {
  EXPECT_EQ(transcoded("0.5"), std::string("\xfa\x3f\0\0\0", 5));
  EXPECT_EQ(transcoded("0.1").size(), 9u);
  EXPECT_EQ(transcoded("-0"), std::string("\xfa\x80\0\0\0", 5));
  EXPECT_EQ(read_back("[1.0,-0.0,2.5e-3,1.7976931348623157e308,5e-324]"),
            "[1,-0.0,0.0025,1.7976931348623157e308,5e-324]");
}

TEST(cbor, resolves_escapes) {
  EXPECT_EQ(read_back(R"(["\/odom","\u0041\n\"\\","\ud834\udd1e","a\u00f6b"])"),
            R"(["/odom","A\n\"\\","𝄞","aöb"])");
  EXPECT_EQ(read_back(R"({"\u006fp":1})"), R"({"op":1})");
}

TEST(cbor, counts_up_to_23_and_marks_the_end_of_more) {
  for (std::size_t n = 1; n < 60; ++n) {
    std::string array = "[0";
    std::string object = "{\"0\":0";
    for (std::size_t i = 1; i < n; ++i) {
      array += "," + std::to_string(i);
      object += ",\"" + std::to_string(i) + "\":0";
    }
    array += "]";
    object += "}";
    EXPECT_EQ(read_back(array), array);
    EXPECT_EQ(read_back(object), object);
    EXPECT_EQ(static_cast<std::uint8_t>(transcoded(array)[0]), n < 24 ? 0x80 + n : 0x9f);
  }
}

TEST(cbor, takes_what_the_reader_takes_and_gives_up_beyond) {
  const std::string deepest = repeat("[", cbor::depth_max) + repeat("]", cbor::depth_max);
  EXPECT_EQ(read_back(deepest), deepest);
  std::string buffer(10'000, '\0');
  for (const std::string& wrong : {"[" + deepest + "]", std::string{"["}, std::string{"}"}, std::string{"[1"},
                                   std::string{"\"a"}, std::string{"[[]"}, std::string{"{:"}}) {
    writer w{buffer};
    cbor::write_json(wrong, w); // was not validated: only that it ends
  }
  writer w{buffer};
  cbor::write_json("[" + deepest + "]", w);
  EXPECT_TRUE(w.overflowed());
}

// Random values, written by the writer and read back as the same text.
class source {
 public:
  explicit source(std::uint64_t from) : random_{from} {}
  void value(writer& w, int depth) {
    switch (upto(depth == 0 ? 6 : 8)) {
    case 0: return w.null();
    case 1: return w.boolean(upto(1) == 0);
    case 2: return w.number(static_cast<std::int64_t>(random_() >> upto(63)));
    case 3: return w.number(-static_cast<std::int64_t>(random_() >> (1 + upto(62))));
    case 4: return w.number(static_cast<double>(upto(1000)) / 8);
    case 5: return w.number(std::bit_cast<double>(random_()));
    case 6: return w.string(text());
    case 7: {
      w.begin_array();
      for (std::uint64_t n = upto(30); n != 0; --n) value(w, depth - 1);
      return w.end_array();
    }
    default:
      w.begin_object();
      for (std::uint64_t n = upto(30); n != 0; --n) {
        w.key(text());
        value(w, depth - 1);
      }
      return w.end_object();
    }
  }

 private:
  std::uint64_t upto(std::uint64_t most) { return random_() % (most + 1); }
  std::string text() {
    std::string made;
    for (std::uint64_t n = upto(1) * upto(300); n != 0; --n) made += static_cast<char>(random_());
    return made;
  }
  std::mt19937_64 random_;
};

TEST(cbor, says_the_same_as_random_texts) {
  const tests::test_seed from;
  source random{from};
  std::string buffer(1 << 22, '\0');
  for (int i = 0; i < 300; ++i) {
    writer w{buffer};
    random.value(w, 3);
    ASSERT_FALSE(w.overflowed());
    const std::string back = read_back(w.text());
    const auto differs = std::mismatch(back.begin(), back.end(), w.text().begin(), w.text().end()).first;
    ASSERT_TRUE(back == w.text()) << "text " << i << " differs at " << differs - back.begin() << ": "
                                  << std::string{differs, std::min(back.end(), differs + 40)};
  }
}

} // namespace
} // namespace cbor_test
} // namespace rowe::json
