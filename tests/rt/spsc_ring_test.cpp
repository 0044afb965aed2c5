// SPDX-License-Identifier: Apache-2.0
// The ring's behaviour from one thread. What two threads may see of it is tests/model's and tests/stress's.
#include <rowe/rt/spsc_ring.hpp>

#include <array>
#include <deque>
#include <random>

#include <gtest/gtest.h>

#include "rt/seed.hpp"

namespace spsc_ring_test {
namespace {

using rowe::rt::spsc_ring;
using ring = spsc_ring<int>;

static_assert(std::is_trivially_destructible_v<ring>);
static_assert(!std::is_copy_constructible_v<ring> && !std::is_move_constructible_v<ring>);
static_assert(!std::is_copy_constructible_v<ring::producer> && !std::is_move_constructible_v<ring::consumer>);
static_assert(noexcept(std::declval<ring::producer&>().try_push(0)));
static_assert(noexcept(std::declval<ring::consumer&>().try_pop()));
static_assert(sizeof(ring) == 4 * rowe::rt::line_bytes, "two ends and two shared words, lines apart");

// A ring with its entries and both ends taken.
template <std::size_t Places>
struct rig {
  explicit rig(std::uint64_t first_index = 0) : shared{entries, first_index} {}

  std::array<ring::entry, Places> entries;
  ring shared;
  ring::producer& in = *shared.take_producer();
  ring::consumer& out = *shared.take_consumer();
};

TEST(spsc_ring, gives_out_each_end_once) {
  std::array<ring::entry, 4> entries;
  ring shared{entries};
  EXPECT_NE(shared.take_producer(), nullptr);
  EXPECT_EQ(shared.take_producer(), nullptr);
  EXPECT_NE(shared.take_consumer(), nullptr);
  EXPECT_EQ(shared.take_consumer(), nullptr);
}

TEST(spsc_ring, is_empty_at_first) {
  rig<4> r;
  EXPECT_EQ(r.out.try_pop(), std::nullopt);
  EXPECT_EQ(r.out.pending_at_least(), 0U);
  EXPECT_EQ(r.in.room_at_least(), 4U);
  EXPECT_EQ(r.shared.check(), nullptr);
}

TEST(spsc_ring, has_room_again_after_a_pop) {
  rig<1> r;
  ASSERT_TRUE(r.in.try_push(1));
  ASSERT_FALSE(r.in.try_push(2));
  ASSERT_EQ(r.out.try_pop(), 1);
  EXPECT_TRUE(r.in.try_push(3));
  EXPECT_EQ(r.out.try_pop(), 3);
}

TEST(spsc_ring, goes_on_where_its_indices_wrap) {
  for (const std::uint64_t wrap : {std::uint64_t{1} << 31, std::uint64_t{1} << 32, std::uint64_t{0}}) {
    rig<4> r{wrap - 6};
    int pushed = 0;
    int popped = 0;
    for (int round = 0; round < 5; ++round) {
      while (r.in.try_push(pushed)) ++pushed;
      ASSERT_EQ(pushed - popped, 4) << "four places, below the wrap at " << wrap << " and above it";
      ASSERT_EQ(r.shared.approximate_size(), 4U);
      ASSERT_EQ(r.shared.check(), nullptr);
      for (int i = 0; i < 3; ++i) ASSERT_EQ(r.out.try_pop(), popped++);
      ASSERT_EQ(r.shared.check(), nullptr);
    }
  }
}

TEST(spsc_ring, gives_the_places_of_a_batch_back_together) {
  rig<4> r;
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(r.in.try_push(i));
  const auto full = [&](int) { EXPECT_FALSE(r.in.try_push(9)) << "in the middle of the batch"; };
  ASSERT_EQ(r.out.drain(full, 3), 3U);
  EXPECT_EQ(r.in.room_at_least(), 3U);
}

TEST(spsc_ring, drains_only_what_was_pushed_before) {
  rig<8> r;
  ASSERT_TRUE(r.in.try_push(1));
  ASSERT_TRUE(r.in.try_push(2));
  EXPECT_EQ(r.out.drain([&](int item) { ASSERT_TRUE(r.in.try_push(item + 10)); }, 100), 2U);
  EXPECT_EQ(r.out.try_pop(), 11);
}

TEST(spsc_ring, drains_what_was_pushed_since_it_last_looked) {
  rig<8> r;
  ASSERT_TRUE(r.in.try_push(1));
  ASSERT_TRUE(r.in.try_push(2));
  ASSERT_EQ(r.out.try_pop(), 1);
  ASSERT_TRUE(r.in.try_push(3));
  EXPECT_EQ(r.out.drain([](int) {}, 100), 2U);
}

TEST(spsc_ring, counts_items_and_room) {
  rig<4> r;
  ASSERT_TRUE(r.in.try_push(1));
  EXPECT_EQ(r.in.room_at_least(), 3U);
  EXPECT_EQ(r.out.pending_at_least(), 1U);
  EXPECT_EQ(r.shared.approximate_size(), 1U);
  EXPECT_EQ(r.shared.capacity(), 4U);
}

TEST(spsc_ring, carries_structs_whole) {
  struct sample {
    std::uint64_t number;
    double values[5];
  };
  std::array<spsc_ring<sample>::entry, 2> entries;
  spsc_ring<sample> shared{entries};
  ASSERT_TRUE(shared.take_producer()->try_push({7, {1, 2, 3, 4, 5}}));
  const auto got = shared.take_consumer()->try_pop();
  ASSERT_TRUE(got.has_value());
  EXPECT_EQ(got->number, 7U);
  EXPECT_EQ(got->values[4], 5);
}

TEST(spsc_ring, rounds_places_up_to_a_power_of_two) {
  EXPECT_EQ(ring::places_for(1), 1U);
  EXPECT_EQ(ring::places_for(5), 8U);
  EXPECT_EQ(ring::places_for(8), 8U);
}

TEST(spsc_ring, agrees_with_a_queue_whatever_is_done) {
  rowe::tests::seeded random;
  rig<8> r{random()};
  std::deque<int> expected;
  for (int step = 0; step < 100'000; ++step) {
    switch (random() % 4) {
    case 0:
    case 1:
      ASSERT_EQ(r.in.try_push(step), expected.size() < 8);
      if (expected.size() < 8) expected.push_back(step);
      break;
    case 2:
      if (expected.empty()) {
        ASSERT_EQ(r.out.try_pop(), std::nullopt);
      } else {
        ASSERT_EQ(r.out.try_pop(), expected.front());
        expected.pop_front();
      }
      break;
    case 3: {
      const std::size_t most = random() % 10;
      const std::size_t count = std::min(most, expected.size());
      ASSERT_EQ(r.out.drain(
                    [&](int item) {
                      ASSERT_EQ(item, expected.front());
                      expected.pop_front();
                    },
                    most),
                count);
      break;
    }
    }
    ASSERT_EQ(r.shared.check(), nullptr);
    ASSERT_EQ(r.shared.approximate_size(), expected.size());
  }
}

} // namespace
} // namespace spsc_ring_test
