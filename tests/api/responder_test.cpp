// SPDX-License-Identifier: Apache-2.0
// responder and request, and typed subscribers: what they do with their slots, whatever the service thread
// does.
#include <rowe/responder.hpp>
#include <rowe/subscriber.hpp>

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "handle_harness.hpp"

namespace responder_test {
namespace {

using namespace handle_harness;
using detail::entry;

constexpr std::uint32_t depth = 2;

class answering : public ::testing::Test {
 protected:
  pair_harness on{detail::serve_request<question, sum>("/add", {.depth = depth})};
  responder<question, sum> add{on.handle()};

  bool ask(question q, std::uint32_t number = 1, time_point expires = rt::never, detail::peer_ref from = {}) {
    return on.arrive_value(call_from(from, {number, 1}, expires), q);
  }
};

TEST_F(answering, hands_out_requests_and_answers_them) {
  on.generations[3].store(9, std::memory_order_relaxed); // relaxed: one thread
  ASSERT_TRUE(ask({38, 4}, 17, now + 50ms, {3, 9}));
  auto request = add.try_next(now);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->from(), (connection{3, 9}));
  EXPECT_EQ(request->arrived(), now);
  EXPECT_EQ(request->expires(), now + 50ms);
  ASSERT_TRUE(add.reply(*request, {request->value().a + request->value().b}, now));
  const auto reply = on.take();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->header.what, entry::reply);
  EXPECT_EQ(reply->header.call, (detail::call_ref{17, 1}));
  EXPECT_EQ(reply->header.peer, (detail::peer_ref{3, 9}));
  sum answer;
  ASSERT_EQ(reply->text.size(), sizeof answer);
  std::memcpy(&answer, reply->text.data(), sizeof answer);
  EXPECT_EQ(answer.value, 42);
}

TEST_F(answering, says_empty_and_closed) {
  EXPECT_EQ(add.try_next(now).code(), errc::empty);
  EXPECT_EQ(add.next(1ms).code(), errc::timed_out);
  on.close();
  EXPECT_EQ(add.try_next().code(), errc::closed);
  EXPECT_EQ(add.next(-1ns).code(), errc::closed);
}

TEST_F(answering, passes_over_calls_that_have_given_up) {
  ASSERT_TRUE(ask({1, 0}, 1, now));
  ASSERT_TRUE(ask({2, 0}, 2, now + 1ns));
  const auto request = add.try_next(now);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->value().a, 2);
  EXPECT_EQ(on->expired_here.get(), 1U);
}

TEST_F(answering, reserves_the_place_of_the_answer_before_it_hands_out_a_request) {
  std::vector<request<question>> held;
  for (std::uint32_t i = 0; i < 2 * depth; ++i) {
    ASSERT_TRUE(ask({1.0 * i, 0}, i));
    auto one = add.try_next(now);
    ASSERT_TRUE(one) << i;
    held.push_back(std::move(*one));
  }
  ASSERT_TRUE(ask({9, 0}, 9));
  const auto refused = add.try_next(now);
  EXPECT_EQ(refused.error(), (error{errc::full, 0, 2 * depth}));
  for (auto& one : held) EXPECT_TRUE(add.reply(one, {one.value().a}, now)); // none fails for want of room
  EXPECT_EQ(add.try_next(now).code(), errc::full); // until the service thread took one
  ASSERT_TRUE(on.take());
  EXPECT_EQ(add.try_next(now)->value().a, 9);
}

TEST_F(answering, keeps_the_place_it_reserved_in_vain) {
  for (int i = 0; i < 100; ++i) EXPECT_EQ(add.try_next(now).code(), errc::empty);
  ASSERT_TRUE(ask({1, 2}));
  EXPECT_TRUE(add.try_next(now));
}

TEST_F(answering, refuses_with_a_diagnostic) {
  ASSERT_TRUE(ask({1, 0}, 17));
  auto request = add.try_next(now);
  ASSERT_TRUE(add.refuse(*request, "b must not be 0", now));
  const auto refusal = on.take();
  EXPECT_EQ(refusal->header.what, entry::refusal);
  EXPECT_EQ(refusal->header.call, (detail::call_ref{17, 1}));
  EXPECT_EQ(refusal->text, "b must not be 0");
}

TEST_F(answering, refuses_for_a_request_that_is_destroyed_unanswered) {
  ASSERT_TRUE(ask({1, 0}, 17));
  { const auto dropped = add.try_next(now); }
  const auto refusal = on.take();
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->header.what, entry::refusal);
  EXPECT_EQ(refusal->header.call, (detail::call_ref{17, 1}));
  EXPECT_EQ(refusal->text, "the service did not answer");
  EXPECT_FALSE(on.take());
}

TEST_F(answering, tells_when_there_is_nobody_to_answer_and_keeps_the_place) {
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(ask({1, 0}, 1, rt::never, {2, 5})); // whose generation is 0 by now
    auto lost = add.try_next(now);
    EXPECT_EQ(add.reply(*lost, {1}, now).code(), errc::peer_lost);
    EXPECT_EQ(add.reply(*lost, {1}, now).code(), errc::misuse); // it is over
    ASSERT_TRUE(ask({1, 0}, 2, now + 10ms));
    auto late = add.try_next(now);
    EXPECT_EQ(add.reply(*late, {1}, now + 10ms).code(), errc::expired);
  }
  EXPECT_FALSE(on.take());
  ASSERT_TRUE(ask({1, 0}));
  auto last = add.try_next(now);
  on.close();
  EXPECT_EQ(add.reply(*last, {1}).code(), errc::closed);
}

