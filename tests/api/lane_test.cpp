// SPDX-License-Identifier: Apache-2.0
// rowe::lane and caller: what they do with their slots, calls and ends, whatever the service thread does.
#include <rowe/caller.hpp>
#include <rowe/lane.hpp>

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "handle_harness.hpp"

namespace lane_test {
namespace {

using namespace handle_harness;
using detail::entry;

constexpr std::uint32_t depth = 4;
constexpr std::uint32_t calls_max = 3;

class talking : public ::testing::Test {
 protected:
  pair_harness on{
      detail::talk_request({.depth = depth, .inbox_depth = 2, .calls = calls_max, .text_bytes_max = 200})};
  rowe::lane talk{on.handle()};

  call_id start(std::string_view text = R"({"service":"x"})") {
    auto begun = talk.start(text, 1s, now);
    EXPECT_TRUE(begun) << begun.error().name();
    return *begun;
  }
  static detail::call_ref ref(call_id id) { return {id.index, id.generation}; }
};

// ---- sending

TEST_F(talking, sends_text_with_its_time_to_live_and_its_addressee) {
  on.generations[2].store(7, std::memory_order_relaxed); // relaxed: one thread
  ASSERT_TRUE(talk.try_send(R"({"a":1})", 20ms, now, {2, 7}));
  const auto sent = on.take();
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->text, R"({"a":1})");
  EXPECT_EQ(sent->header.what, entry::message);
  EXPECT_EQ(sent->header.peer, (detail::peer_ref{2, 7}));
  EXPECT_EQ(sent->header.expires_ns, rt::nanoseconds_of(now + 20ms));
  EXPECT_EQ(sent->header.own, detail::call_ref{});
}

TEST_F(talking, gives_0_and_negative_times_to_live_their_meaning) {
  ASSERT_TRUE(talk.try_send("{}", 0ns, now));
  EXPECT_EQ(on.take()->header.expires_ns, rt::nanoseconds_of(now));
  ASSERT_TRUE(talk.try_send("{}", -1ns, now));
  EXPECT_EQ(on.take()->header.expires_ns, rt::nanoseconds_of(rt::never));
}

TEST_F(talking, says_full_with_the_depth_and_counts_it) {
  for (std::uint32_t i = 0; i < depth; ++i) ASSERT_TRUE(talk.try_send("{}", 1s, now));
  const auto refused = talk.try_send("{}", 1s, now);
  EXPECT_EQ(refused.code(), errc::full);
  EXPECT_EQ(refused.error().limit, depth);
  EXPECT_EQ(talk.sent(), depth);
  EXPECT_EQ(talk.dropped_full(), 1U);
}

TEST_F(talking, says_too_big_with_the_size_and_the_limit) {
  const auto text = talk.try_send(std::string(201, ' '), 1s, now);
  EXPECT_EQ(text.error(), (error{errc::too_big, 201, 200}));
  const rowe::message_of<8> overflowed{"name", "value"};
  const auto message = talk.try_send(overflowed, 1s, now);
  EXPECT_EQ(message.error(), (error{errc::too_big, 9, 8}));
  EXPECT_EQ(talk.dropped_too_big(), 2U);
}

TEST_F(talking, says_peer_lost_of_a_connection_that_is_gone_or_of_another_endpoint) {
  on.generations[1].store(5, std::memory_order_relaxed); // relaxed: one thread
  EXPECT_TRUE(talk.try_send("{}", 1s, now, {1, 5}));
  EXPECT_EQ(talk.try_send("{}", 1s, now, {1, 4}).code(), errc::peer_lost);
  EXPECT_EQ(talk.try_send("{}", 1s, now, {99, 5}).code(), errc::peer_lost);
  EXPECT_EQ(talk.start("{}", 1s, now, {1, 4}).code(), errc::peer_lost);
}

TEST_F(talking, says_closed_once_the_endpoint_is) {
  on.close();
  EXPECT_EQ(talk.try_send("{}", 1s, now).code(), errc::closed);
  EXPECT_EQ(talk.send("{}", 1s).code(), errc::closed);
  EXPECT_EQ(talk.try_receive(now).code(), errc::closed);
  EXPECT_EQ(talk.receive(-1ns).code(), errc::closed);
  EXPECT_EQ(talk.start("{}", 1s, now).code(), errc::closed);
  EXPECT_EQ(talk.invoke("{}", 1s).code(), errc::closed);
  EXPECT_EQ(talk.try_finish().code(), errc::closed);
}

// ---- receiving

TEST_F(talking, receives_in_order_with_the_sender) {
  ASSERT_TRUE(on.arrive(message_from({3, 9}), R"({"n":1})"));
  ASSERT_TRUE(on.arrive(message_from({}), R"({"n":2})"));
  {
    const auto first = talk.try_receive(now);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->value(), R"({"n":1})");
    EXPECT_EQ(first->from(), (connection{3, 9}));
    EXPECT_EQ(first->arrived(), now);
    EXPECT_FALSE(first->wants_reply());
    const auto second = talk.try_receive(now);
    ASSERT_TRUE(second);
    EXPECT_FALSE(second->from());
    EXPECT_FALSE(on.arrive(message_from({}), "{}")); // both slots are held
  }
  EXPECT_EQ(talk.try_receive(now).code(), errc::empty);
  EXPECT_TRUE(on.arrive(message_from({}), "{}"));
}

