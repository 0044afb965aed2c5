// SPDX-License-Identifier: Apache-2.0
#include "net/connections/read_pace.hpp"

#include <gtest/gtest.h>

namespace read_pace_test {
namespace {

using namespace std::chrono_literals;
using rowe::net::read_pace;

constexpr std::size_t least = 16 * 1024;
constexpr std::size_t most = 128 * 1024;

struct read_paces : testing::Test {
  // A turn whose read fills its buffer, and whose handling takes so long.
  void full_turn(std::chrono::nanoseconds took) { pace.note(pace.bytes(), took); }

  read_pace pace{least, most};
};

TEST_F(read_paces, begin_small_and_measure_nothing_while_reads_are_short) {
  EXPECT_EQ(pace.bytes(), least);
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(pace.measures());
    pace.note(300, 0ns);
  }
  EXPECT_EQ(pace.bytes(), least);
}

TEST_F(read_paces, double_turn_by_turn_while_half_of_the_time_is_enough) {
  full_turn(0ns);
  EXPECT_TRUE(pace.measures());
  EXPECT_EQ(pace.bytes(), least) << "that turn was not measured";
  for (std::size_t bytes = least; bytes < most; bytes *= 2) {
    EXPECT_EQ(pace.bytes(), bytes);
    full_turn(10us);
  }
  for (int i = 0; i < 5; ++i) full_turn(10us);
  EXPECT_EQ(pace.bytes(), most);
}

TEST_F(read_paces, stay_where_more_would_take_too_long) {
  for (int i = 0; i < 3; ++i) full_turn(20us);
  const std::size_t bytes = pace.bytes();
  for (int i = 0; i < 5; ++i) full_turn(40us);
  EXPECT_EQ(pace.bytes(), bytes);
}

TEST_F(read_paces, shrink_at_once_to_what_fits_into_the_time) {
  for (int i = 0; i < 6; ++i) full_turn(10us);
  ASSERT_EQ(pace.bytes(), most);
  full_turn(200us);
  EXPECT_EQ(pace.bytes(), most / 4);
  full_turn(10ms);
  EXPECT_EQ(pace.bytes(), least) << "never less";
}

// The sink may want less than it could get. Then that is what takes its time.
TEST_F(read_paces, shrink_by_what_was_read) {
  for (int i = 0; i < 6; ++i) full_turn(10us);
  pace.note(64 * 1024, 100us);
  EXPECT_EQ(pace.bytes(), 32 * 1024U);
  pace.note(24 * 1024, 1us);
  EXPECT_EQ(pace.bytes(), 32 * 1024U) << "and does not grow by it";
}

// What comes behind a short read may need more work than what was measured.
TEST_F(read_paces, begin_anew_behind_a_short_read) {
  for (int i = 0; i < 6; ++i) full_turn(10us);
  ASSERT_EQ(pace.bytes(), most);
  pace.note(300, 1us);
  EXPECT_FALSE(pace.measures());
  EXPECT_EQ(pace.bytes(), least);
  full_turn(10ms);
  EXPECT_EQ(pace.bytes(), most) << "that was not measured";
  full_turn(10ms);
  EXPECT_EQ(pace.bytes(), least);
}

} // namespace
} // namespace read_pace_test
