// SPDX-License-Identifier: Apache-2.0
// The home ring's behaviour from one thread. What two threads may see of it is tests/model's and
// tests/stress's.
#include <rowe/rt/home_ring.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "rt/seed.hpp"

namespace home_ring_test {
namespace {

using home = rowe::rt::home_ring<>;

static_assert(std::is_trivially_destructible_v<home>);
static_assert(!std::is_copy_constructible_v<home> && !std::is_move_constructible_v<home>);
static_assert(noexcept(std::declval<home::producer&>().give(0)));
static_assert(noexcept(std::declval<home::consumer&>().try_take()));

template <std::size_t Places>
struct rig {
  explicit rig(std::uint32_t slots, std::uint64_t first_index = 0) : shared{entries, slots, first_index} {}

  std::array<home::entry, Places> entries;
  home shared;
  home::producer& borrower = *shared.take_producer();
  home::consumer& owner = *shared.take_consumer();
};

TEST(home_ring, gives_out_each_end_once) {
  std::array<home::entry, 4> entries;
  home shared{entries, 4};
  EXPECT_NE(shared.take_producer(), nullptr);
  EXPECT_EQ(shared.take_producer(), nullptr);
  EXPECT_NE(shared.take_consumer(), nullptr);
  EXPECT_EQ(shared.take_consumer(), nullptr);
}

// Else the borrower would write the line that the owner reads next, with each number.
TEST(home_ring, has_a_line_between_what_comes_home_and_what_is_taken_next) {
  for (std::size_t slots = 1; slots < 300; ++slots) {
    EXPECT_GE((home::places_for(slots) - slots) * sizeof(home::entry), rowe::rt::line_bytes) << slots;
    EXPECT_TRUE(std::has_single_bit(home::places_for(slots))) << slots;
  }
}

TEST(home_ring, has_every_slot_at_home_at_first) {
  rig<4> r{3};
  EXPECT_EQ(r.owner.home_at_least(), 3U);
  for (std::uint32_t slot = 0; slot < 3; ++slot) EXPECT_EQ(r.owner.try_take(), slot);
}

TEST(home_ring, has_nothing_to_take_when_all_slots_are_out) {
  rig<2> r{2};
  ASSERT_TRUE(r.owner.try_take().has_value());
  ASSERT_TRUE(r.owner.try_take().has_value());
  EXPECT_EQ(r.owner.try_take(), std::nullopt);
  EXPECT_EQ(r.owner.home_at_least(), 0U);
}

TEST(home_ring, gives_again_what_came_home) {
  rig<2> r{2};
  ASSERT_EQ(r.owner.try_take(), 0U);
  ASSERT_EQ(r.owner.try_take(), 1U);
  r.borrower.give(1);
  EXPECT_EQ(r.owner.try_take(), 1U);
  EXPECT_EQ(r.owner.try_take(), std::nullopt);
}

TEST(home_ring, takes_the_slots_home_in_any_order) {
  rig<4> r{4};
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(r.owner.try_take().has_value());
  for (std::uint32_t slot : {2U, 0U, 3U, 1U}) r.borrower.give(slot);
  EXPECT_EQ(r.owner.home_at_least(), 4U);
  EXPECT_EQ(r.shared.check(), nullptr);
  for (std::uint32_t slot : {2U, 0U, 3U, 1U}) EXPECT_EQ(r.owner.try_take(), slot);
}

TEST(home_ring, names_a_number_that_came_home_twice) {
  rig<4> r{4};
  ASSERT_EQ(r.owner.try_take(), 0U);
  ASSERT_EQ(r.owner.try_take(), 1U);
  r.borrower.give(0);
  ASSERT_EQ(r.shared.check(), nullptr);
  r.borrower.give(0);
  EXPECT_STREQ(r.shared.check(), "no number is at home twice");
}

TEST(home_ring, refuses_a_number_of_no_slot_in_dev_builds) {
#ifdef NDEBUG
  GTEST_SKIP() << "asserted in dev builds only";
#else
  rig<4> r{3};
  ASSERT_EQ(r.owner.try_take(), 0U);
  EXPECT_DEATH(r.borrower.give(3), "slot < slots_");
#endif
}

TEST(home_ring, goes_on_where_its_indices_wrap) {
  for (const std::uint64_t wrap : {std::uint64_t{1} << 32, std::uint64_t{0}}) {
    rig<4> r{3, wrap - 5};
    for (int round = 0; round < 20; ++round) {
      const auto first = r.owner.try_take();
      const auto second = r.owner.try_take();
      ASSERT_TRUE(first && second);
      ASSERT_NE(*first, *second);
      r.borrower.give(*second);
      r.borrower.give(*first);
      ASSERT_EQ(r.owner.home_at_least(), 3U);
      ASSERT_EQ(r.shared.check(), nullptr);
    }
  }
}

TEST(home_ring, loses_and_doubles_no_slot_whatever_is_done) {
  const std::uint64_t seed = rowe::tests::seed();
  ROWE_TRACE_SEED(seed);
  std::mt19937_64 random{seed};
  constexpr std::uint32_t slots = 6;
  rig<8> r{slots, random()};
  std::vector<std::uint32_t> out;
  for (int step = 0; step < 100'000; ++step) {
    if (random() % 2 == 0) {
      const auto slot = r.owner.try_take();
      ASSERT_EQ(slot.has_value(), out.size() < slots);
      if (!slot) continue;
      ASSERT_EQ(std::count(out.begin(), out.end(), *slot), 0) << "a slot that is out was taken again";
      out.push_back(*slot);
    } else if (!out.empty()) {
      const auto chosen = out.begin() + static_cast<std::ptrdiff_t>(random() % out.size());
      r.borrower.give(*chosen);
      out.erase(chosen);
    }
    ASSERT_EQ(r.shared.check(), nullptr);
    ASSERT_EQ(r.owner.home_at_least(), slots - out.size());
  }
}

// The owner learns of each number that comes home once, before it takes it.
TEST(home_ring, shows_each_number_that_came_home_once) {
  constexpr std::uint64_t wrap = 0; // indices pass it
  rig<4> r{3, wrap - 4};
  std::vector<std::uint32_t> seen;
  const auto see = [&] {
    r.owner.see(r.owner.mark_home(), [&](std::uint32_t slot) { seen.push_back(slot); });
  };
  see();
  EXPECT_TRUE(seen.empty()) << "those were never away";
  EXPECT_EQ(r.owner.seen_by_owner(), 3U);
  for (int round = 0; round < 20; ++round) {
    const auto first = r.owner.try_take();
    const auto second = r.owner.try_take();
    ASSERT_TRUE(first && second);
    EXPECT_EQ(r.owner.seen_by_owner(), 1U);
    r.borrower.give(*second);
    EXPECT_EQ(r.owner.seen_by_owner(), 1U);
    see();
    r.borrower.give(*first);
    see();
    see();
    EXPECT_EQ(seen, (std::vector{*second, *first}));
    EXPECT_EQ(r.owner.seen_by_owner(), 3U);
    seen.clear();
  }
}

TEST(home_ring, leaves_out_numbers_that_were_taken_unseen) {
  rig<4> r{2};
  std::vector<std::uint32_t> seen;
  const auto see = [&] {
    r.owner.see(r.owner.mark_home(), [&](std::uint32_t slot) { seen.push_back(slot); });
  };
  for (int i = 0; i < 5; ++i) r.borrower.give(*r.owner.try_take());
  EXPECT_EQ(r.owner.seen_by_owner(), 0U);
  const auto taken = r.owner.try_take();
  see();
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_NE(seen[0], *taken);
  EXPECT_EQ(r.owner.seen_by_owner(), 1U);
}

} // namespace
} // namespace home_ring_test