TEST_F(talking, drops_and_counts_what_is_out_of_date) {
  ASSERT_TRUE(on.arrive(message_from({}, now), "{}"));
  ASSERT_TRUE(on.arrive(message_from({}, now + 1ns), R"({"n":2})"));
  const auto left = talk.try_receive(now);
  ASSERT_TRUE(left);
  EXPECT_EQ(left->value(), R"({"n":2})");
  EXPECT_EQ(talk.expired(), 1U);
}

TEST_F(talking, hands_out_what_came_before_it_closed) {
  ASSERT_TRUE(on.arrive(message_from({}), "{}"));
  on.close();
  EXPECT_TRUE(talk.receive(0ns));
  EXPECT_EQ(talk.receive(0ns).code(), errc::closed);
}

TEST_F(talking, times_out_where_nothing_comes) {
  const auto nothing = talk.receive(5ms);
  EXPECT_EQ(nothing.error(), (error{errc::timed_out, 0, 5'000'000}));
}

// ---- calls

TEST_F(talking, finishes_calls_in_the_order_of_their_ends) {
  const call_id first = start();
  const call_id second = start();
  EXPECT_NE(first, second);
  EXPECT_EQ(talk.try_finish().code(), errc::empty);
  ASSERT_TRUE(on.end(ref(second), R"({"r":2})"));
  ASSERT_TRUE(on.fail(ref(first), {errc::peer_lost}));
  {
    const auto ended = talk.try_finish();
    ASSERT_TRUE(ended);
    EXPECT_EQ(ended->id, second);
    ASSERT_TRUE(ended->reply);
    EXPECT_EQ(ended->reply->value(), R"({"r":2})");
  }
  const auto lost = talk.try_finish();
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->id, first);
  EXPECT_EQ(lost->reply.code(), errc::peer_lost);
  EXPECT_EQ(talk.try_finish().code(), errc::empty);
}

TEST_F(talking, says_too_many_calls_with_how_many) {
  for (std::uint32_t i = 0; i < calls_max; ++i) {
    start();
    ASSERT_TRUE(on.take());
  }
  EXPECT_EQ(talk.start("{}", 1s, now).error(), (error{errc::too_many_calls, calls_max, calls_max}));
}

TEST_F(talking, takes_back_the_place_of_a_call_that_never_left) {
  for (std::uint32_t i = 0; i < 3 * calls_max; ++i) {
    EXPECT_EQ(talk.start(std::string(201, ' '), 1s, now).code(), errc::too_big);
  }
  for (std::uint32_t i = 0; i < calls_max; ++i) start();
}

TEST_F(talking, drops_the_end_of_a_call_that_was_cancelled_and_frees_its_place_then) {
  const call_id wanted = start();
  const call_id unwanted = start();
  const call_id third = start();
  while (on.take()) {
  }
  talk.cancel(unwanted);
  talk.cancel(unwanted);
  EXPECT_EQ(talk.start("{}", 1s, now).code(), errc::too_many_calls);
  ASSERT_TRUE(on.end(ref(unwanted), "{}"));
  ASSERT_TRUE(on.end(ref(wanted), "{}"));
  const auto ended = talk.try_finish();
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->id, wanted);
  EXPECT_EQ(talk.try_finish().code(), errc::empty);
  const call_id reused = start();
  EXPECT_EQ(reused.index, unwanted.index);
  EXPECT_NE(reused, unwanted);
  talk.cancel(unwanted); // stale: nothing happens to the new one
  ASSERT_TRUE(on.end(ref(reused), "{}"));
  ASSERT_TRUE(on.end(ref(third), "{}"));
  EXPECT_EQ(talk.try_finish()->id, reused);
  EXPECT_EQ(talk.try_finish()->id, third);
}

