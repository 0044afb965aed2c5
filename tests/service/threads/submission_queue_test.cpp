// SPDX-License-Identifier: Apache-2.0
// Each state of the submission queue; tests/stress has many threads in it at once, tests/model the hand-off
// of a slot between a caller that runs out of time and the service thread.
#include "service/threads/submission_queue.hpp"

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "rt/watchdog.hpp"

namespace submission_queue_test {
namespace {

using namespace std::chrono_literals;
using namespace rowe;
using detail::entry;
using service::submission_header;
using service::submission_queue;
using tests::watchdog;

constexpr std::uint32_t slots = 4;
constexpr std::size_t slot_bytes = 64;

limits small() { return {.door_slots = slots, .door_slot_bytes = slot_bytes}; }

// A queue in an arena that has exactly what it says it needs.
struct fixture {
  explicit fixture(const limits& bounds = small())
      : memory{rt::arena::bytes_for<submission_queue>() + submission_queue::footprint_bytes(bounds),
               rt::page_lock::none},
        queue{*memory.make<submission_queue>(memory, bounds)} {}
  ~fixture() { EXPECT_STREQ(queue.check(), nullptr); }

  std::uint32_t submit(std::string_view text, bool wants_outcome = false) {
    return queue.submit({.wants_outcome = wants_outcome}, text).value();
  }
  std::vector<std::string> take(std::size_t most = SIZE_MAX) {
    std::vector<std::string> texts;
    queue.take(
        [&](std::uint32_t slot) {
          texts.emplace_back(queue.request_text(slot));
          taken.push_back(slot);
        },
        most);
    return texts;
  }
  // The outcome that is there, and the text of the reply; the slot is free then.
  std::pair<result<void>, std::string> outcome_of(std::uint32_t slot) {
    EXPECT_TRUE(queue.wait(slot, rt::never));
    std::pair<result<void>, std::string> seen{queue.outcome(slot), queue.reply_text(slot)};
    queue.release(slot);
    return seen;
  }
  void complete_all() {
    for (const std::uint32_t slot : taken) queue.complete(slot, {});
    taken.clear();
  }

