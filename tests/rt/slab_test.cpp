// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/slab.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "rt/seed.hpp"

namespace slab_test {
namespace {

using rowe::rt::headroom_bytes;
using rowe::rt::line_bytes;
using rowe::rt::pool;
using rowe::rt::pool_ticket;
using rowe::rt::slab;
using rowe::rt::tailroom_bytes;

constexpr std::uint32_t slots = 5;
constexpr std::size_t payload_bytes = 300;

struct rig {
  alignas(line_bytes) std::array<std::byte, slab::bytes_for(slots, payload_bytes)> region{};
  slab cells{region, slots, payload_bytes};
};

TEST(slab, sets_its_slots_whole_lines_apart) {
  static_assert(slab::stride_for(0) == line_bytes);
  static_assert(slab::stride_for(line_bytes - headroom_bytes - tailroom_bytes) == line_bytes);
  static_assert(slab::stride_for(line_bytes - headroom_bytes - tailroom_bytes + 1) == 2 * line_bytes);
  rig r;
  EXPECT_EQ(r.cells.stride_bytes() % line_bytes, 0U);
  for (std::uint32_t n = 1; n < slots; ++n)
    EXPECT_EQ(r.cells.slot(n).data() - r.cells.slot(n - 1).data(),
              static_cast<std::ptrdiff_t>(r.cells.stride_bytes()));
}

TEST(slab, leaves_headroom_and_tailroom_in_the_region) {
  rig r;
  EXPECT_EQ(r.cells.slot(0).data() - r.region.data(), static_cast<std::ptrdiff_t>(headroom_bytes));
  const std::byte* const end = r.cells.slot(slots - 1).data() + payload_bytes + tailroom_bytes;
  EXPECT_LE(end, r.region.data() + r.region.size());
}

TEST(slab, aligns_payloads) {
  rig r;
  for (std::uint32_t n = 0; n < slots; ++n)
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(r.cells.slot(n).data()) % rowe::rt::payload_alignment, 0U);
}

TEST(slab, keeps_the_payloads_of_its_slots_apart) {
  rig r;
  for (std::uint32_t n = 0; n < slots; ++n)
    std::memset(r.cells.slot(n).data() - headroom_bytes, static_cast<int>(n + 1),
                headroom_bytes + payload_bytes);
  for (std::uint32_t n = 0; n < slots; ++n)
    for (const std::byte b : r.cells.slot(n)) ASSERT_EQ(b, static_cast<std::byte>(n + 1));
  EXPECT_EQ(r.cells.check(), nullptr);
}

TEST(slab, names_a_write_behind_a_payload) {
  rig r;
  ASSERT_EQ(r.cells.check(), nullptr);
  r.region[2 * r.cells.stride_bytes() + headroom_bytes + payload_bytes] = std::byte{1};
  EXPECT_STREQ(r.cells.check(), "nothing was written behind a payload");
}

TEST(slab, tells_the_slot_of_an_address) {
  constexpr std::size_t bytes = slab::bytes_for(slots, payload_bytes);
  alignas(line_bytes) std::array<std::byte, line_bytes + bytes + line_bytes> memory{};
  const slab cells{std::span{memory}.subspan(line_bytes, bytes), slots, payload_bytes};
  EXPECT_EQ(cells.number_of(cells.slot(3).data()), 3U);
  EXPECT_EQ(cells.number_of(cells.slot(3).data() - headroom_bytes), 3U);
  EXPECT_EQ(cells.number_of(cells.slot(2).data() + payload_bytes - 1), 2U);
  EXPECT_EQ(cells.number_of(&memory[line_bytes - 1]), std::nullopt);
  EXPECT_EQ(cells.number_of(&memory[line_bytes + bytes]), std::nullopt);
  EXPECT_EQ(slab{}.number_of(&memory[line_bytes]), std::nullopt);
}

TEST(pool, gives_each_slot_once_and_then_nothing) {
  std::array<pool::node, 3> nodes;
  pool free{nodes};
  EXPECT_EQ(free.free_count(), 3U);
  for (std::uint32_t n = 0; n < 3; ++n) EXPECT_EQ(free.take()->number, n);
  EXPECT_EQ(free.take(), std::nullopt);
  EXPECT_EQ(free.free_count(), 0U);
  EXPECT_EQ(free.check(), nullptr);
}

TEST(pool, gives_the_slot_that_came_back_last_first) {
  std::array<pool::node, 3> nodes;
  pool free{nodes};
  const pool_ticket a = *free.take();
  const pool_ticket b = *free.take();
  ASSERT_TRUE(free.give(a));
  ASSERT_TRUE(free.give(b));
  EXPECT_EQ(free.take()->number, b.number);
  EXPECT_EQ(free.take()->number, a.number);
}

TEST(pool, tells_a_stale_ticket_from_the_new_one_of_the_same_slot) {
  std::array<pool::node, 1> nodes;
  pool free{nodes};
  const pool_ticket old = *free.take();
  EXPECT_TRUE(free.holds(old));
  ASSERT_TRUE(free.give(old));
  EXPECT_FALSE(free.holds(old)) << "given back";
  const pool_ticket current = *free.take();
  EXPECT_EQ(current.number, old.number);
  EXPECT_NE(current, old);
  EXPECT_FALSE(free.holds(old)) << "taken again by someone else";
  EXPECT_TRUE(free.holds(current));
}

TEST(pool, holds_no_ticket_that_it_never_gave_out) {
  std::array<pool::node, 2> nodes;
  pool free{nodes};
  EXPECT_FALSE(free.holds({}));
  EXPECT_FALSE(free.holds({.number = 0, .generation = 0}));
  EXPECT_FALSE(free.holds({.number = 2, .generation = 1}));
}

TEST(pool, takes_no_ticket_back_twice) {
  std::array<pool::node, 2> nodes;
  pool free{nodes};
  const pool_ticket ticket = *free.take();
  ASSERT_TRUE(free.give(ticket));
  // Dies in dev builds; answers false and changes nothing in release.
  EXPECT_DEBUG_DEATH(EXPECT_FALSE(free.give(ticket)), "right");
  EXPECT_EQ(free.free_count(), 2U);
  EXPECT_EQ(free.check(), nullptr);
}

TEST(pool, takes_no_stale_ticket_back_for_the_new_holder) {
  std::array<pool::node, 1> nodes;
  pool free{nodes};
  const pool_ticket old = *free.take();
  ASSERT_TRUE(free.give(old));
  const pool_ticket current = *free.take();
  EXPECT_DEBUG_DEATH(EXPECT_FALSE(free.give(old)), "right");
  EXPECT_TRUE(free.holds(current));
}

TEST(pool, is_empty_without_nodes) {
  pool none;
  EXPECT_EQ(none.take(), std::nullopt);
  EXPECT_EQ(none.slots(), 0U);
  EXPECT_EQ(none.check(), nullptr);
}

TEST(pool, names_what_is_broken) {
  std::array<pool::node, 3> nodes;
  pool free{nodes};
  ASSERT_EQ(free.check(), nullptr);
  nodes[1].next = 0;
  EXPECT_STREQ(free.check(), "no slot is in the list of free ones twice");
  nodes[1].next = 7;
  EXPECT_STREQ(free.check(), "the list of free slots is as long as there are free slots");
  nodes[1].next = 2;
  nodes[2].generation = 1;
  EXPECT_STREQ(free.check(), "what is not taken is free");
}

TEST(pool, loses_and_doubles_no_slot_whatever_is_done) {
  const std::uint64_t seed = rowe::tests::seed();
  ROWE_TRACE_SEED(seed);
  std::mt19937_64 random{seed};
  std::array<pool::node, 7> nodes;
  pool free{nodes};
  std::vector<pool_ticket> held;
  for (int step = 0; step < 100'000; ++step) {
    if (random() % 2 == 0) {
      const auto ticket = free.take();
      ASSERT_EQ(ticket.has_value(), held.size() < nodes.size());
      if (!ticket) continue;
      for (const pool_ticket& other : held) ASSERT_NE(ticket->number, other.number);
      held.push_back(*ticket);
    } else if (!held.empty()) {
      const auto chosen = held.begin() + static_cast<std::ptrdiff_t>(random() % held.size());
      ASSERT_TRUE(free.give(*chosen));
      held.erase(chosen);
    }
    for (const pool_ticket& ticket : held) ASSERT_TRUE(free.holds(ticket));
    ASSERT_EQ(free.check(), nullptr);
  }
}

} // namespace
} // namespace slab_test