TEST_F(talking, keeps_the_place_of_a_call_while_its_reply_is_looked_at) {
  std::vector<call_end> held;
  for (std::uint32_t i = 0; i < calls_max; ++i) {
    ASSERT_TRUE(on.end(ref(start()), "{}"));
    ASSERT_TRUE(on.take());
    auto ended = talk.try_finish();
    ASSERT_TRUE(ended);
    held.push_back(std::move(*ended));
  }
  EXPECT_EQ(talk.start("{}", 1s, now).code(), errc::too_many_calls); // there would be no slot for its end
  held.clear();
  for (std::uint32_t i = 0; i < calls_max; ++i) ASSERT_TRUE(on.end(ref(start()), "{}"));
}

TEST_F(talking, keeps_the_diagnostic_of_a_refusal) {
  const call_id refused = start();
  const std::string diagnostic(300, 'n');
  ASSERT_TRUE(on.fail(ref(refused), {errc::refused}, std::string_view{diagnostic}.substr(0, 192)));
  EXPECT_EQ(talk.try_finish()->reply.code(), errc::refused);
  EXPECT_EQ(talk.refusal(), diagnostic.substr(0, 192));
}

TEST_F(talking, waits_for_one_call_and_sets_the_ends_of_others_aside) {
  const call_id early = start();
  ASSERT_TRUE(on.take());
  std::thread service = serve_one(on, [&](const auto& asked) {
    EXPECT_EQ(asked.header.what, entry::invocation);
    ASSERT_TRUE(on.end(ref(early), R"({"r":"early"})"));
    ASSERT_TRUE(on.end(asked.header.own, R"({"r":"own"})"));
  });
  {
    const auto reply = talk.invoke("{}", 20s);
    ASSERT_TRUE(reply) << reply.error().name();
    EXPECT_EQ(reply->value(), R"({"r":"own"})");
  }
  service.join();
  const auto parked = talk.try_finish();
  ASSERT_TRUE(parked);
  EXPECT_EQ(parked->id, early);
  EXPECT_EQ(parked->reply->value(), R"({"r":"early"})");
}

TEST_F(talking, gives_up_by_itself_when_the_service_thread_does_not_say_so) {
  const auto late = talk.invoke("{}", 1ms);
  EXPECT_EQ(late.error(), (error{errc::timed_out, 0, 1'000'000}));
  const auto asked = on.take();
  ASSERT_TRUE(asked);
  ASSERT_TRUE(on.end(asked->header.own, "{}"));
  EXPECT_EQ(talk.try_finish().code(), errc::empty); // it came too late, and its place is free
  for (std::uint32_t i = 0; i < calls_max; ++i) start();
}

// A program that only ever makes calls that wait never asks for the ends of other calls.
TEST_F(talking, frees_the_rows_of_calls_that_it_gave_up_though_it_never_finishes_any) {
  std::vector<detail::call_ref> given_up;
  for (std::uint32_t round = 0; round < 3 * calls_max; ++round) {
    ASSERT_EQ(talk.invoke("{}", 1ms).code(), errc::timed_out) << round;
    const auto asked = on.take();
    ASSERT_TRUE(asked);
    given_up.push_back(asked->header.own);
    if (given_up.size() < calls_max) continue;
    // All places are taken by calls that have not ended.
    EXPECT_EQ(talk.invoke("{}", 1ms).code(), errc::too_many_calls);
    for (const detail::call_ref late : given_up) ASSERT_TRUE(on.end(late, "{}"));
    given_up.clear();
  }
}

TEST_F(talking, frees_the_rows_of_calls_that_it_cancelled_though_it_never_finishes_any) {
  for (int round = 0; round < 3; ++round) {
    std::vector<call_id> started;
    for (std::uint32_t i = 0; i < calls_max; ++i) {
      started.push_back(start());
      ASSERT_TRUE(on.take());
    }
    for (const call_id one : started) ASSERT_TRUE(on.end(ref(one), "{}"));
    for (const call_id one : started) talk.cancel(one); // their ends are here, and nobody took them
  }
  const call_id last = start();
  ASSERT_TRUE(on.end(ref(last), R"({"r":"last"})"));
  const auto ended = talk.try_finish();
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->id, last);
}

TEST_F(talking, frees_the_row_of_a_call_that_it_cancelled_when_its_end_was_parked) {
  const call_id first = start();
  const call_id second = start();
  while (on.take()) {
  }
  ASSERT_TRUE(on.end(ref(first), R"({"r":1})"));
  ASSERT_TRUE(on.end(ref(second), R"({"r":2})"));
  EXPECT_EQ(talk.invoke("{}", 1ms).code(), errc::timed_out); // parks both, and keeps its row
  talk.cancel(first);
  const call_id third = start();
  EXPECT_EQ(third.index, first.index);
  EXPECT_EQ(talk.start("{}", 1s, now).code(), errc::too_many_calls);
  const auto ended = talk.try_finish();
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->id, second);
}