  rt::arena memory;
  submission_queue& queue;
  std::vector<std::uint32_t> taken; // and not completed
};

using texts = std::vector<std::string>;
const rt::time_point start{1000s};

TEST(submission_queue, takes_from_the_arena_what_it_says) {
  for (const std::uint32_t count : {1U, 2U, 3U, 32U, 100U}) {
    limits bounds = small();
    bounds.door_slots = count;
    fixture h{bounds};
    EXPECT_EQ(h.memory.bytes_used(),
              rt::arena::bytes_for<submission_queue>() + submission_queue::footprint_bytes(bounds));
    EXPECT_TRUE(h.queue.all_free());
  }
}

TEST(submission_queue, hands_what_is_submitted_to_the_service_thread) {
  fixture h;
  const submission_header asked{
      .what = entry::reply, .peer = {3, 4}, .call = {5, 6}, .stamped = start, .expires = start + 1s};
  ASSERT_TRUE(h.queue.submit(asked, "{\"a\":1}"));
  EXPECT_EQ(h.take(), texts{"{\"a\":1}"});
  const submission_header& seen = h.queue.request(h.taken.front());
  EXPECT_EQ(seen.what, entry::reply);
  EXPECT_EQ(seen.peer, asked.peer);
  EXPECT_EQ(seen.call, asked.call);
  EXPECT_EQ(seen.stamped, start);
  EXPECT_EQ(seen.expires, start + 1s);
  EXPECT_EQ(seen.bytes, 7U);
  EXPECT_FALSE(h.queue.drained());
  h.complete_all();
  EXPECT_TRUE(h.queue.drained());
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, keeps_the_order_of_submission_whichever_slots_carry_it) {
  fixture h;
  std::uint32_t next = 0;
  for (std::uint32_t round = 0; round != 50; ++round) {
    const std::uint32_t count = 1 + round % slots;
    texts expected;
    for (std::uint32_t i = 0; i != count; ++i) {
      expected.push_back(std::to_string(next++));
      h.submit(expected.back());
    }
    // In two portions, and completed in the opposite order so that the slots are shuffled.
    texts seen = h.take(count / 2);
    EXPECT_EQ(seen.size(), count / 2);
    for (std::string& text : h.take()) seen.push_back(std::move(text));
    EXPECT_EQ(seen, expected);
    std::swap(h.taken.front(), h.taken.back());
    h.complete_all();
    ASSERT_STREQ(h.queue.check(), nullptr);
  }
}

TEST(submission_queue, keeps_the_order_of_threads_that_hear_of_each_other) {
  fixture h;
  for (int round = 0; round != 20; ++round) {
    std::thread{[&] { h.submit("first"); }}.join();
    std::thread{[&] { h.submit("second"); }}.join();
    h.submit("third");
    EXPECT_EQ(h.take(), (texts{"first", "second", "third"}));
    h.complete_all();
  }
}

TEST(submission_queue, is_full_until_a_request_is_completed) {
  fixture h;
  for (std::uint32_t i = 0; i != slots; ++i) h.submit("x");
  const auto refused = h.queue.submit({}, "x");
  EXPECT_EQ(refused.code(), errc::full);
  EXPECT_EQ(refused.error().limit, slots);
  h.take(1);
  EXPECT_EQ(h.queue.submit({}, "x").code(), errc::full);
  h.complete_all();
  EXPECT_TRUE(h.queue.submit({}, "x"));
  h.take();
  h.complete_all();
}

TEST(submission_queue, refuses_a_text_that_exceeds_a_slot) {
  fixture h;
  const auto refused = h.queue.submit({}, std::string(slot_bytes + 1, 'x'));
  EXPECT_EQ(refused.error(), (error{errc::too_big, slot_bytes + 1, slot_bytes}));
  h.submit(std::string(slot_bytes, 'x'));
  EXPECT_EQ(h.take().front().size(), slot_bytes);
  h.complete_all();
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, without_slots_is_always_full) {
  limits bounds = small();
  bounds.door_slots = 0;
  fixture h{bounds};
  EXPECT_EQ(h.queue.submit({}, "x").code(), errc::full);
  EXPECT_EQ(h.take(), texts{});
  h.queue.finish();
}

TEST(submission_queue, tells_who_waits_that_there_is_room) {
  fixture h;
  EXPECT_TRUE(h.queue.has_room(true));
  for (std::uint32_t i = 0; i != slots; ++i) h.submit("x");
  EXPECT_FALSE(h.queue.has_room(false));
  EXPECT_FALSE(h.queue.wait_room(rt::time_point{}, [&] { return h.queue.has_room(false); })) << "past";
  h.take();
  const watchdog dog{"a thread that waits for room"};
  std::atomic<int> looked{0};
  std::vector<std::thread> waiting;
  for (int i = 0; i < 3; ++i) {
    waiting.emplace_back([&] {
      EXPECT_TRUE(h.queue.wait_room(rt::never, [&] {
        ++looked;
        return h.queue.has_room(false);
      }));
    });
  }
  while (looked.load() < 3) std::this_thread::yield();
  h.queue.complete(h.taken.back(), {});
  h.taken.pop_back();
  for (std::thread& one : waiting) one.join();
  h.complete_all();
}

TEST(submission_queue, refuses_what_is_for_everyone_when_it_is_told_to) {
  fixture h;
  EXPECT_TRUE(h.queue.refuse_to_everyone(true));
  EXPECT_FALSE(h.queue.refuse_to_everyone(true)) << "that is nothing new";
  EXPECT_EQ(h.queue.submit({}, "x").error(), (error{errc::full, 0, slots}));
  EXPECT_FALSE(h.queue.has_room(true));
  EXPECT_TRUE(h.queue.has_room(false));
  EXPECT_TRUE(h.queue.submit({.peer = {0, 1}}, "x"));
  EXPECT_TRUE(h.queue.submit({.what = entry::reply}, "x"));
  EXPECT_TRUE(h.queue.refuse_to_everyone(false));
  EXPECT_TRUE(h.queue.submit({}, "x"));
  h.take();
  h.complete_all();
}

// ---- Outcomes.

TEST(submission_queue, gives_the_outcome_to_whoever_comes_after_it) {
  fixture h;
  const std::uint32_t slot = h.submit("{\"service\":\"add\"}", true);
  h.take();
  h.queue.complete(slot, {}, "{\"sum\":3}");
  EXPECT_FALSE(h.queue.all_free());
  ASSERT_TRUE(h.queue.wait(slot, rt::time_point{})); // it is there, so the deadline does not matter
  EXPECT_TRUE(h.queue.outcome(slot));
  EXPECT_EQ(h.queue.reply_text(slot), "{\"sum\":3}");
  h.queue.release(slot);
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, wakes_whoever_waits_for_the_outcome) {
  const watchdog dog{"waiting for an outcome"};
  fixture h;
  for (int round = 0; round != 100; ++round) {
    std::thread submitter{[&] {
      const std::uint32_t slot = h.submit("x", true);
      const auto [outcome, text] = h.outcome_of(slot);
      EXPECT_EQ(outcome.error(), (error{errc::peer_lost, 7, 8}));
      EXPECT_EQ(text, "why");
    }};
    while (h.take().empty()) std::this_thread::yield();
    h.queue.complete(h.taken.back(), error{errc::peer_lost, 7, 8}, "why");
    h.taken.clear();
    submitter.join();
  }
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, releases_itself_the_slot_of_a_caller_that_ran_out_of_time) {
  fixture h;
  const std::uint32_t slot = h.submit("x", true);
  EXPECT_FALSE(h.queue.wait(slot, rt::time_point{}));
  h.take();
  EXPECT_FALSE(h.queue.all_free());
  h.queue.complete(slot, {}, "late");
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, says_that_a_reply_does_not_fit) {
  fixture h;
  const std::uint32_t slot = h.submit("x", true);
  h.take();
  h.queue.complete(slot, {}, std::string(slot_bytes + 1, 'x'));
  const auto [outcome, text] = h.outcome_of(slot);
  EXPECT_EQ(outcome.error(), (error{errc::too_big, slot_bytes + 1, slot_bytes}));
  EXPECT_EQ(text, "");
}

TEST(submission_queue, leaves_an_error_as_it_is_when_its_text_does_not_fit) {
  fixture h;
  const std::uint32_t slot = h.submit("x", true);
  h.take();
  h.queue.complete(slot, errc::refused, std::string(slot_bytes + 1, 'x'));
  const auto [outcome, text] = h.outcome_of(slot);
  EXPECT_EQ(outcome.code(), errc::refused);
  EXPECT_EQ(text, "");
}

TEST(submission_queue, takes_a_reply_out_of_the_request_itself) {
  fixture h;
  const std::uint32_t slot = h.submit("0123456789", true);
  h.take();
  h.queue.complete(slot, {}, h.queue.request_text(slot).substr(3));
  EXPECT_EQ(h.outcome_of(slot).second, "3456789");
}

TEST(submission_queue, completes_requests_while_it_is_taken_from) {
  fixture h;
  for (int i = 0; i != 10; ++i) {
    h.submit("x");
    EXPECT_EQ(h.queue.take([&](std::uint32_t slot) { h.queue.complete(slot, {}); }, SIZE_MAX), 1U);
  }
  EXPECT_TRUE(h.queue.all_free());
}

// ---- The end.

TEST(submission_queue, takes_no_more_once_it_is_closed) {
  fixture h;
  h.submit("before");
  h.queue.close();
  h.queue.close();
  EXPECT_TRUE(h.queue.is_closed());
  EXPECT_EQ(h.queue.submit({}, "after").code(), errc::closed);
  EXPECT_EQ(h.take(), texts{"before"});
  h.complete_all();
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, completes_with_closed_whatever_is_open_when_it_finishes) {
  const watchdog dog{"finishing with callers"};
  fixture h;
  const std::uint32_t taken = h.submit("taken", true);
  h.take();
  const std::uint32_t queued = h.submit("queued", true);
  h.submit("nobody waits");
  std::thread submitter{[&] {
    if (h.queue.wait(taken, rt::never)) {
      EXPECT_EQ(h.queue.outcome(taken).code(), errc::closed);
      h.queue.release(taken);
    } else { // it came while finish() was under way
      EXPECT_TRUE(h.queue.is_closed());
    }
  }};
  h.queue.finish();
  submitter.join();
  EXPECT_EQ(h.outcome_of(queued).first.code(), errc::closed) << "also for who asks afterwards";
  EXPECT_TRUE(h.queue.drained());
  EXPECT_TRUE(h.queue.all_free());
}

TEST(submission_queue, keeps_an_outcome_that_was_there_before_it_finished) {
  fixture h;
  const std::uint32_t slot = h.submit("x", true);
  h.take();
  h.queue.complete(slot, {}, "reply");
  h.queue.finish();
  const auto [outcome, text] = h.outcome_of(slot);
  EXPECT_TRUE(outcome);
  EXPECT_EQ(text, "reply");
}

} // namespace
} // namespace submission_queue_test
