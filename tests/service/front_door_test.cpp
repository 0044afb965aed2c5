// SPDX-License-Identifier: Apache-2.0
// Each state of the front door; tests/stress has many threads in it at once, tests/model the hand-over of a
// slot between a caller that runs out of time and the service thread.
#include "service/front_door.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "rt/watchdog.hpp"

namespace front_door_test {
namespace {

using namespace std::chrono_literals;
using namespace rowe;
using service::door_header;
using service::door_request;
using service::front_door;
using tests::watchdog;

constexpr std::uint32_t slots = 4;
constexpr std::size_t slot_bytes = 64;

limits small() {
  limits bounds;
  bounds.door_slots = slots;
  bounds.door_slot_bytes = slot_bytes;
  return bounds;
}

// A door in an arena that has exactly what it says it needs.
struct house {
  explicit house(const limits& bounds = small())
      : memory{rt::arena::bytes_for<front_door>() + front_door::footprint_bytes(bounds), rt::page_lock::none},
        door{*memory.make<front_door>(memory, bounds)} {}
  ~house() { EXPECT_STREQ(door.check(), nullptr); }

  std::uint32_t submit(std::string_view text, bool wants_outcome = false) {
    return door.submit({.wants_outcome = wants_outcome}, text).value();
  }
  std::vector<std::string> take(std::size_t most = SIZE_MAX) {
    std::vector<std::string> texts;
    door.take(
        [&](std::uint32_t slot) {
          texts.emplace_back(door.request_text(slot));
          held.push_back(slot);
        },
        most);
    return texts;
  }
  void settle_all() {
    for (const std::uint32_t slot : held) door.settle(slot, {});
    held.clear();
  }