TEST_F(talking, frees_the_rows_of_calls_that_it_gave_up_while_it_waits_for_sends) {
  for (std::uint32_t round = 0; round < 3 * calls_max; ++round) {
    ASSERT_EQ(talk.invoke("{}", 1ms).code(), errc::timed_out) << round;
    const auto asked = on.take();
    ASSERT_TRUE(asked);
    std::thread service = serve_one(on, [&](const auto& sent) {
      ASSERT_TRUE(on.end(asked->header.own, "{}"));
      ASSERT_TRUE(on.end(sent.header.own, ""));
    });
    EXPECT_TRUE(talk.send("{}", 20s));
    service.join();
  }
}

TEST_F(talking, wakes_a_call_that_waits_when_the_endpoint_closes) {
  std::thread closer = serve_one(on, [&](const auto&) { on.close(); });
  EXPECT_EQ(talk.invoke("{}", -1ns).code(), errc::closed);
  closer.join();
}

TEST_F(talking, waits_until_a_message_was_written_or_will_not_be) {
  for (const errc outcome : {errc::misuse /* sent */, errc::expired, errc::peer_lost, errc::not_an_object}) {
    std::thread service = serve_one(on, [&](const auto& sent) {
      EXPECT_EQ(sent.header.what, entry::message);
      const bool well = outcome == errc::misuse;
      ASSERT_TRUE(well ? on.end(sent.header.own, "") : on.fail(sent.header.own, {outcome}));
    });
    const auto sent = talk.send("{}", 20s);
    service.join();
    EXPECT_EQ(sent.has_value(), outcome == errc::misuse);
    if (!sent) {
      EXPECT_EQ(sent.code(), outcome);
    }
  }
}

// ---- replying

TEST_F(talking, replies_to_the_call_and_to_the_peer_it_came_from) {
  on.generations[1].store(5, std::memory_order_relaxed); // relaxed: one thread
  ASSERT_TRUE(on.arrive(call_from({1, 5}, {17, 3}), "{}"));
  const auto call = talk.try_receive(now);
  ASSERT_TRUE(call);
  EXPECT_TRUE(call->wants_reply());
  ASSERT_TRUE(talk.try_reply(*call, R"({"sum":42})", now));
  const auto reply = on.take();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->header.what, entry::reply);
  EXPECT_EQ(reply->header.call, (detail::call_ref{17, 3}));
  EXPECT_EQ(reply->header.peer, (detail::peer_ref{1, 5}));
  EXPECT_EQ(reply->text, R"({"sum":42})");
  ASSERT_TRUE(talk.try_refuse(*call, std::string(500, 'x'), now));
  const auto refusal = on.take();
  EXPECT_EQ(refusal->header.what, entry::refusal);
  EXPECT_EQ(refusal->text.size(), detail::diagnostic_bytes_max);
}

TEST_F(talking, waits_until_a_reply_was_written) {
  ASSERT_TRUE(on.arrive(call_from({}, {17, 3}), "{}"));
  const auto call = talk.try_receive();
  ASSERT_TRUE(call);
  std::thread service = serve_one(on, [&](const auto& reply) {
    EXPECT_EQ(reply.header.call, (detail::call_ref{17, 3}));
    ASSERT_TRUE(on.end(reply.header.own, ""));
  });
  EXPECT_TRUE(talk.reply(*call, "{}", 20s));
  service.join();
  EXPECT_EQ(talk.reply(*call, std::string(201, ' '), 1s).code(), errc::too_big);
}

TEST_F(talking, does_not_reply_to_who_is_gone_or_has_given_up_nor_to_what_is_no_call) {
  ASSERT_TRUE(on.arrive(call_from({1, 5}, {17, 3}), "{}"));
  ASSERT_TRUE(on.arrive(call_from({}, {18, 3}, now + 10ms), "{}"));
  {
    const auto lost = talk.try_receive(now);
    EXPECT_EQ(talk.try_reply(*lost, "{}", now).code(), errc::peer_lost);
    EXPECT_EQ(talk.try_refuse(*lost, "no", now).code(), errc::peer_lost);
    const auto late = talk.try_receive(now);
    EXPECT_TRUE(talk.try_reply(*late, "{}", now + 9ms));
    EXPECT_EQ(talk.try_reply(*late, "{}", now + 10ms).code(), errc::expired);
  }
  ASSERT_TRUE(on.arrive(message_from({}), "{}"));
  const auto plain = talk.try_receive(now);
  EXPECT_EQ(talk.try_reply(*plain, "{}", now).code(), errc::misuse);
  EXPECT_EQ(talk.reply(*plain, "{}", 1s).code(), errc::misuse);
  rowe::lane other;
  EXPECT_EQ(other.try_reply(*plain, "{}", now).code(), errc::misuse);
  EXPECT_EQ(other.try_refuse(*plain, "no", now).code(), errc::misuse);
}

