// SPDX-License-Identifier: Apache-2.0
// The free ring's behaviour from one thread. What two threads may see of it is tests/model's and
// tests/stress's.
#include <rowe/rt/free_ring.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "rt/seed.hpp"

namespace free_ring_test {
namespace {

using numbers = rowe::rt::free_ring<>;

static_assert(std::is_trivially_destructible_v<numbers>);
static_assert(!std::is_copy_constructible_v<numbers> && !std::is_move_constructible_v<numbers>);
static_assert(noexcept(std::declval<numbers::producer&>().release(0)));
static_assert(noexcept(std::declval<numbers::consumer&>().try_take()));

template <std::size_t Places>
struct rig {
  explicit rig(std::uint32_t slots, std::uint64_t first_index = 0) : shared{entries, slots, first_index} {}

  std::array<numbers::entry, Places> entries;
  numbers shared;
  numbers::producer& borrower = *shared.take_producer();
  numbers::consumer& owner = *shared.take_consumer();
};

TEST(free_ring, gives_out_each_end_once) {
  std::array<numbers::entry, 4> entries;
  numbers shared{entries, 4};
  EXPECT_NE(shared.take_producer(), nullptr);
  EXPECT_EQ(shared.take_producer(), nullptr);
  EXPECT_NE(shared.take_consumer(), nullptr);
  EXPECT_EQ(shared.take_consumer(), nullptr);
}

// Else the borrower would write the line that the owner reads next, with each number.
TEST(free_ring, has_a_line_between_what_is_released_and_what_is_taken_next) {
  for (std::size_t slots = 1; slots < 300; ++slots) {
    EXPECT_GE((numbers::places_for(slots) - slots) * sizeof(numbers::entry), rowe::rt::line_bytes) << slots;
    EXPECT_TRUE(std::has_single_bit(numbers::places_for(slots))) << slots;
  }
}

TEST(free_ring, has_every_slot_free_at_first) {
  rig<4> r{3};
  EXPECT_EQ(r.owner.free_at_least(), 3U);
  for (std::uint32_t slot = 0; slot < 3; ++slot) EXPECT_EQ(r.owner.try_take(), slot);
}

TEST(free_ring, takes_slots_back_in_any_order) {
  rig<4> r{4};
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(r.owner.try_take().has_value());
  for (std::uint32_t slot : {2U, 0U, 3U, 1U}) r.borrower.release(slot);
  EXPECT_EQ(r.owner.free_at_least(), 4U);
  EXPECT_EQ(r.shared.check(), nullptr);
  for (std::uint32_t slot : {2U, 0U, 3U, 1U}) EXPECT_EQ(r.owner.try_take(), slot);
}

TEST(free_ring, names_a_number_that_was_released_twice) {
  rig<4> r{4};
  ASSERT_EQ(r.owner.try_take(), 0U);
  ASSERT_EQ(r.owner.try_take(), 1U);
  r.borrower.release(0);
  ASSERT_EQ(r.shared.check(), nullptr);
  r.borrower.release(0);
  EXPECT_STREQ(r.shared.check(), "no number is free twice");
}

TEST(free_ring, refuses_a_number_of_no_slot_in_dev_builds) {
#ifdef NDEBUG
  GTEST_SKIP() << "asserted in dev builds only";
#else
  rig<4> r{3};
  ASSERT_EQ(r.owner.try_take(), 0U);
  EXPECT_DEATH(r.borrower.release(3), "slot < slots_");
#endif
}

TEST(free_ring, goes_on_where_its_indices_wrap) {
  for (const std::uint64_t wrap : {std::uint64_t{1} << 32, std::uint64_t{0}}) {
    rig<4> r{3, wrap - 5};
    for (int round = 0; round < 20; ++round) {
      const auto first = r.owner.try_take();
      const auto second = r.owner.try_take();
      ASSERT_TRUE(first && second);
      ASSERT_NE(*first, *second);
      r.borrower.release(*second);
      r.borrower.release(*first);
      ASSERT_EQ(r.owner.free_at_least(), 3U);
      ASSERT_EQ(r.shared.check(), nullptr);
    }
  }
}

TEST(free_ring, loses_and_doubles_no_slot_whatever_is_done) {
  rowe::tests::seeded random;
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
      r.borrower.release(*chosen);
      out.erase(chosen);
    }
    ASSERT_EQ(r.shared.check(), nullptr);
    ASSERT_EQ(r.owner.free_at_least(), slots - out.size());
  }
}

// The owner learns of each released number once, before it takes it.
TEST(free_ring, shows_each_released_number_once) {
  constexpr std::uint64_t wrap = 0; // indices pass it
  rig<4> r{3, wrap - 4};
  std::vector<std::uint32_t> seen;
  const auto see = [&] { r.owner.see(r.owner.mark(), [&](std::uint32_t slot) { seen.push_back(slot); }); };
  see();
  EXPECT_TRUE(seen.empty()) << "those were never away";
  EXPECT_EQ(r.owner.seen_by_owner(), 3U);
  for (int round = 0; round < 20; ++round) {
    const auto first = r.owner.try_take();
    const auto second = r.owner.try_take();
    ASSERT_TRUE(first && second);
    EXPECT_EQ(r.owner.seen_by_owner(), 1U);
    r.borrower.release(*second);
    EXPECT_EQ(r.owner.seen_by_owner(), 1U);
    see();
    r.borrower.release(*first);
    see();
    see();
    EXPECT_EQ(seen, (std::vector{*second, *first}));
    EXPECT_EQ(r.owner.seen_by_owner(), 3U);
    seen.clear();
  }
}

TEST(free_ring, leaves_out_numbers_that_were_taken_unseen) {
  rig<4> r{2};
  std::vector<std::uint32_t> seen;
  const auto see = [&] { r.owner.see(r.owner.mark(), [&](std::uint32_t slot) { seen.push_back(slot); }); };
  for (int i = 0; i < 5; ++i) r.borrower.release(*r.owner.try_take());
  EXPECT_EQ(r.owner.seen_by_owner(), 0U);
  const auto taken = r.owner.try_take();
  see();
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_NE(seen[0], *taken);
  EXPECT_EQ(r.owner.seen_by_owner(), 1U);
}

} // namespace
} // namespace free_ring_test
