// SPDX-License-Identifier: Apache-2.0
// Services with types, and topics read into structs, between whole endpoints.
#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "endpoints.hpp"

struct two_numbers {
  double a, b;
};
struct one_number {
  double sum;
};
template <>
inline constexpr auto rowe::schema<two_numbers> = rowe::fields<&two_numbers::a, &two_numbers::b>{};
template <>
inline constexpr auto rowe::schema<one_number> = rowe::fields<&one_number::sum>{};

namespace services_test {
namespace {

using namespace endpoints;
using rowe::endpoint;
using rowe::errc;
using rowe::json_text;
using rowe::message;

// Answers requests: `answer(responder, request)` for each.
template <class Responder, class Answer>
auto serving_thread(Responder& with, Answer answer) {
  return beside{[&with, answer] {
    if (auto asked = with.next(5ms)) answer(with, *asked);
  }};
}

constexpr auto add = [](auto& with, auto& asked) {
  (void)with.reply(asked, {asked.value().a + asked.value().b});
};

TEST(services, are_called_with_structs_within_a_process_and_across) {
  auto robot = endpoint::listen(0, quick()).value();
  auto provides = robot.serve<two_numbers, one_number>("/add").value();
  const auto serving = serving_thread(provides, add);
  auto inside = robot.client<two_numbers, one_number>("add").value(); // the same name
  const auto near = inside.call({38, 4}, timeout);
  ASSERT_TRUE(near) << near.error().name();
  EXPECT_EQ(near->sum, 42);
  auto viewer = connected(robot);
  auto outside = viewer.client<two_numbers, one_number>("/add").value();
  for (int i = 0; i < 100; ++i) {
    const auto far = outside.call({1.0 * i, 0.5}, timeout);
    ASSERT_TRUE(far) << i << " " << far.error().name();
    EXPECT_EQ(far->sum, i + 0.5);
  }
}

TEST(services, are_called_with_text_and_by_lanes_too) {
  auto robot = endpoint::listen(0, quick()).value();
  auto provides = robot.serve<two_numbers, one_number>("add-two-numbers").value();
  const auto serving = serving_thread(provides, add);
  auto viewer = connected(robot);
  auto texts = viewer.client<json_text, json_text>("/add-two-numbers").value();
  {
    const auto reply = texts.call(R"({"a":38,"b":4})", timeout);
    ASSERT_TRUE(reply) << reply.error().name();
    EXPECT_EQ(reply->value(), R"({"sum":42})");
  }
  EXPECT_EQ(texts.call("[1]", timeout).code(), errc::not_an_object);
  EXPECT_EQ(texts.call("{", timeout).code(), errc::malformed);
  auto lane = viewer.open_lane().value();
  const auto reply = lane.invoke(message("service", "add-two-numbers", "a", 38, "b", 4), timeout);
  ASSERT_TRUE(reply) << reply.error().name();
  EXPECT_TRUE(says(reply->value(), R"({"sum":42})")) << reply->value();
}

TEST(services, refuse_with_a_diagnostic) {
  auto robot = endpoint::listen(0, quick()).value();
  auto provides = robot.serve<two_numbers, one_number>("/divide").value();
  const auto serving =
      serving_thread(provides, [](auto& with, auto& asked) { (void)with.refuse(asked, "b must not be 0"); });
  auto viewer = connected(robot);
  for (endpoint* of : {&robot, &viewer}) {
    auto divide = of->client<two_numbers, one_number>("/divide").value();
    EXPECT_EQ(divide.call({1, 0}, timeout).code(), errc::refused);
    EXPECT_EQ(divide.refusal(), "b must not be 0");
  }
}

TEST(services, refuse_requests_that_are_not_what_the_schema_says) {
  auto robot = endpoint::listen(0, quick()).value();
  const auto provides = robot.serve<two_numbers, one_number>("/add").value();
  auto viewer = connected(robot);
  auto texts = viewer.client<json_text, json_text>("/add").value();
  for (const char* wrong : {R"({"a":1})", R"({"a":1,"b":"two"})", R"({"a":1,"a":2,"b":3})"}) {
    EXPECT_EQ(texts.call(wrong, timeout).code(), errc::refused) << wrong;
    EXPECT_FALSE(texts.refusal().empty());
  }
}

TEST(services, that_nobody_provides_are_told_apart_from_time_outs) {
  auto robot = endpoint::listen(0, quick()).value();
  auto missing = robot.client<two_numbers, one_number>("/missing").value();
  EXPECT_EQ(missing.call({}, timeout).code(), errc::no_service);
  const auto provides = robot.serve<two_numbers, one_number>("/silent").value();
  auto silent = robot.client<two_numbers, one_number>("/silent").value();
  EXPECT_EQ(silent.call({}, 10ms).error(), (rowe::error{errc::timed_out, 0, 10'000'000}));
}

TEST(services, are_answered_without_waiting_by_a_loop) {
  auto robot = endpoint::listen(0, quick()).value();
  auto provides = robot.serve<two_numbers, one_number>("/add", {.depth = 4}).value();
  auto viewer = connected(robot);
  auto calls = viewer.client<two_numbers, one_number>("/add", {.depth = 4}).value();
  int answered = 0;
  ASSERT_TRUE(eventually([&] {
    const auto now = rowe::rt::monotonic_clock::now();
    (void)calls.start({1, 1}, timeout, now); // too_many_calls at times
    if (auto asked = provides.try_next(now)) (void)provides.reply(*asked, {asked->value().a + 1}, now);
    while (auto ended = calls.try_finish()) {
      EXPECT_TRUE(ended->reply) << ended->reply.error().name();
      answered += ended->reply && ended->reply->sum == 2;
    }
    return answered >= 500;
  }));
}

TEST(services, end_with_their_responder) {
  auto robot = endpoint::listen(0, quick()).value();
  auto calls = robot.client<two_numbers, one_number>("/add").value();
  {
    auto provides = robot.serve<two_numbers, one_number>("/add").value();
    ASSERT_TRUE(calls.start({}, timeout, rowe::rt::monotonic_clock::now()));
    ASSERT_TRUE(provides.next(timeout)); // dropped unanswered
  }
  std::optional<rowe::result<rowe::caller<two_numbers, one_number>::answer>> ended;
  ASSERT_TRUE(eventually([&] { return ended.emplace(calls.try_finish()).has_value(); }));
  EXPECT_FALSE((*ended)->reply);
  EXPECT_EQ(calls.call({}, timeout).code(), errc::no_service);
}

TEST(services, are_refused_where_a_name_or_an_option_is_wrong) {
  auto robot = endpoint::listen(0, quick()).value();
  const auto serve = [&](std::string_view name, const rowe::service_options& options = {}) {
    return robot.serve<two_numbers, one_number>(name, options).code();
  };
  EXPECT_EQ(serve(""), errc::bad_argument);
  EXPECT_EQ(serve("/"), errc::bad_argument);
  EXPECT_EQ(serve(std::string(128, 'x')), errc::bad_argument); // 129 with the slash
  EXPECT_EQ(serve("/rowe/stats"), errc::reserved_topic);
  EXPECT_EQ(serve("rowe/stats"), errc::reserved_topic);
  EXPECT_EQ(serve("/a", {.depth = 4097}), errc::bad_argument);
  EXPECT_EQ(serve("/a", {.type =
                             std::string_view{
                                 "a type name that is longer than any name may be, because its limit is the "
                                 "same as that of topics, and that is one hundred and twenty-eight bytes"}}),
            errc::bad_argument);
  EXPECT_EQ((robot.client<two_numbers, one_number>("/a", {.depth = 4097}).code()), errc::bad_argument);
  EXPECT_TRUE((robot.client<json_text, json_text>("/rowe/stats")));
}

TEST(typed_subscribers, read_what_peers_and_their_own_process_publish) {
  auto options = quick();
  options.relay = true;
  auto robot = endpoint::listen(0, options).value();
  auto says = robot.advertise<two_numbers>("/pair").value();
  auto here = robot.subscribe<two_numbers>("/pair").value();
  auto viewer = connected(robot);
  auto there = viewer.subscribe<two_numbers>("/pair").value();
  auto newest = viewer.subscribe<two_numbers>("/pair", {.keep = rowe::keep::newest}).value();
  bool far = false, latest = false;
  ASSERT_TRUE(eventually([&] {
    (void)says.publish({1.5, -2});
    if (const auto seen = there.try_take()) {
      EXPECT_EQ(seen->value().a, 1.5);
      EXPECT_TRUE(seen->from());
      far = true;
    }
    if (const auto seen = newest.latest()) latest = seen->value().b == -2;
    return far && latest;
  }));
  const auto near = here.take(timeout);
  ASSERT_TRUE(near);
  EXPECT_EQ(near->value().b, -2);
  EXPECT_FALSE(near->from());
}

TEST(typed_subscribers, drop_and_count_what_is_not_what_their_schema_says) {
  auto robot = endpoint::listen(0, quick()).value();
  auto says = robot.advertise<json_text>("/pair").value();
  auto seen = robot.subscribe<two_numbers>("/pair").value();
  ASSERT_TRUE(says.publish(R"({"a":1})"));
  ASSERT_TRUE(says.publish(R"({"a":1,"b":2})"));
  const auto first = seen.take(timeout);
  ASSERT_TRUE(first) << first.error().name();
  EXPECT_EQ(first->value().b, 2);
  EXPECT_EQ(count_of(robot, "undecodable"), 1U);
}

} // namespace
} // namespace services_test
