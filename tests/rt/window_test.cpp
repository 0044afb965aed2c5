// SPDX-License-Identifier: Apache-2.0
// The window's behaviour from one thread, with the steps of a write and of a read interleaved by hand where
// that matters. All interleavings and all weak orders are tests/model's, volume is tests/stress's.
#include <rowe/rt/window.hpp>

#include <array>
#include <set>

#include <gtest/gtest.h>

namespace window_test {
namespace {

using rowe::rt::freshness;
using core = rowe::rt::window_core<>;
using window = rowe::rt::window<int>;

static_assert(std::is_trivially_destructible_v<window>);
static_assert(!std::is_copy_constructible_v<window> && !std::is_move_constructible_v<window>);
static_assert(noexcept(std::declval<window::writer&>().write(0)));

struct rig {
  window shared;
  window::writer& in = *shared.take_writer();
  window::reader& out = *shared.take_reader();
};

struct core_rig {
  core shared;
  core::writer& in = *shared.take_writer();
  core::reader& out = *shared.take_reader();

  std::uint32_t write() {
    const std::uint32_t slot = in.begin_write();
    in.end_write(slot);
    return slot;
  }
};

TEST(window, gives_out_each_end_once) {
  window shared;
  EXPECT_NE(shared.take_writer(), nullptr);
  EXPECT_EQ(shared.take_writer(), nullptr);
  EXPECT_NE(shared.take_reader(), nullptr);
  EXPECT_EQ(shared.take_reader(), nullptr);
}

TEST(window, is_empty_before_the_first_write) {
  rig r;
  int value = 5;
  EXPECT_EQ(r.out.read(value), freshness::empty);
  EXPECT_EQ(value, 5);
  EXPECT_EQ(r.out.sequence(), 0U);
  EXPECT_EQ(r.shared.check(), nullptr);
}

TEST(window, shows_the_newest_of_several_values) {
  rig r;
  for (int i = 1; i <= 9; ++i) r.in.write(i);
  int value = 0;
  EXPECT_EQ(r.out.read(value), freshness::fresh);
  EXPECT_EQ(value, 9);
  EXPECT_EQ(r.out.sequence(), 9U) << "eight values were overwritten unread";
  EXPECT_EQ(r.in.sequence(), 9U);
}

TEST(window, says_unchanged_when_the_newest_was_read_already) {
  rig r;
  r.in.write(7);
  int value = 0;
  ASSERT_EQ(r.out.read(value), freshness::fresh);
  value = 0;
  EXPECT_EQ(r.out.read(value), freshness::unchanged);
  EXPECT_EQ(value, 0) << "nothing is copied twice";
  r.in.write(8);
  EXPECT_EQ(r.out.read(value), freshness::fresh);
  EXPECT_EQ(value, 8);
}

TEST(window, alternates_for_as_long_as_one_likes) {
  rig r;
  for (int i = 1; i <= 1000; ++i) {
    for (int extra = 0; extra < i % 5; ++extra) r.in.write(-i);
    r.in.write(i);
    int value = 0;
    ASSERT_EQ(r.out.read(value), freshness::fresh);
    ASSERT_EQ(value, i);
    ASSERT_EQ(r.shared.check(), nullptr);
  }
}

TEST(window_core, never_writes_the_slot_that_is_read) {
  core_rig r;
  r.write();
  for (int round = 0; round < 20; ++round) {
    const auto found = r.out.begin_read();
    ASSERT_EQ(found.state, freshness::fresh);
    for (int i = 0; i <= round; ++i) ASSERT_NE(r.write(), found.slot);
    ASSERT_EQ(r.shared.check(), nullptr);
  }
}

TEST(window_core, keeps_a_slot_readable_while_nothing_fresh_is_taken) {
  core_rig r;
  r.write();
  const auto found = r.out.begin_read();
  const auto again = r.out.begin_read();
  EXPECT_EQ(again.state, freshness::unchanged);
  EXPECT_EQ(again.slot, found.slot);
  for (int i = 0; i < 10; ++i) EXPECT_NE(r.write(), again.slot);
}

TEST(window_core, reads_the_value_before_while_one_is_being_written) {
  core_rig r;
  const std::uint32_t first = r.write();
  const std::uint32_t half_written = r.in.begin_write();
  const auto found = r.out.begin_read();
  EXPECT_EQ(found.state, freshness::fresh);
  EXPECT_EQ(found.slot, first);
  EXPECT_NE(found.slot, half_written);
  r.in.end_write(half_written);
  EXPECT_EQ(r.out.begin_read().slot, half_written);
}

TEST(window_core, uses_all_four_slots) {
  core_rig r;
  std::set<std::uint32_t> used;
  for (int i = 0; i < 8; ++i) {
    used.insert(r.write());
    used.insert(r.write());
    ASSERT_EQ(r.out.begin_read().state, freshness::fresh);
  }
  EXPECT_EQ(used, (std::set<std::uint32_t>{0, 1, 2, 3}));
}

TEST(window_core, numbers_the_values_so_that_a_gap_shows) {
  core_rig r;
  r.write();
  EXPECT_EQ(r.out.begin_read().sequence, 1U);
  r.write();
  r.write();
  r.write();
  EXPECT_EQ(r.out.begin_read().sequence, 4U);
  EXPECT_EQ(r.out.begin_read().sequence, 4U);
}

TEST(window_core, refuses_to_end_another_write_than_it_began_in_dev_builds) {
#ifdef NDEBUG
  GTEST_SKIP() << "asserted in dev builds only";
#else
  core_rig r;
  const std::uint32_t slot = r.in.begin_write();
  EXPECT_DEATH(r.in.end_write(slot ^ 1U), "slot ==");
#endif
}

} // namespace
} // namespace window_test
