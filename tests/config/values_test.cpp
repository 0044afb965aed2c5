// SPDX-License-Identifier: Apache-2.0
#include "config/values.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

namespace values_test {
namespace {

using namespace rowe::config;

constexpr std::array<std::string_view, 3> words{"poll", "spin", "wake"};
constexpr form integer{kind::integer, 5, 7, {}};
constexpr form time{kind::time, 50'000, 10'000'000, {}};
constexpr form word{kind::word, 0, 2, words};
constexpr form boolean{kind::boolean, 0, 0, {}};
constexpr form texts{kind::texts, 0, 0, {}};

std::string wrong(const form& what, std::string_view text) {
  value into;
  return read(what, text, into);
}

TEST(times, have_a_number_and_a_unit) {
  for (const auto& [text, ns] : {std::pair<std::string_view, std::int64_t>{"250 us", 250'000},
                                 {"250us", 250'000},
                                 {"250 µs", 250'000},
                                 {"1.5 ms", 1'500'000},
                                 {"8 s", 8'000'000'000},
                                 {"2m", 120'000'000'000},
                                 {"24 h", 86'400'000'000'000},
                                 {"7 ns", 7},
                                 {"0", 0},
                                 {"0 s", 0},
                                 {"forever", for_ever_ns}}) {
    EXPECT_EQ(time_of(text), ns) << text;
  }
}

TEST(times, are_nothing_else) {
  for (const std::string_view text :
       {"",        "5",         "s",         "5  s",         " 5 s",
        "5 s ",    "-5 s",      "+5 s",      "5 S",          "5 sec",
        "1e3 s",   "1. s",      ".5 s",      "0x5 s",        "inf s",
        "nan s",   "300 years", "2562048 h", "0.0000001 ns", "99999999999999999999 ns",
        "Forever", "5 s 3 ms"}) {
    EXPECT_EQ(time_of(text), std::nullopt) << text;
  }
}

TEST(times, are_written_so_that_they_read_back) {
  EXPECT_EQ(written_time(250'000), "250 us");
  EXPECT_EQ(written_time(1'500'000), "1500 us");
  EXPECT_EQ(written_time(86'400'000'000'000), "24 h");
  EXPECT_EQ(written_time(0), "0 s");
  EXPECT_EQ(written_time(for_ever_ns), "forever");
  std::mt19937_64 random{7};
  for (int i = 0; i < 20'000; ++i) {
    const auto ns =
        static_cast<std::int64_t>(random() >> (2 + random() % 60)); // below 2^53, where doubles are exact
    EXPECT_EQ(time_of(written_time(ns)), ns) << ns;
  }
}

TEST(sizes, have_a_number_and_a_unit) {
  for (const auto& [text, bytes] : {std::pair<std::string_view, std::int64_t>{"64 MiB", 64 << 20},
                                    {"64MiB", 64 << 20},
                                    {"1.5 GB", 1'500'000'000},
                                    {"10 kB", 10'000},
                                    {"2 TiB", std::int64_t{2} << 40},
                                    {"7 B", 7},
                                    {"0", 0}}) {
    EXPECT_EQ(size_of(text), bytes) << text;
  }
  for (const std::string_view none :
       {"", "5", "MiB", "-1 B", "1 mib", "1 MB ", "0.1 B", "9000000 TiB", "1 s"})
    EXPECT_EQ(size_of(none), std::nullopt) << none;
}

TEST(sizes, are_written_so_that_they_read_back) {
  EXPECT_EQ(written_size(64 << 20), "64 MiB");
  EXPECT_EQ(written_size(1500), "1500 B");
  EXPECT_EQ(written_size(0), "0");
  std::mt19937_64 random{7};
  for (int i = 0; i < 20'000; ++i) {
    const auto bytes = static_cast<std::int64_t>(random() >> (2 + random() % 60));
    EXPECT_EQ(size_of(written_size(bytes)), bytes) << bytes;
  }
}

TEST(texts, are_written_so_that_toml_reads_them) {
  EXPECT_EQ(quoted("ang-01"), "\"ang-01\"");
  EXPECT_EQ(quoted("a\"b\\c\n\x7f"), "\"a\\\"b\\\\c\\u000A\\u007F\"");
  EXPECT_EQ(quoted("Roboter für alle"), "\"Roboter für alle\"");
}

TEST(values, that_are_wrong_are_named_with_what_is_allowed) {
  EXPECT_EQ(wrong(integer, "8"), "is out of range: 8 (5 to 7)");
  EXPECT_EQ(wrong(integer, "-1"), "is out of range: -1 (5 to 7)");
  EXPECT_EQ(wrong(integer, "99999999999999999999"), "is out of range: 99999999999999999999 (5 to 7)");
  for (const std::string_view none : {"", "x", "6x", " 6", "6.0", "0x6", "+6"})
    EXPECT_EQ(wrong(integer, none), "needs a whole number, not " + quoted(none) + " (5 to 7)");
  EXPECT_EQ(wrong(time, "20 us"), "is out of range: 20 us (50 us to 10 ms)");
  EXPECT_EQ(wrong(time, "20"),
            "needs a time such as \"250 us\", \"20 ms\" or \"5 s\", not \"20\" (50 us to 10 ms)");
  constexpr form size{kind::size, 1 << 20, 1 << 30, {}};
  EXPECT_EQ(wrong(size, "2 GiB"), "is out of range: 2 GiB (1 MiB to 1 GiB)");
  EXPECT_EQ(wrong(size, "2"), "needs a size such as \"64 MiB\" or \"10 GB\", not \"2\" (1 MiB to 1 GiB)");
  EXPECT_EQ(wrong(word, "sleep"), "needs poll, spin or wake, not \"sleep\"");
  EXPECT_EQ(wrong(boolean, "yes"), "needs true or false, not \"yes\"");
}

TEST(values, are_read_from_texts) {
  value into;
  EXPECT_EQ(read(integer, "6", into), "");
  EXPECT_EQ(into, value{std::int64_t{6}});
  EXPECT_EQ(read(word, "wake", into), "");
  EXPECT_EQ(into, value{std::int64_t{2}});
  EXPECT_EQ(read(boolean, "false", into), "");
  EXPECT_EQ(into, value{false});
  EXPECT_EQ(read(texts, "a,b c,", into), "");
  EXPECT_EQ(into, (value{std::vector<std::string>{"a", "b c"}}));
  EXPECT_EQ(read(texts, "", into), "");
  EXPECT_EQ(into, value{std::vector<std::string>{}});
  const std::vector<std::string> given{"a,b", "c"};
  EXPECT_EQ(read(texts, given, into), "");
  EXPECT_EQ(into, value{given});
  EXPECT_EQ(read(integer, std::vector<std::string>{"5", "7"}, into), ""); // the last counts
  EXPECT_EQ(into, value{std::int64_t{7}});
}

} // namespace
} // namespace values_test
