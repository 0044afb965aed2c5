// SPDX-License-Identifier: Apache-2.0
#include "wire/text/utf8.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>

namespace rowe::wire {
namespace utf8_test {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

bool valid(std::string_view text) { return is_utf8(bytes_of(text)); }

// How many bytes can be fed before the check says no; the length of the text when it never does.
std::size_t accepted_prefix(std::string_view text) {
  utf8_check check;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!check.feed(bytes_of(text.substr(i, 1)))) return i;
  }
  return text.size();
}

void append_code_point(std::string& out, std::uint32_t c) {
  const auto put = [&out](std::uint32_t byte) { out += static_cast<char>(byte); };
  if (c < 0x80) {
    put(c);
  } else if (c < 0x800) {
    put(0xc0 | c >> 6);
    put(0x80 | (c & 0x3f));
  } else if (c < 0x10000) {
    put(0xe0 | c >> 12);
    put(0x80 | (c >> 6 & 0x3f));
    put(0x80 | (c & 0x3f));
  } else {
    put(0xf0 | c >> 18);
    put(0x80 | (c >> 12 & 0x3f));
    put(0x80 | (c >> 6 & 0x3f));
    put(0x80 | (c & 0x3f));
  }
}

TEST(utf8, accepts_every_code_point_but_surrogates) {
  for (std::uint32_t c = 0; c <= 0x10ffff; ++c) {
    std::string text;
    append_code_point(text, c);
    const bool surrogate = c >= 0xd800 && c <= 0xdfff;
    ASSERT_EQ(valid(text), !surrogate) << std::hex << c;
  }
}

TEST(utf8, accepts_exactly_the_well_formed_pairs_and_triples_of_bytes) {
  // Every string of two bytes and every string of three that begins outside ASCII, against the table of RFC
  // 3629 4.
  const auto tail = [](unsigned b) { return b >= 0x80 && b <= 0xbf; };
  const auto pair = [&tail](unsigned a, unsigned b) {
    return (a < 0x80 && b < 0x80) || (a >= 0xc2 && a <= 0xdf && tail(b));
  };
  for (unsigned a = 0; a < 256; ++a) {
    for (unsigned b = 0; b < 256; ++b) {
      const std::array two{static_cast<char>(a), static_cast<char>(b)};
      ASSERT_EQ(valid({two.data(), 2}), pair(a, b)) << std::hex << a << ' ' << b;
      if (a < 0x80) continue;
      for (unsigned c = 0; c < 256; ++c) {
        const std::array three{two[0], two[1], static_cast<char>(c)};
        const bool second = (a == 0xe0 && b >= 0xa0 && b <= 0xbf) || (a == 0xed && b >= 0x80 && b <= 0x9f) ||
                            (a >= 0xe1 && a <= 0xef && a != 0xed && tail(b));
        const bool expected = (second && tail(c)) || (pair(a, b) && c < 0x80);
        ASSERT_EQ(valid({three.data(), 3}), expected) << std::hex << a << ' ' << b << ' ' << c;
      }
    }
  }
}

struct broken {
  std::string_view text;
  std::size_t good; // bytes before the one that proves it bad
};

TEST(utf8, says_no_at_the_first_byte_that_cannot_be_right) {
  using namespace std::string_view_literals;
  const broken table[] = {
      {"a\x80"sv, 1},            // a continuation byte alone
      {"\xc0\x80"sv, 0},         // overlong zero
      {"\xc1\xbf"sv, 0},         // overlong U+7F
      {"\xe0\x9f\xbf"sv, 1},     // overlong U+7FF
      {"\xf0\x8f\xbf\xbf"sv, 1}, // overlong U+FFFF
      {"\xed\xa0\x80"sv, 1},     // U+D800
      {"\xed\xbf\xbf"sv, 1},     // U+DFFF
      {"\xf4\x90\x80\x80"sv, 1}, // U+110000
      {"\xf5\x80\x80\x80"sv, 0}, // beyond
      {"\xfe"sv, 0},             // never in UTF-8
      {"\xff"sv, 0},
      {"\xc3("sv, 1}, // a character cut short by ASCII
      {"\xe2\x82("sv, 2},
      {"\xf0\x9f\x98("sv, 3},
      {"12345678901234567890123456789012345678\xff"sv, 38}, // behind runs that are skipped by words
  };
  for (const broken& row : table) {
    EXPECT_EQ(accepted_prefix(row.text), row.good) << testing::PrintToString(row.text);
    EXPECT_FALSE(valid(row.text)) << testing::PrintToString(row.text);
  }
}

} // namespace
} // namespace utf8_test
} // namespace rowe::wire