TEST_F(answering, says_misuse_of_requests_that_are_not_its_own) {
  pair_harness elsewhere{detail::serve_request<question, sum>("/mul", {.depth = depth})};
  responder<question, sum> mul{elsewhere.handle()};
  responder<question, sum> nothing;
  ASSERT_TRUE(ask({1, 0}));
  auto request = add.try_next(now);
  EXPECT_EQ(mul.reply(*request, {1}, now).code(), errc::misuse);
  EXPECT_EQ(nothing.refuse(*request, "no").code(), errc::misuse);
  EXPECT_TRUE(add.reply(*request, {1}));
}

TEST_F(answering, moves_its_requests) {
  ASSERT_TRUE(ask({1, 0}, 1));
  ASSERT_TRUE(ask({2, 0}, 2));
  auto first = add.try_next(now);
  auto second = add.try_next(now);
  *first = std::move(*second); // the one that was held before is refused when `second` goes
  EXPECT_EQ(first->value().a, 2);
  request<question> moved{std::move(*first)};
  ASSERT_TRUE(add.reply(moved, {2}, now));
  EXPECT_EQ(on.take()->header.call, (detail::call_ref{2, 1}));
  second = errc::empty;
  EXPECT_EQ(on.take()->header.call, (detail::call_ref{1, 1}));
}

TEST(text_responder, keeps_the_text_of_a_request_until_it_is_answered) {
  pair_harness on{detail::serve_request<json_text, json_text>("/echo", {.depth = 1, .text_bytes_max = 300})};
  responder<json_text, json_text> echo{on.handle()};
  ASSERT_TRUE(on.arrive(call_from({}, {17, 1}), R"({"a":1})"));
  auto request = echo.try_next(now);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->value(), R"({"a":1})");
  EXPECT_FALSE(on.arrive(call_from({}, {18, 1}), "{}"));
  EXPECT_EQ(echo.reply(*request, std::string(301, ' '), now).error(), (error{errc::too_big, 301, 300}));
  ASSERT_TRUE(echo.reply(*request, request->value(), now)); // after too_big it is still open
  EXPECT_EQ(on.take()->text, R"({"a":1})");
  EXPECT_TRUE(on.arrive(call_from({}, {18, 1}), "{}"));
  auto second = echo.next(0ns);
  ASSERT_TRUE(second);
  ASSERT_TRUE(echo.refuse(*second, "no"));
  EXPECT_EQ(on.take()->text, "no");
}

TEST(text_responder, gives_back_the_text_of_a_request_that_is_dropped) {
  pair_harness on{detail::serve_request<json_text, json_text>("/echo", {.depth = 1})};
  responder<json_text, json_text> echo{on.handle()};
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(on.arrive(call_from({}, {17, 1}), "{}")) << i;
    { const auto dropped = echo.try_next(now); }
    ASSERT_EQ(on.take()->header.what, entry::refusal);
  }
}

// ---- subscribers of structs

TEST(typed_subscriber, takes_every_value_in_order) {
  pair_harness on{detail::subscribe_request<question>("/q", {.depth = 2})};
  subscriber<question> seen{on.handle()};
  EXPECT_EQ(seen.try_take().code(), errc::empty);
  ASSERT_TRUE(on.arrive_value(message_from({3, 9}), question{1, 2}));
  ASSERT_TRUE(on.arrive_value(message_from({}), question{3, 4}));
  {
    const auto first = seen.try_take();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->value().b, 2);
    EXPECT_EQ(first->from(), (connection{3, 9}));
    EXPECT_EQ(first->arrived(), now);
    EXPECT_EQ(seen.take(0ns)->value().a, 3);
  }
  EXPECT_EQ(seen.take(1ms).code(), errc::timed_out);
  ASSERT_TRUE(on.arrive_value(message_from({}), question{5, 6}));
  ASSERT_TRUE(on.arrive_value(message_from({}), question{7, 8}));
  EXPECT_EQ(seen.latest()->value().a, 7);
  ASSERT_TRUE(on.arrive_value(message_from({}), question{5, 6})); // both slots were released
  ASSERT_TRUE(on.arrive_value(message_from({}), question{7, 8}));
  on.close();
  EXPECT_TRUE(seen.try_take() && seen.try_take());
  EXPECT_EQ(seen.try_take().code(), errc::closed);
}

TEST(typed_subscriber, takes_the_newest_value_once) {
  pair_harness on{detail::subscribe_request<question>("/q", {.keep = keep::newest})};
  subscriber<question> seen{on.handle()};
  const auto write = [&](question q) {
    auto& window = *on->service.in.newest;
    const std::uint32_t slot = window.begin_write();
    *on->service.in.memory.header(slot) = message_from({});
    std::memcpy(on->service.in.memory.value(slot), &q, sizeof q);
    window.end_write(slot);
  };
  EXPECT_EQ(seen.try_take().code(), errc::empty);
  for (int i = 0; i < 10; ++i) write({1.0 * i, 0});
  EXPECT_EQ(seen.latest()->value().a, 9);
  EXPECT_EQ(seen.latest().code(), errc::empty);
  write({10, 0});
  EXPECT_EQ(seen.take(0ns)->value().a, 10);
  on.close();
  EXPECT_EQ(seen.try_take().code(), errc::closed);
}

} // namespace
} // namespace responder_test