  rt::arena memory;
  front_door& door;
  std::vector<std::uint32_t> held; // taken and not settled
};

using texts = std::vector<std::string>;
const rt::time_point start{1000s};

// ---- Out.

TEST(front_door, takes_from_the_arena_what_it_says) {
  for (const std::uint32_t count : {1U, 2U, 3U, 32U, 100U}) {
    limits bounds = small();
    bounds.door_slots = count;
    house h{bounds};
    EXPECT_EQ(h.memory.bytes_used(),
              rt::arena::bytes_for<front_door>() + front_door::footprint_bytes(bounds));
    EXPECT_TRUE(h.door.all_home());
  }
}

TEST(front_door, hands_what_is_submitted_to_the_service_thread) {
  house h;
  const door_header asked{
      .what = door_request::reply, .peer = {3, 4}, .call = {5, 6}, .stamped = start, .expires = start + 1s};
  ASSERT_TRUE(h.door.submit(asked, "{\"a\":1}"));
  EXPECT_EQ(h.take(), texts{"{\"a\":1}"});
  const door_header& seen = h.door.request(h.held.front());
  EXPECT_EQ(seen.what, door_request::reply);
  EXPECT_EQ(seen.peer, asked.peer);
  EXPECT_EQ(seen.call, asked.call);
  EXPECT_EQ(seen.stamped, start);
  EXPECT_EQ(seen.expires, start + 1s);
  EXPECT_EQ(seen.bytes, 7U);
  EXPECT_FALSE(h.door.drained());
  h.settle_all();
  EXPECT_TRUE(h.door.drained());
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, keeps_the_order_of_submission_whichever_slots_carry_it) {
  house h;
  std::uint32_t next = 0;
  for (std::uint32_t round = 0; round != 50; ++round) {
    const std::uint32_t count = 1 + round % slots;
    texts expected;
    for (std::uint32_t i = 0; i != count; ++i) {
      expected.push_back(std::to_string(next++));
      h.submit(expected.back());
    }
    // In two portions, and settled in the opposite order so that the slots are shuffled.
    texts seen = h.take(count / 2);
    EXPECT_EQ(seen.size(), count / 2);
    for (std::string& text : h.take()) seen.push_back(std::move(text));
    EXPECT_EQ(seen, expected);
    std::swap(h.held.front(), h.held.back());
    h.settle_all();
    ASSERT_STREQ(h.door.check(), nullptr);
  }
}

TEST(front_door, keeps_the_order_of_threads_that_hear_of_each_other) {
  house h;
  for (int round = 0; round != 20; ++round) {
    std::thread{[&] { h.submit("first"); }}.join();
    std::thread{[&] { h.submit("second"); }}.join();
    h.submit("third");
    EXPECT_EQ(h.take(), (texts{"first", "second", "third"}));
    h.settle_all();
  }
}

TEST(front_door, takes_no_more_than_it_is_asked_to) {
  house h;
  for (const char* text : {"a", "b", "c"}) h.submit(text);
  EXPECT_EQ(h.take(0), texts{});
  EXPECT_EQ(h.take(2), (texts{"a", "b"}));
  EXPECT_STREQ(h.door.check(), nullptr);
  h.submit("d");
  EXPECT_EQ(h.take(2), (texts{"c", "d"}));
  EXPECT_EQ(h.take(2), texts{});
  EXPECT_EQ(h.door.unsettled(), slots);
  h.settle_all();
}

TEST(front_door, is_full_until_a_request_is_settled) {
  house h;
  for (std::uint32_t i = 0; i != slots; ++i) h.submit("x");
  const auto refused = h.door.submit({}, "x");
  EXPECT_EQ(refused.code(), errc::full);
  EXPECT_EQ(refused.error().limit, slots);
  h.take(1);
  EXPECT_EQ(h.door.submit({}, "x").code(), errc::full);
  h.settle_all();
  EXPECT_TRUE(h.door.submit({}, "x"));
  h.take();
  h.settle_all();
}

TEST(front_door, refuses_a_text_that_exceeds_a_slot) {
  house h;
  const auto refused = h.door.submit({}, std::string(slot_bytes + 1, 'x'));
  EXPECT_EQ(refused.error(), (error{errc::too_big, slot_bytes + 1, slot_bytes}));
  h.submit(std::string(slot_bytes, 'x'));
  EXPECT_EQ(h.take().front().size(), slot_bytes);
  h.settle_all();
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, without_slots_is_always_full) {
  limits bounds = small();
  bounds.door_slots = 0;
  house h{bounds};
  EXPECT_EQ(h.door.submit({}, "x").code(), errc::full);
  EXPECT_EQ(h.door.deliver({}, "x").code(), errc::full);
  EXPECT_EQ(h.door.try_receive(start).code(), errc::empty);
  EXPECT_EQ(h.take(), texts{});
  h.door.finish();
}

// ---- Outcomes.

TEST(front_door, gives_the_outcome_to_whoever_comes_after_it) {
  house h;
  const std::uint32_t slot = h.submit("{\"service\":\"add\"}", true);
  h.take();
  h.door.settle(slot, {}, "{\"sum\":3}");
  EXPECT_FALSE(h.door.all_home());
  ASSERT_TRUE(h.door.wait(slot, rt::time_point{})); // it is there, so the deadline does not matter
  EXPECT_TRUE(h.door.outcome(slot));
  EXPECT_EQ(h.door.reply_text(slot), "{\"sum\":3}");
  h.door.give_back(slot);
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, wakes_whoever_waits_for_the_outcome) {
  const watchdog dog{"waiting for an outcome"};
  house h;
  for (int round = 0; round != 100; ++round) {
    std::thread asker{[&] {
      const std::uint32_t slot = h.submit("x", true);
      ASSERT_TRUE(h.door.wait(slot, rt::never));
      EXPECT_EQ(h.door.outcome(slot).error(), (error{errc::peer_lost, 7, 8}));
      EXPECT_EQ(h.door.reply_text(slot), "why");
      h.door.give_back(slot);
    }};
    while (h.take().empty()) std::this_thread::yield();
    h.door.settle(h.held.back(), error{errc::peer_lost, 7, 8}, "why");
    h.held.clear();
    asker.join();
  }
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, gives_back_itself_the_slot_of_a_caller_that_ran_out_of_time) {
  house h;
  const std::uint32_t slot = h.submit("x", true);
  EXPECT_FALSE(h.door.wait(slot, rt::time_point{}));
  h.take();
  EXPECT_FALSE(h.door.all_home());
  h.door.settle(slot, {}, "late");
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, says_that_a_reply_does_not_fit) {
  house h;
  const std::uint32_t slot = h.submit("x", true);
  h.take();
  h.door.settle(slot, {}, std::string(slot_bytes + 1, 'x'));
  ASSERT_TRUE(h.door.wait(slot, rt::never));
  EXPECT_EQ(h.door.outcome(slot).error(), (error{errc::too_big, slot_bytes + 1, slot_bytes}));
  EXPECT_EQ(h.door.reply_text(slot), "");
  h.door.give_back(slot);
}

TEST(front_door, leaves_an_error_as_it_is_when_its_text_does_not_fit) {
  house h;
  const std::uint32_t slot = h.submit("x", true);
  h.take();
  h.door.settle(slot, errc::refused, std::string(slot_bytes + 1, 'x'));
  ASSERT_TRUE(h.door.wait(slot, rt::never));
  EXPECT_EQ(h.door.outcome(slot).code(), errc::refused);
  EXPECT_EQ(h.door.reply_text(slot), "");
  h.door.give_back(slot);
}

TEST(front_door, takes_a_reply_out_of_the_request_itself) {
  house h;
  const std::uint32_t slot = h.submit("0123456789", true);
  h.take();
  h.door.settle(slot, {}, h.door.request_text(slot).substr(3));
  ASSERT_TRUE(h.door.wait(slot, rt::never));
  EXPECT_EQ(h.door.reply_text(slot), "3456789");
  h.door.give_back(slot);
}

TEST(front_door, may_be_settled_while_it_is_taken_from) {
  house h;
  for (int i = 0; i != 10; ++i) {
    h.submit("x");
    EXPECT_EQ(h.door.take([&](std::uint32_t slot) { h.door.settle(slot, {}); }, SIZE_MAX), 1U);
  }
  EXPECT_TRUE(h.door.all_home());
}

// ---- In.

TEST(front_door, brings_what_arrives_in_order) {
  house h;
  EXPECT_FALSE(h.door.manned());
  EXPECT_EQ(h.door.try_receive(start).code(), errc::empty);
  EXPECT_TRUE(h.door.manned());
  int delivered = 0;
  int received = 0;
  std::vector<std::uint32_t> kept;
  for (int round = 0; round != 50; ++round) {
    while (h.door.deliver({.peer = {1, 2}, .call = {3, 4}}, std::to_string(delivered))) ++delivered;
    for (int i = 0; i != 1 + round % 3; ++i) {
      const auto slot = h.door.try_receive(start);
      ASSERT_TRUE(slot);
      EXPECT_EQ(h.door.inbound_text(*slot), std::to_string(received++));
      EXPECT_EQ(h.door.inbound_header(*slot).peer, (detail::peer_ref{1, 2}));
      EXPECT_EQ(h.door.inbound_header(*slot).call, (detail::call_ref{3, 4}));
      kept.push_back(*slot);
    }
    ASSERT_STREQ(h.door.check(), nullptr);
    for (; !kept.empty(); kept.pop_back()) h.door.give_back_inbound(kept.back());
  }
  while (const auto slot = h.door.try_receive(start)) h.door.give_back_inbound(*slot);
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, says_why_it_does_not_take_a_message_in) {
  house h;
  EXPECT_EQ(h.door.deliver({}, std::string(slot_bytes + 1, 'x')).error(),
            (error{errc::too_big, slot_bytes + 1, slot_bytes}));
  for (std::uint32_t i = 0; i != slots; ++i) EXPECT_TRUE(h.door.deliver({}, "x"));
  EXPECT_EQ(h.door.deliver({}, "x").error(), (error{errc::full, 0, slots}));
  const std::uint32_t slot = h.door.try_receive(start).value();
  EXPECT_EQ(h.door.deliver({}, "x").code(), errc::full); // it is in the receiver's hands
  h.door.give_back_inbound(slot);
  EXPECT_TRUE(h.door.deliver({}, "x"));
  h.door.close();
  EXPECT_EQ(h.door.deliver({}, "x").code(), errc::closed);
}

TEST(front_door, drops_and_counts_what_expired_in_the_inbox) {
  house h;
  EXPECT_TRUE(h.door.deliver({.expires = start - 1ns}, "old"));
  EXPECT_TRUE(h.door.deliver({.expires = start - 1s}, "older"));
  EXPECT_TRUE(h.door.deliver({.expires = start}, "fresh"));
  const std::uint32_t slot = h.door.try_receive(start).value();
  EXPECT_EQ(h.door.inbound_text(slot), "fresh");
  EXPECT_EQ(h.door.expired(), 2U);
  h.door.give_back_inbound(slot);
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, makes_room_in_a_full_inbox_by_what_expired_in_front) {
  house h;
  EXPECT_TRUE(h.door.deliver({.stamped = start, .expires = start + 1s}, "a"));
  EXPECT_TRUE(h.door.deliver({.stamped = start, .expires = start + 1s}, "b"));
  EXPECT_TRUE(h.door.deliver({.stamped = start}, "c"));
  EXPECT_TRUE(h.door.deliver({.stamped = start}, "d"));
  EXPECT_EQ(h.door.deliver({.stamped = start + 1s}, "e").code(), errc::full);
  EXPECT_TRUE(h.door.deliver({.stamped = start + 2s}, "e"));
  EXPECT_EQ(h.door.expired(), 2U);
  for (const char* text : {"c", "d", "e"}) {
    const std::uint32_t slot = h.door.try_receive(start + 2s).value();
    EXPECT_EQ(h.door.inbound_text(slot), text);
    h.door.give_back_inbound(slot);
  }
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, says_whose_slots_came_home_before_they_are_used_again) {
  house h;
  std::vector<std::uint32_t> from;
  const auto collect = [&] {
    from.clear();
    return h.door.collect_inbound([&](rowe::detail::peer_ref peer) { from.push_back(peer.index); });
  };
  EXPECT_EQ(collect(), slots);
  EXPECT_TRUE(from.empty());
  for (std::uint32_t i = 0; i != slots; ++i) EXPECT_TRUE(h.door.deliver({.peer = {i, 1}}, "x"));
  EXPECT_EQ(collect(), 0U);
  const auto first = h.door.try_receive(start);
  const auto second = h.door.try_receive(start);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(collect(), 0U) << "they are in the receiver's hands";
  EXPECT_FALSE(h.door.give_back_inbound(*second)) << "nobody waits";
  h.door.ask_for_slots();
  EXPECT_TRUE(h.door.give_back_inbound(*first)) << "once";
  EXPECT_EQ(collect(), 2U);
  EXPECT_EQ(from, (std::vector{1U, 0U}));
  h.door.forget_senders();
  while (const auto left = h.door.try_receive(start)) EXPECT_FALSE(h.door.give_back_inbound(*left));
  EXPECT_EQ(collect(), slots);
  EXPECT_TRUE(from.empty());
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, tells_who_waits_that_there_is_room) {
  house h;
  EXPECT_TRUE(h.door.has_room(true));
  for (std::uint32_t i = 0; i != slots; ++i) h.submit("x");
  EXPECT_FALSE(h.door.has_room(false));
  EXPECT_FALSE(h.door.wait_room(start, [&] { return h.door.has_room(false); })) << "long past";
  h.take();
  const watchdog dog{"a thread that waits for room"};
  std::atomic<int> looked{0};
  std::vector<std::thread> waiting;
  for (int i = 0; i < 3; ++i) {
    waiting.emplace_back([&] {
      EXPECT_TRUE(h.door.wait_room(rt::never, [&] {
        ++looked;
        return h.door.has_room(false);
      }));
    });
  }
  while (looked.load() < 3) std::this_thread::yield();
  h.door.settle(h.held.back(), {});
  h.held.pop_back();
  for (std::thread& one : waiting) one.join();
  h.settle_all();
}

TEST(front_door, refuses_what_is_for_everyone_when_it_is_told_to) {
  house h;
  EXPECT_TRUE(h.door.refuse_to_everyone(true));
  EXPECT_FALSE(h.door.refuse_to_everyone(true)) << "that is nothing new";
  EXPECT_EQ(h.door.submit({}, "x").error(), (error{errc::full, 0, slots}));
  EXPECT_FALSE(h.door.has_room(true));
  EXPECT_TRUE(h.door.has_room(false));
  EXPECT_TRUE(h.door.submit({.peer = {0, 1}}, "x"));
  EXPECT_TRUE(h.door.submit({.what = door_request::reply}, "x"));
  EXPECT_TRUE(h.door.refuse_to_everyone(false));
  EXPECT_TRUE(h.door.submit({}, "x"));
  h.take();
  h.settle_all();
}

TEST(front_door, ends_a_receive_at_its_deadline) {
  house h;
  EXPECT_EQ(h.door.receive(rt::time_point{}).code(), errc::timed_out);
  const rt::time_point deadline = rt::monotonic_clock::now() + 2ms;
  EXPECT_EQ(h.door.receive(deadline).code(), errc::timed_out);
  EXPECT_GE(rt::monotonic_clock::now(), deadline);
  EXPECT_TRUE(h.door.deliver({}, "x"));
  const auto slot = h.door.receive(rt::time_point{}); // there already
  ASSERT_TRUE(slot);
  h.door.give_back_inbound(*slot);
}

TEST(front_door, wakes_sleeping_receivers_one_for_each_message) {
  const watchdog dog{"sleeping receivers"};
  house h;
  std::array<std::thread, 3> receivers;
  for (std::thread& receiver : receivers)
    receiver = std::thread{[&] {
      for (int i = 0; i != 200; ++i) {
        const auto slot = h.door.receive(rt::never);
        ASSERT_TRUE(slot);
        EXPECT_EQ(h.door.inbound_text(*slot), "x");
        h.door.give_back_inbound(*slot);
      }
    }};
  for (int delivered = 0; delivered != 600;) {
    if (h.door.deliver({}, "x"))
      ++delivered;
    else
      std::this_thread::yield();
  }
  for (std::thread& receiver : receivers) receiver.join();
  EXPECT_TRUE(h.door.all_home());
}

// ---- The end.

TEST(front_door, takes_no_more_in_either_direction_once_it_is_closed) {
  house h;
  h.submit("before");
  EXPECT_TRUE(h.door.deliver({}, "left"));
  h.door.close();
  h.door.close();
  EXPECT_TRUE(h.door.is_closed());
  EXPECT_EQ(h.door.submit({}, "after").code(), errc::closed);
  EXPECT_EQ(h.take(), texts{"before"});
  h.settle_all();
  const std::uint32_t slot = h.door.receive(rt::never).value(); // what is left still comes
  h.door.give_back_inbound(slot);
  EXPECT_EQ(h.door.receive(rt::never).code(), errc::closed);
  EXPECT_EQ(h.door.try_receive(start).code(), errc::closed);
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, wakes_every_sleeping_receiver_when_it_closes) {
  const watchdog dog{"closing with sleeping receivers"};
  for (int round = 0; round != 50; ++round) {
    house h;
    std::atomic<int> closed{0};
    std::vector<std::thread> receivers;
    for (int i = 0; i != 5; ++i)
      receivers.emplace_back([&] {
        for (;;) {
          const auto slot = h.door.receive(rt::never);
          if (slot) {
            h.door.give_back_inbound(*slot);
            continue;
          }
          EXPECT_EQ(slot.code(), errc::closed);
          ++closed;
          return;
        }
      });
    for (int i = 0; i != round % 4; ++i) EXPECT_TRUE(h.door.deliver({}, "x"));
    h.door.close();
    for (std::thread& receiver : receivers) receiver.join();
    EXPECT_EQ(closed, 5);
    EXPECT_TRUE(h.door.all_home());
  }
}

TEST(front_door, settles_with_closed_whatever_is_open_when_it_finishes) {
  const watchdog dog{"finishing with callers"};
  house h;
  const std::uint32_t taken = h.submit("taken", true);
  h.take();
  const std::uint32_t queued = h.submit("queued", true);
  h.submit("nobody waits");
  std::thread asker{[&] {
    if (h.door.wait(taken, rt::never)) {
      EXPECT_EQ(h.door.outcome(taken).code(), errc::closed);
      h.door.give_back(taken);
    } else { // it came while finish() was under way
      EXPECT_TRUE(h.door.is_closed());
    }
  }};
  h.door.finish();
  asker.join();
  ASSERT_TRUE(h.door.wait(queued, rt::never)); // also for who asks afterwards
  EXPECT_EQ(h.door.outcome(queued).code(), errc::closed);
  h.door.give_back(queued);
  EXPECT_TRUE(h.door.drained());
  EXPECT_TRUE(h.door.all_home());
}

TEST(front_door, keeps_an_outcome_that_was_there_before_it_finished) {
  house h;
  const std::uint32_t slot = h.submit("x", true);
  h.take();
  h.door.settle(slot, {}, "reply");
  h.door.finish();
  ASSERT_TRUE(h.door.wait(slot, rt::never));
  EXPECT_TRUE(h.door.outcome(slot));
  EXPECT_EQ(h.door.reply_text(slot), "reply");
  h.door.give_back(slot);
}

} // namespace
} // namespace front_door_test
