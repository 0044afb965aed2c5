// SPDX-License-Identifier: Apache-2.0
// The hand-off structures between two real threads, with payloads that would show a torn or an early read,
// for longer than tests/model can look. tests/model shows what such a run cannot: orders that this processor
// does not use. This run adds the real std::atomic, and ThreadSanitizer's check of every payload byte (preset
// tsan; planted_race.cpp proves that it checks). Each test does a stated amount, times ROWE_STRESS_FACTOR.
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/slab.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/window.hpp>

#include "rt/seed.hpp"
#include "rt/watchdog.hpp"
#include "stress/factor.hpp"

namespace {

using namespace std::chrono_literals;
using rowe::rt::free_ring;
using rowe::rt::freshness;
using rowe::rt::monotonic_clock;
using rowe::rt::notification;
using rowe::rt::slab;
using rowe::rt::spsc_ring;
using rowe::tests::stressed;
using rowe::tests::watchdog;

constexpr std::chrono::seconds run_time_max = 500s; // sanitized on one busy core some take a minute
constexpr std::uint64_t near_wrap = (std::uint64_t{1} << 32) - 1000;

// Several words that belong together: whoever sees two different ones has read too early or too late.
struct wide {
  std::array<std::uint64_t, 24> words;

  explicit wide(std::uint64_t number = 0) { words.fill(number); }
  std::uint64_t number() const { return words[0]; }
  bool whole() const {
    for (const std::uint64_t word : words)
      if (word != words[0]) return false;
    return true;
  }
};

// Where there is nothing to do, let the other thread run: the machine may have one core only.
void step_aside() { std::this_thread::yield(); }

// What a receiver has seen of a stream that must bring 0, 1, 2, … whole.
struct ledger {
  std::uint64_t received = 0;
  std::uint64_t wrong = 0;

