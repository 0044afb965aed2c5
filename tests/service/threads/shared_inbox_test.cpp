// SPDX-License-Identifier: Apache-2.0
// Each state of the shared inbox; tests/stress has many threads in it at once, tests/model a receiver that
// falls asleep while something is delivered or the inbox is closed.
#include "service/threads/shared_inbox.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "rt/watchdog.hpp"

namespace shared_inbox_test {
namespace {

using namespace std::chrono_literals;
using namespace rowe;
using service::shared_inbox;
using tests::watchdog;

constexpr std::uint32_t slots = 4;
constexpr std::size_t slot_bytes = 64;

limits small() { return {.door_slots = slots, .door_slot_bytes = slot_bytes}; }

// An inbox in an arena that has exactly what it says it needs.
struct fixture {
  explicit fixture(const limits& bounds = small())
      : memory{rt::arena::bytes_for<shared_inbox>() + shared_inbox::footprint_bytes(bounds),
               rt::page_lock::none},
        inbox{*memory.make<shared_inbox>(memory, bounds)} {}
  ~fixture() { EXPECT_STREQ(inbox.check(), nullptr); }

  rt::arena memory;
  shared_inbox& inbox;
};

const rt::time_point start{1000s};

TEST(shared_inbox, takes_from_the_arena_what_it_says) {
  for (const std::uint32_t count : {1U, 2U, 3U, 32U, 100U}) {
    limits bounds = small();
    bounds.door_slots = count;
    fixture h{bounds};
    EXPECT_EQ(h.memory.bytes_used(),
              rt::arena::bytes_for<shared_inbox>() + shared_inbox::footprint_bytes(bounds));
    EXPECT_TRUE(h.inbox.all_free());
  }
}

TEST(shared_inbox, brings_what_arrives_in_order) {
  fixture h;
  EXPECT_FALSE(h.inbox.has_receiver());
  EXPECT_EQ(h.inbox.try_receive(start).code(), errc::empty);
  EXPECT_TRUE(h.inbox.has_receiver());
  int delivered = 0;
  int received = 0;
  std::vector<std::uint32_t> kept;
  for (int round = 0; round != 50; ++round) {
    while (h.inbox.deliver({.peer = {1, 2}, .call = {3, 4}}, std::to_string(delivered))) ++delivered;
    for (int i = 0; i != 1 + round % 3; ++i) {
      const auto slot = h.inbox.try_receive(start);
      ASSERT_TRUE(slot);
      EXPECT_EQ(h.inbox.text(*slot), std::to_string(received++));
      EXPECT_EQ(h.inbox.header(*slot).peer, (detail::peer_ref{1, 2}));
      EXPECT_EQ(h.inbox.header(*slot).call, (detail::call_ref{3, 4}));
      kept.push_back(*slot);
    }
    ASSERT_STREQ(h.inbox.check(), nullptr);
    for (; !kept.empty(); kept.pop_back()) h.inbox.release(kept.back());
  }
  while (const auto slot = h.inbox.try_receive(start)) h.inbox.release(*slot);
  EXPECT_TRUE(h.inbox.all_free());
}

TEST(shared_inbox, says_why_it_does_not_take_a_message_in) {
  fixture h;
  EXPECT_EQ(h.inbox.deliver({}, std::string(slot_bytes + 1, 'x')).error(),
            (error{errc::too_big, slot_bytes + 1, slot_bytes}));
  for (std::uint32_t i = 0; i != slots; ++i) EXPECT_TRUE(h.inbox.deliver({}, "x"));
  EXPECT_EQ(h.inbox.deliver({}, "x").error(), (error{errc::full, 0, slots}));
  const std::uint32_t slot = h.inbox.try_receive(start).value();
  EXPECT_EQ(h.inbox.deliver({}, "x").code(), errc::full); // it is in the receiver's hands
  h.inbox.release(slot);
  EXPECT_TRUE(h.inbox.deliver({}, "x"));
  h.inbox.close();
  EXPECT_EQ(h.inbox.deliver({}, "x").code(), errc::closed);
}

TEST(shared_inbox, without_slots_is_always_full) {
  limits bounds = small();
  bounds.door_slots = 0;
  fixture h{bounds};
  EXPECT_EQ(h.inbox.deliver({}, "x").code(), errc::full);
  EXPECT_EQ(h.inbox.try_receive(start).code(), errc::empty);
}

TEST(shared_inbox, drops_and_counts_what_expired_in_the_inbox) {
  fixture h;
  EXPECT_TRUE(h.inbox.deliver({.expires = start}, "old"));
  EXPECT_TRUE(h.inbox.deliver({.expires = start - 1s}, "older"));
  EXPECT_TRUE(h.inbox.deliver({.expires = start + 1ns}, "fresh"));
  const std::uint32_t slot = h.inbox.try_receive(start).value();
  EXPECT_EQ(h.inbox.text(slot), "fresh");
  EXPECT_EQ(h.inbox.expired(), 2U);
  h.inbox.release(slot);
  EXPECT_TRUE(h.inbox.all_free());
}

TEST(shared_inbox, makes_room_in_a_full_inbox_by_what_expired_in_front) {
  fixture h;
  EXPECT_TRUE(h.inbox.deliver({.stamped = start, .expires = start + 1s}, "a"));
  EXPECT_TRUE(h.inbox.deliver({.stamped = start, .expires = start + 1s}, "b"));
  EXPECT_TRUE(h.inbox.deliver({.stamped = start}, "c"));
  EXPECT_TRUE(h.inbox.deliver({.stamped = start}, "d"));
  EXPECT_EQ(h.inbox.deliver({.stamped = start + 1s - 1ns}, "e").code(), errc::full);
  EXPECT_TRUE(h.inbox.deliver({.stamped = start + 1s}, "e"));
  EXPECT_EQ(h.inbox.expired(), 2U);
  for (const char* text : {"c", "d", "e"}) {
    const std::uint32_t slot = h.inbox.try_receive(start + 2s).value();
    EXPECT_EQ(h.inbox.text(slot), text);
    h.inbox.release(slot);
  }
  EXPECT_TRUE(h.inbox.all_free());
}

TEST(shared_inbox, says_whose_slots_were_released_before_they_are_used_again) {
  fixture h;
  std::vector<std::uint32_t> from;
  const auto collect = [&] {
    from.clear();
    return h.inbox.collect([&](rowe::detail::peer_ref peer) { from.push_back(peer.index); });
  };
  EXPECT_EQ(collect(), slots);
  EXPECT_TRUE(from.empty());
  for (std::uint32_t i = 0; i != slots; ++i) EXPECT_TRUE(h.inbox.deliver({.peer = {i, 1}}, "x"));
  EXPECT_EQ(collect(), 0U);
  const auto first = h.inbox.try_receive(start);
  const auto second = h.inbox.try_receive(start);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(collect(), 0U) << "they are in the receiver's hands";
  EXPECT_FALSE(h.inbox.release(*second)) << "nobody waits";
  h.inbox.ask_for_slots();
  EXPECT_TRUE(h.inbox.release(*first)) << "once";
  EXPECT_EQ(collect(), 2U);
  EXPECT_EQ(from, (std::vector{1U, 0U}));
  h.inbox.forget_senders();
  while (const auto left = h.inbox.try_receive(start)) EXPECT_FALSE(h.inbox.release(*left));
  EXPECT_EQ(collect(), slots);
  EXPECT_TRUE(from.empty());
  EXPECT_TRUE(h.inbox.all_free());
}

TEST(shared_inbox, ends_a_receive_at_its_deadline) {
  fixture h;
  EXPECT_EQ(h.inbox.receive(rt::time_point{}).code(), errc::timed_out);
  const rt::time_point deadline = rt::monotonic_clock::now() + 2ms;
  EXPECT_EQ(h.inbox.receive(deadline).code(), errc::timed_out);
  EXPECT_GE(rt::monotonic_clock::now(), deadline);
  EXPECT_TRUE(h.inbox.deliver({}, "x"));
  const auto slot = h.inbox.receive(rt::time_point{}); // there already
  ASSERT_TRUE(slot);
  h.inbox.release(*slot);
}

TEST(shared_inbox, wakes_sleeping_receivers_one_for_each_message) {
  const watchdog dog{"sleeping receivers"};
  fixture h;
  std::array<std::thread, 3> receivers;
  for (std::thread& receiver : receivers)
    receiver = std::thread{[&] {
      for (int i = 0; i != 200; ++i) {
        const auto slot = h.inbox.receive(rt::never);
        ASSERT_TRUE(slot);
        EXPECT_EQ(h.inbox.text(*slot), "x");
        h.inbox.release(*slot);
      }
    }};
  for (int delivered = 0; delivered != 600;) {
    if (h.inbox.deliver({}, "x"))
      ++delivered;
    else
      std::this_thread::yield();
  }
  for (std::thread& receiver : receivers) receiver.join();
  EXPECT_TRUE(h.inbox.all_free());
}

// ---- The end.

TEST(shared_inbox, takes_no_more_once_it_is_closed) {
  fixture h;
  EXPECT_TRUE(h.inbox.deliver({}, "left"));
  h.inbox.close();
  h.inbox.close();
  EXPECT_EQ(h.inbox.deliver({}, "after").code(), errc::closed);
  const std::uint32_t slot = h.inbox.receive(rt::never).value(); // what is left still comes
  h.inbox.release(slot);
  EXPECT_EQ(h.inbox.receive(rt::never).code(), errc::closed);
  EXPECT_EQ(h.inbox.try_receive(start).code(), errc::closed);
  EXPECT_TRUE(h.inbox.all_free());
}

TEST(shared_inbox, wakes_every_sleeping_receiver_when_it_closes) {
  const watchdog dog{"closing with sleeping receivers"};
  for (int round = 0; round != 50; ++round) {
    fixture h;
    std::atomic<int> closed{0};
    std::vector<std::thread> receivers;
    for (int i = 0; i != 5; ++i)
      receivers.emplace_back([&] {
        for (;;) {
          const auto slot = h.inbox.receive(rt::never);
          if (slot) {
            h.inbox.release(*slot);
            continue;
          }
          EXPECT_EQ(slot.code(), errc::closed);
          ++closed;
          return;
        }
      });
    for (int i = 0; i != round % 4; ++i) EXPECT_TRUE(h.inbox.deliver({}, "x"));
    h.inbox.close();
    for (std::thread& receiver : receivers) receiver.join();
    EXPECT_EQ(closed, 5);
    EXPECT_TRUE(h.inbox.all_free());
  }
}

} // namespace
} // namespace shared_inbox_test
