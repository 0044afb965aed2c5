// SPDX-License-Identifier: Apache-2.0
#include "net/lws/fixed_heap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

namespace rowe::net {
namespace fixed_heap_test {
namespace {

struct heap_of {
  explicit heap_of(std::size_t bytes) : place(bytes / sizeof(cell)) {}
  struct alignas(fixed_heap::alignment) cell {
    std::byte bytes[fixed_heap::alignment];
  };
  std::vector<cell> place;
  fixed_heap heap{std::as_writable_bytes(std::span{place})};
};

TEST(fixed_heap, gives_out_aligned_memory_of_its_region) {
  heap_of one{4096};
  for (const std::size_t bytes : {0U, 1U, 15U, 16U, 17U, 100U}) {
    void* const held = one.heap.take(bytes);
    ASSERT_NE(held, nullptr) << bytes;
    EXPECT_TRUE(one.heap.owns(held));
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(held) % fixed_heap::alignment, 0U);
    std::memset(held, 0xff, bytes);
    EXPECT_EQ(one.heap.check(), nullptr);
  }
  int elsewhere = 0;
  EXPECT_FALSE(one.heap.owns(&elsewhere));
  EXPECT_EQ(one.heap.allocations(), 6U);
}

TEST(fixed_heap, refuses_what_it_has_no_room_for_and_counts_it) {
  heap_of one{4096};
  EXPECT_EQ(one.heap.take(4096), nullptr);
  EXPECT_EQ(one.heap.take(SIZE_MAX), nullptr);
  EXPECT_EQ(one.heap.refusals(), 2U);
  void* const held = one.heap.take(2000);
  ASSERT_NE(held, nullptr);
  EXPECT_EQ(one.heap.resize(held, 5000), nullptr);
  EXPECT_EQ(one.heap.refusals(), 3U);
  EXPECT_TRUE(one.heap.bytes_used() >= 2000 && one.heap.bytes_used() < 2100);
  one.heap.give(held);
  EXPECT_EQ(one.heap.bytes_used(), 0U);
  EXPECT_GE(one.heap.bytes_peak(), 2000U);
  EXPECT_EQ(one.heap.check(), nullptr);
}

TEST(fixed_heap, has_nothing_to_give_without_a_region) {
  fixed_heap none;
  EXPECT_EQ(none.take(1), nullptr);
  EXPECT_FALSE(none.has_room_for(1));
  EXPECT_FALSE(none.owns(&none));
  EXPECT_EQ(none.check(), nullptr);
}

TEST(fixed_heap, has_room_for_parts_of_three_quarters_of_what_it_says) {
  std::mt19937 random{7};
  for (int round = 0; round < 2000; ++round) {
    heap_of one{65536};
    std::vector<void*> holes;
    while (void* const held = one.heap.take(random() % 3000)) holes.push_back(held);
    std::shuffle(holes.begin(), holes.end(), random);
    holes.resize(holes.size() - random() % holes.size());
    for (void* const held : holes) one.heap.give(held);
    std::size_t whole = 30000;
    while (!one.heap.has_room_for(whole)) whole = whole * 9 / 10;
    std::size_t left = whole * 3 / 4;
    while (left > fixed_heap::alignment) {
      const std::size_t part = std::min<std::size_t>(random() % 4000, left - fixed_heap::alignment);
      ASSERT_NE(one.heap.take(part), nullptr) << part << " of " << left << " left of " << whole;
      left -= std::min(left, (part + 31) / 16 * 16);
    }
  }
}

TEST(fixed_heap, keeps_what_was_written_through_thousands_of_random_steps) {
  constexpr std::uint32_t seed = 4;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random{seed};
  heap_of one{std::size_t{1} << 18};
  struct held_bytes {
    unsigned char* at;
    std::size_t bytes;
    unsigned char mark;
  };
  std::vector<held_bytes> all;
  const auto intact = [](const held_bytes& of) {
    return std::all_of(of.at, of.at + of.bytes, [&](unsigned char c) { return c == of.mark; });
  };
  for (int step = 0; step < 20000; ++step) {
    const std::size_t bytes = random() % 8 == 0 ? random() % 40000 : random() % 600;
    const auto mark = static_cast<unsigned char>(random());
    const std::size_t which = all.empty() ? 0 : random() % all.size();
    switch (all.empty() ? 0 : random() % 5) {
    case 0:
    case 1:
      if (auto* const at = static_cast<unsigned char*>(one.heap.take(bytes))) {
        std::memset(at, mark, bytes);
        all.push_back({at, bytes, mark});
      }
      break;
    case 2: {
      held_bytes& old = all[which];
      if (auto* const at = static_cast<unsigned char*>(one.heap.resize(old.at, bytes))) {
        old.at = at;
        old.bytes = std::min(old.bytes, bytes);
        ASSERT_TRUE(intact(old)) << step;
        std::memset(at, mark, bytes);
        old = {at, bytes, mark};
      }
      break;
    }
    default:
      ASSERT_TRUE(intact(all[which])) << step;
      one.heap.give(all[which].at);
      all[which] = all.back();
      all.pop_back();
    }
    ASSERT_EQ(one.heap.check(), nullptr) << step;
  }
  for (const held_bytes& rest : all) one.heap.give(rest.at);
  EXPECT_EQ(one.heap.bytes_used(), 0U);
  EXPECT_GT(one.heap.refusals(), 0U) << "the test never came to the end of the memory";
  EXPECT_TRUE(one.heap.has_room_for(std::size_t{200} << 10));
}

} // namespace
} // namespace fixed_heap_test
} // namespace rowe::net