TEST_F(talking, moves_its_views) {
  ASSERT_TRUE(on.arrive(message_from({}), R"({"n":1})"));
  ASSERT_TRUE(on.arrive(message_from({}), R"({"n":2})"));
  auto first = talk.try_receive(now);
  auto second = talk.try_receive(now);
  *first = std::move(*second);
  EXPECT_EQ(first->value(), R"({"n":2})");
  const message_view moved{std::move(*first)};
  EXPECT_EQ(moved.value(), R"({"n":2})");
}

// ---- callers

TEST(caller, calls_with_structs) {
  pair_harness on{detail::client_request<question, sum>("/add", {.depth = 2})};
  caller<question, sum> add{on.handle()};
  const auto id = add.start({38, 4}, 50ms, now);
  ASSERT_TRUE(id);
  const auto asked = on.take();
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->header.what, entry::invocation);
  EXPECT_EQ(asked->header.expires_ns, rt::nanoseconds_of(now + 50ms));
  question sent;
  ASSERT_EQ(asked->text.size(), sizeof sent);
  std::memcpy(&sent, asked->text.data(), sizeof sent);
  EXPECT_EQ(sent.a + sent.b, 42);
  EXPECT_EQ(add.try_finish().code(), errc::empty);
  ASSERT_TRUE(on.end_with(asked->header.own, sum{42}));
  const auto answer = add.try_finish();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->id, *id);
  EXPECT_EQ(answer->reply->value, 42);
}

TEST(caller, tells_how_a_call_failed) {
  pair_harness on{detail::client_request<question, sum>("/add", {.depth = 2})};
  caller<question, sum> add{on.handle()};
  for (const errc why : {errc::timed_out, errc::peer_lost, errc::no_service, errc::missing_member,
                         errc::duplicate_member, errc::wrong_type, errc::out_of_range, errc::too_long}) {
    ASSERT_TRUE(add.start({}, 1s, now));
    ASSERT_TRUE(on.fail(on.take()->header.own, {why, 1, 2}));
    EXPECT_EQ(add.try_finish()->reply.error(), (error{why, 1, 2}));
  }
  ASSERT_TRUE(add.start({}, 1s, now));
  ASSERT_TRUE(on.fail(on.take()->header.own, {errc::refused}, "b must not be 0"));
  EXPECT_EQ(add.try_finish()->reply.code(), errc::refused);
  EXPECT_EQ(add.refusal(), "b must not be 0");
}

TEST(caller, has_depth_calls_in_flight_and_drops_those_it_cancelled) {
  pair_harness on{detail::client_request<question, sum>("/add", {.depth = 2})};
  caller<question, sum> add{on.handle()};
  const auto first = add.start({}, 1s, now);
  ASSERT_TRUE(first && add.start({}, 1s, now));
  EXPECT_EQ(add.start({}, 1s, now).code(), errc::too_many_calls);
  add.cancel(*first);
  ASSERT_TRUE(on.end_with(on.take()->header.own, sum{1}));
  EXPECT_EQ(add.try_finish().code(), errc::empty);
  EXPECT_TRUE(add.start({}, 1s, now));
}

TEST(caller, waits_for_its_reply) {
  pair_harness on{detail::client_request<json_text, json_text>("/add", {.depth = 2})};
  caller<json_text, json_text> add{on.handle()};
  std::thread service = serve_one(on, [&](const auto& asked) {
    EXPECT_EQ(asked.text, R"({"a":38,"b":4})");
    ASSERT_TRUE(on.end(asked.header.own, R"({"sum":42})"));
  });
  {
    const auto reply = add.call(rowe::message("a", 38, "b", 4), 20s);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->value(), R"({"sum":42})");
  }
  service.join();
  EXPECT_EQ(add.call("{}", 1ms).code(), errc::timed_out);
  on.close();
  EXPECT_EQ(add.call("{}", -1ns).code(), errc::closed);
  EXPECT_EQ(add.try_finish().code(), errc::closed);
}

} // namespace
} // namespace lane_test
