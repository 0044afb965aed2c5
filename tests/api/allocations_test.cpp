// SPDX-License-Identifier: Apache-2.0
// In steady state nothing in the whole process allocates for a message or a call: neither the handles,
// submission queue, core, transport and libwebsockets of one endpoint, nor those of the other. The tripwire's
// malloc counts, in all threads.
#include <string>

#include <rowe/rt/tripwire.hpp>

#include "endpoints.hpp"

struct pose {
  double x, y, heading;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y, &pose::heading>{};

struct addends {
  double a, b;
};
struct total {
  double sum;
};
template <>
inline constexpr auto rowe::schema<addends> = rowe::fields<&addends::a, &addends::b>{};
template <>
inline constexpr auto rowe::schema<total> = rowe::fields<&total::sum>{};

namespace {

using namespace endpoints;

constexpr int warm_up = 500;
constexpr int exchanges = 1500; // each is several messages, and waits for several cycles

rowe::endpoint_options options_of_both() {
  rowe::endpoint_options options;
  options.relay = true;
  options.poll_period = 50us;
  options.limits.handle_bytes = 2 * 1024 * 1024;
  return options;
}

struct two_ends {
  rowe::endpoint robot = rowe::endpoint::listen(0, options_of_both()).value();
  rowe::endpoint desk = another();

  rowe::endpoint another() const { return connected(robot, options_of_both()); }
};

// `exchange` says whether it went well.
template <class Exchange>
void expect_no_allocation(Exchange exchange) {
  for (int i = 0; i < warm_up; ++i) ASSERT_TRUE(exchange(i)) << i;
  const std::uint64_t before = rowe::rt::tripwire::process_allocations();
  int went = 0;
  while (went < exchanges && exchange(went)) ++went;
  const std::uint64_t after = rowe::rt::tripwire::process_allocations();
  EXPECT_EQ(went, exchanges);
  EXPECT_EQ(after - before, 0U);
}

// Until a service that another endpoint offers is known where it is called.
template <class Caller>
bool answered(Caller& caller) {
  return eventually([&] { return caller.call({1, 2}, timeout).has_value(); });
}

auto adding(rowe::endpoint& at, std::string_view name) {
  return beside{[answers = at.serve<addends, total>(name).value()]() mutable {
    if (auto asked = answers.next(1ms)) (void)answers.reply(*asked, {asked->value().a + asked->value().b});
  }};
}

TEST(allocations, are_none_for_a_message_from_publisher_to_subscriber_over_sockets) {
  two_ends e;
  auto odom = e.robot.advertise<pose>("/odom").value();
  auto seen = e.desk.subscribe<rowe::json_text>("/odom").value();
  auto command = e.desk.advertise<rowe::json_text>("/cmd").value();
  auto commanded = e.robot.subscribe<rowe::json_text>("/cmd").value();
  ASSERT_TRUE(eventually([&] { return odom.wanted() && command.wanted(); }));
  expect_no_allocation([&](int i) {
    return odom.publish({0.001 * i, 1e-9 * i, 3.0 / (i + 1)}) && seen.take(timeout) &&
           command.publish(R"({"linear":0.5})") && commanded.take(timeout);
  });
}

TEST(allocations, are_none_for_a_call_with_structs_from_either_end) {
  two_ends e;
  const auto by_robot = adding(e.robot, "/robot/add");
  const auto by_desk = adding(e.desk, "/desk/add");
  auto from_desk = e.desk.client<addends, total>("/robot/add").value();
  auto from_robot = e.robot.client<addends, total>("/desk/add").value();
  ASSERT_TRUE(answered(from_desk));
  ASSERT_TRUE(answered(from_robot));
  expect_no_allocation([&](int i) {
    const auto one = from_desk.call({1.0 * i, 1}, timeout);
    const auto other = from_robot.call({1.0 * i, 2}, timeout);
    return one && one->sum == i + 1 && other && other->sum == i + 2;
  });
}

TEST(allocations, are_none_for_a_call_that_a_hub_passes_on) {
  two_ends e;
  auto provider = e.another();
  const auto adds = adding(provider, "/passed/add");
  auto asks = e.desk.client<addends, total>("/passed/add").value();
  ASSERT_TRUE(answered(asks));
  expect_no_allocation([&](int i) {
    const auto sum = asks.call({1.0 * i, 1}, timeout);
    return sum && sum->sum == i + 1;
  });
}

TEST(allocations, are_none_for_a_call_that_is_refused_or_runs_out_of_time) {
  two_ends e;
  const auto refuses = beside{[answers = e.robot.serve<addends, total>("/never").value()]() mutable {
    if (auto asked = answers.next(1ms)) (void)answers.refuse(*asked, "never");
  }};
  auto silent = e.robot.serve<addends, total>("/silent").value();
  auto asks = e.desk.client<addends, total>("/never").value();
  auto waits = e.desk.client<addends, total>("/silent").value();
  expect_no_allocation([&](int) {
    const bool refused = asks.call({1, 2}, timeout).code() == rowe::errc::refused;
    const bool timed_out = waits.call({1, 2}, 100us).code() == rowe::errc::timed_out;
    while (silent.try_next()) continue; // dropped
    return refused && timed_out;
  });
}

TEST(allocations, are_none_for_what_lanes_send_receive_and_invoke) {
  two_ends e;
  const auto echoes = beside{[talk = e.robot.open_lane().value()]() mutable {
    const auto came = talk.receive(1ms);
    if (!came) return;
    came->wants_reply() ? (void)talk.reply(*came, rowe::message{"sum", 3}, timeout)
                        : (void)talk.try_send(came->value(), timeout);
  }};
  auto talk = e.desk.open_lane().value();
  expect_no_allocation([&](int i) {
    if (!talk.send(rowe::message{"n", i, "text", "a text"}, timeout)) return false;
    if (!talk.receive(timeout)) return false;
    return talk.invoke(rowe::message{"service", "add", "a", 1, "b", 2}, timeout).has_value();
  });
}

TEST(allocations, are_none_for_what_ordinary_threads_send_receive_and_invoke) {
  two_ends e;
  const auto echoes = beside{[&] {
    const auto came = e.robot.receive(1ms);
    if (!came) return;
    came->wants_reply() ? (void)e.robot.reply(*came, rowe::message{"sum", 3})
                        : (void)e.robot.try_send(came->value(), timeout);
  }};
  expect_no_allocation([&](int i) {
    if (!e.desk.send(rowe::message{"n", i, "text", "a text"}, timeout)) return false;
    if (!e.desk.receive(timeout)) return false;
    return e.desk.invoke(rowe::message{"service", "add", "a", 1, "b", 2}, timeout).has_value();
  });
}

TEST(allocations, are_none_for_values_that_a_subscriber_has_decoded) {
  two_ends e;
  for (const rowe::keep kept : {rowe::keep::all, rowe::keep::newest}) {
    auto odom = e.desk.advertise<pose>("/odom").value();
    auto seen = e.robot.subscribe<pose>("/odom", {.keep = kept}).value();
    ASSERT_TRUE(eventually([&] { return odom.wanted(); }));
    expect_no_allocation([&](int i) {
      if (!odom.publish({0.001 * i, 1e-9 * i, 3.0})) return false;
      const auto taken = seen.take(timeout);
      return taken && taken->value().x == 0.001 * i;
    });
  }
}

} // namespace