  void enter(const wide& item) {
    wrong += !item.whole() || item.number() != received;
    ++received;
  }
};

class ring_stress : public ::testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(places, ring_stress, ::testing::Values(1, 2, 64));

TEST_P(ring_stress, brings_every_item_whole_and_in_order) {
  const watchdog dog{"a ring between two threads", run_time_max};
  const std::uint64_t items = stressed(150'000);
  std::vector<spsc_ring<wide>::entry> entries(GetParam());
  spsc_ring<wide> shared{entries, near_wrap};
  std::thread pushing{[&, in = shared.take_producer()] {
    for (std::uint64_t number = 0; number < items;) {
      // By turns asking for room first and just trying.
      std::size_t buffer = number / 1000 % 2 == 0 ? in->room_at_least() : 0;
      if (buffer == 0) {
        if (in->try_push(wide{number}))
          ++number;
        else
          step_aside();
      }
      for (; buffer > 0 && number < items; --buffer)
        ASSERT_TRUE(in->try_push(wide{number++})) << "there was room";
    }
  }};
  auto* const out = shared.take_consumer();
  ledger seen;
  while (seen.received < items) {
    // By turns one at a time and in batches, which publish the head differently.
    std::uint64_t count = 0;
    if (seen.received / 1000 % 2 == 0) {
      if (const auto item = out->try_pop()) seen.enter(*item), count = 1;
    } else {
      count = out->drain([&](const wide& item) { seen.enter(item); }, 7);
    }
    if (count == 0) step_aside();
    ASSERT_LE(shared.approximate_size(), GetParam());
  }
  pushing.join();
  EXPECT_EQ(seen.wrong, 0U);
  EXPECT_EQ(out->try_pop().has_value(), false);
  EXPECT_EQ(shared.check(), nullptr);
}

class lane_stress : public ::testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(slots, lane_stress, ::testing::Values(1, 3, 16));

TEST_P(lane_stress, lends_each_slot_to_one_thread_at_a_time) {
  const watchdog dog{"a ring out and a free ring", run_time_max};
  const rowe::tests::test_seed seed;
  const std::uint64_t items = stressed(150'000);
  const std::uint32_t slots = GetParam();
  rowe::rt::arena memory{1 << 16, rowe::rt::page_lock::none};
  const slab cells{memory.carve_bytes(slab::bytes_for(slots, sizeof(wide))), slots, sizeof(wide)};
  std::vector<spsc_ring<std::uint32_t>::entry> places_out(spsc_ring<std::uint32_t>::places_for(slots));
  std::vector<free_ring<>::entry> free_places(std::bit_ceil(slots)); // none to spare: the hardest case
  spsc_ring<std::uint32_t> out{places_out, near_wrap};
  free_ring<> back_to_owner{free_places, slots, near_wrap};

  std::thread owner{[&, free = back_to_owner.take_consumer(), in = out.take_producer()] {
    for (std::uint64_t number = 0; number < items;) {
      const auto slot = free->try_take();
      if (!slot) {
        step_aside();
        continue;
      }
      const wide item{number++};
      std::memcpy(cells.slot(*slot).data(), &item, sizeof item);
      ASSERT_TRUE(in->try_push(*slot)) << "as many places as slots";
    }
  }};

  auto* const borrowed = out.take_consumer();
  auto* const back = back_to_owner.take_producer();
  std::mt19937_64 random{seed};
  std::vector<std::uint32_t> kept; // given back late and in any order
  ledger seen;
  while (seen.received < items) {
    const std::size_t count =
        borrowed->drain([&](std::uint32_t slot) { kept.push_back(slot); }, 1 + random() % slots);
    for (auto slot = kept.end() - static_cast<std::ptrdiff_t>(count); slot != kept.end(); ++slot) {
      wide item;
      std::memcpy(&item, cells.slot(*slot).data(), sizeof item);
      seen.enter(item);
    }
    while (!kept.empty() && (count == 0 || random() % 2 == 0)) {
      std::swap(kept.back(), kept[random() % kept.size()]);
      back->release(kept.back());
      kept.pop_back();
    }
    if (count == 0) step_aside();
  }
  owner.join();
  for (const std::uint32_t slot : kept) back->release(slot);
  EXPECT_EQ(seen.wrong, 0U);
  EXPECT_EQ(back_to_owner.check(), nullptr);
  EXPECT_EQ(out.check(), nullptr);
  EXPECT_EQ(cells.check(), nullptr);
}

TEST(window_stress, shows_whole_values_that_never_go_back) {
  const watchdog dog{"a window between two threads", run_time_max};
  const std::uint64_t writes = stressed(500'000);
  rowe::rt::window<wide> shared;
  std::thread writing{[&, in = shared.take_writer()] {
    for (std::uint64_t number = 1; number <= writes; ++number) in->write(wide{number});
  }};
  auto* const out = shared.take_reader();
  std::uint64_t last = 0;
  std::uint64_t wrong = 0;
  while (last < writes) {
    wide value;
    if (out->read(value) != freshness::fresh) {
      step_aside();
      continue;
    }
    wrong += !value.whole() || value.number() <= last || value.number() != out->sequence();
    last = std::max(last, out->sequence());
  }
  writing.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(shared.check(), nullptr);
}

TEST(window_stress, leaves_a_slot_alone_for_as_long_as_it_is_read) {
  const watchdog dog{"a window whose slots are read in place", run_time_max};
  const std::uint64_t writes = stressed(500'000);
  using core = rowe::rt::window_core<>;
  rowe::rt::arena memory{1 << 16, rowe::rt::page_lock::none};
  const slab cells{memory.carve_bytes(slab::bytes_for(core::slot_count, sizeof(wide))), core::slot_count,
                   sizeof(wide)};
  core shared;
  std::thread writing{[&, in = shared.take_writer()] {
    for (std::uint64_t number = 1; number <= writes; ++number) {
      const wide value{number};
      const std::uint32_t slot = in->begin_write();
      std::memcpy(cells.slot(slot).data(), &value, sizeof value);
      in->end_write(slot);
    }
  }};
  auto* const out = shared.take_reader();
  std::uint64_t wrong = 0;
  core::view found{};
  do {
    found = out->begin_read();
    if (found.state == freshness::empty) step_aside();
    // Twice, with other work in between: the writer must stay out meanwhile, however often it writes.
    for (int look = 0; look < 2 && found.state != freshness::empty; ++look) {
      wide value;
      std::memcpy(&value, cells.slot(found.slot).data(), sizeof value);
      wrong += !value.whole() || value.number() != found.sequence;
      step_aside();
    }
  } while (found.sequence < writes);
  writing.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(shared.check(), nullptr);
}

TEST(notification_stress, lets_no_item_lie_while_its_receiver_sleeps) {
  const watchdog dog{"a receiver that sleeps between items", run_time_max};
  const std::uint64_t items = stressed(200'000);
  std::vector<spsc_ring<wide>::entry> entries(16);
  spsc_ring<wide> shared{entries};
  notification<> arrival;
  std::thread pushing{[&, in = shared.take_producer()] {
    for (std::uint64_t number = 0; number < items; ++number) {
      while (!in->try_push(wide{number})) step_aside();
      arrival.notify();
    }
  }};
  auto* const out = shared.take_consumer();
  ledger seen;
  while (seen.received < items) {
    // By turns without end and with deadlines so short that they pass in the middle of things.
    const bool for_ever = seen.received % 3 != 0;
    const auto deadline = for_ever ? rowe::rt::never : monotonic_clock::now() + 5us;
    const bool came = arrival.wait_until(deadline, [&] { return out->pending_at_least() != 0; });
    ASSERT_TRUE(came || !for_ever);
    out->drain([&](const wide& item) { seen.enter(item); }, 2);
  }
  pushing.join();
  EXPECT_EQ(seen.wrong, 0U);
}

} // namespace
