// SPDX-License-Identifier: Apache-2.0
// Driving: which commands reach a loop and for how long, and who drives.
#include "access_fixture.hpp"
#include "core_fixtures.hpp"

#include <rowe/subscriber.hpp>

#include <deque>
#include <limits>
#include <optional>

namespace core_control_test {
namespace {

using namespace access_fixture;

struct twist {
  double linear = 0, angular = 0;
};

} // namespace
} // namespace core_control_test

template <>
inline constexpr auto rowe::schema<core_control_test::twist> =
    rowe::fields<&core_control_test::twist::linear, &core_control_test::twist::angular>{}.type("test/Twist");

namespace core_control_test {
namespace {

rowe::endpoint_options unguarded() {
  rowe::endpoint_options options = unguarded_hub_options();
  options.limits.handles_max = 12;
  return options;
}

std::string command(double speed, const std::string& tick = {}, const std::string& topic = "/cmd_vel") {
  const std::string of_tick = tick.empty() ? "" : R"(,"tick":)" + tick;
  return R"({"op":"publish","topic":")" + topic + R"(","msg":{"linear":)" + std::to_string(speed) +
         R"(,"angular":0})" + of_tick + "}";
}

struct driving : core_test {
  explicit driving(const rowe::endpoint_options& options = unguarded()) : core_test{options} {
    loop = on.open<rowe::subscriber<twist>>(asked("/cmd_vel", 300ms));
  }

  static rowe::detail::pair_request asked(std::string_view topic, rowe::duration lease) {
    return rowe::detail::subscribe_request<twist>(topic, {.lease = lease});
  }
  // What the loop drives now; nothing: it stands still.
  std::optional<double> drives() { return drives(*loop); }
  std::optional<double> drives(rowe::subscriber<twist>& by) {
    const auto now_in_force = by.latest_within(on.now);
    if (!now_in_force) {
      EXPECT_EQ(now_in_force.code(), rowe::errc::empty);
      return std::nullopt;
    }
    return now_in_force->value().linear;
  }
  // The answer to a request for control.
  std::string control(peer& by, const std::string& args) {
    (void)by.hear();
    by.tell(R"({"op":"call_service","id":"c","service":"/rowe/control","args":{)" + args + "}}", 2);
    for (const std::string& text : by.hear())
      if (member(text, "id") == R"("c")") return member(text, "values");
    return "no answer";
  }
  std::string take(peer& by, const std::string& action = "take", const std::string& more = "") {
    const std::string tick = member(control(by, R"("topic":"/cmd_vel")"), "tick");
    return control(by, R"("topic":"/cmd_vel","action":")" + action + R"(","tick":)" + tick + more);
  }
  std::string refused(const std::string& answer) { return member(answer, "refused"); }
  std::string tick(peer& by) { return member(control(by, ""), "tick"); }

  std::optional<rowe::subscriber<twist>> loop;
};

TEST_F(driving, a_command_with_a_tick_is_in_force_until_the_lease_after_the_tick_is_over) {
  peer page{on};
  const std::string then = tick(page);
  on.cycle(100ms);
  page.tell(command(0.5, then));
  EXPECT_EQ(drives(), 0.5);
  on.cycle(100ms);
  EXPECT_EQ(drives(), 0.5); // the same one, as long as it is in force
  on.cycle(96ms);
  EXPECT_EQ(drives(), 0.5);
  on.cycle(5ms);
  EXPECT_EQ(drives(), std::nullopt);
}

TEST_F(driving, a_command_whose_lease_is_over_when_it_comes_is_dropped_and_counted) {
  peer page{on};
  const std::string then = tick(page);
  on.cycle(301ms);
  page.tell(command(0.5, then), 2);
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::commands_stale), 1U);
  const std::string told = page.hear_as_one();
  EXPECT_TRUE(has(told, "the lease is 300 ms")) << told;
  EXPECT_TRUE(has(told, R"("level":"warning")"));
}

TEST_F(driving, a_commands_own_time_to_live_counts_from_when_it_was_sent_too) {
  peer page{on};
  const auto short_lived = [](const std::string& then) {
    return R"({"op":"publish","ttl_ms":100,)" + command(0.5, then).substr(16);
  };
  const std::string then = tick(page);
  on.cycle(60ms);
  page.tell(short_lived(then));
  EXPECT_EQ(drives(), 0.5);
  on.cycle(45ms);
  EXPECT_EQ(drives(), std::nullopt);
  const auto before = on.count(counter::expired);
  page.tell(short_lived(then));
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::expired), before + 1);
}

TEST_F(driving, a_tick_of_the_future_proves_nothing) {
  peer page{on};
  const std::string then = std::to_string(std::stoll(tick(page)) + 1'000'000);
  page.tell(command(0.5, then), 2);
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::commands_unproven), 1U);
  EXPECT_TRUE(has(page.hear_as_one(), "the robot has not issued its tick"));
}

TEST_F(driving, without_ticks_nothing_drives_until_a_ping_behind_the_first_command_is_answered) {
  peer old_client{on};
  old_client.answers_pings = false;
  for (int i = 0; i < 10; ++i) { // as an offline client does that connects again
    old_client.tell(command(0.5));
    (void)old_client.hear();
  }
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::commands_unproven), 10U);
  EXPECT_GT(old_client.pings, 0);
  old_client.answers_pings = true;
  for (int i = 0; i < 10 && !drives(); ++i) {
    old_client.tell(command(0.5));
    (void)old_client.hear();
    on.cycle(50ms);
  }
  EXPECT_EQ(on.count(counter::slow_peers), 0U);
  // The ping that it left unanswered is not answered any more: a later one is.
  for (int i = 0; i < 20 && !drives(); ++i) {
    old_client.tell(command(0.5));
    (void)old_client.hear();
    on.cycle(50ms);
  }
  EXPECT_EQ(drives(), 0.5);
}

TEST_F(driving, without_ticks_a_command_is_as_old_as_the_newest_ping_answered_before_it) {
  peer old_client{on};
  for (int i = 0; i < 5; ++i) {
    old_client.tell(command(0.5));
    (void)old_client.hear();
  }
  ASSERT_EQ(drives(), 0.5);
  old_client.answers_pings = false; // the link stalls: what comes now may have been sent long ago
  for (int i = 0; i < 20; ++i) {
    old_client.tell(command(0.7));
    (void)old_client.hear();
    on.cycle(50ms);
  }
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_GT(on.count(counter::commands_stale), 0U);
}

TEST_F(driving, one_drives_and_others_are_told_who) {
  peer anna{on};
  peer bert{on};
  const std::string taken = take(anna, "take", R"(,"name":"phone-1")");
  EXPECT_EQ(refused(taken), "null");
  EXPECT_EQ(member(taken, "yours"), "true");
  EXPECT_EQ(member(taken, "driver"), R"("phone-1")");
  EXPECT_EQ(member(taken, "lease_ms"), "300");
  EXPECT_EQ(member(taken, "hold_ms"), "2000");
  const std::string other = take(bert);
  EXPECT_EQ(refused(other), R"("driven")");
  EXPECT_EQ(member(other, "driver"), R"("phone-1")");
  EXPECT_EQ(member(other, "yours"), "false");
  (void)bert.hear();
  bert.tell(command(0.9, member(other, "tick")), 2);
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_TRUE(has(bert.hear_as_one(), "phone-1 drives"));
  EXPECT_EQ(on.count(counter::commands_refused), 1U);
  EXPECT_EQ(on.count(counter::control_refusals), 1U);
}

TEST_F(driving, taking_over_ends_the_commands_of_the_other_at_once) {
  peer anna{on};
  peer bert{on};
  const std::string taken = take(anna);
  anna.tell(command(0.5, member(taken, "tick")));
  ASSERT_EQ(drives(), 0.5);
  const std::string over = take(bert, "take_over");
  EXPECT_EQ(refused(over), "null");
  EXPECT_EQ(drives(), std::nullopt); // it stands still before it changes hands
  bert.tell(command(0.2, member(over, "tick")));
  EXPECT_EQ(drives(), 0.2);
  anna.tell(command(0.5, member(over, "tick")));
  EXPECT_EQ(drives(), 0.2);
  EXPECT_EQ(refused(take(anna, "take_over")), R"("pause")");
}

TEST_F(driving, control_ends_with_the_link_and_with_it_the_command) {
  peer anna{on};
  anna.tell(command(0.5, tick(anna)));
  ASSERT_EQ(drives(), 0.5);
  anna.leave();
  on.cycle();
  EXPECT_EQ(drives(), std::nullopt);
  peer bert{on};
  EXPECT_EQ(refused(take(bert)), "null");
}

TEST_F(driving, letting_go_ends_the_command_at_once) {
  peer anna{on};
  anna.tell(command(0.5, tick(anna)));
  ASSERT_EQ(drives(), 0.5);
  const std::string gone = control(anna, R"("action":"release")");
  EXPECT_EQ(refused(gone), "null");
  EXPECT_EQ(member(gone, "driver"), "null");
  EXPECT_EQ(drives(), std::nullopt);
}

TEST_F(driving, who_is_silent_for_two_seconds_drives_no_more) {
  peer anna{on};
  ASSERT_EQ(refused(take(anna)), "null");
  peer bert{on};
  on.cycle(1900ms);
  EXPECT_EQ(refused(take(bert)), R"("driven")");
  on.cycle(200ms);
  EXPECT_EQ(refused(take(bert)), "null");
}

TEST_F(driving, a_stop_ends_all_commands_and_a_reset_brings_none_back) {
  stoppable_loop stops{on};
  peer anna{on};
  const auto reset = [&] {
    (void)stops.moves();
    EXPECT_TRUE(has(call_stop(on, anna, "reset", ""), R"("refused":null)"));
    ASSERT_TRUE(stops.moves());
  };
  reset();
  anna.tell(command(0.5, tick(anna)));
  ASSERT_EQ(drives(), 0.5);
  const std::string before = tick(anna);
  anna.tell(R"({"op":"call_service","service":"/rowe/stop"})");
  EXPECT_EQ(drives(), std::nullopt);
  anna.tell(command(0.5, tick(anna)));
  EXPECT_EQ(on.count(counter::commands_stopped), 1U);
  reset();
  EXPECT_EQ(drives(), std::nullopt);
  anna.tell(command(0.5, before));
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::commands_stale), 1U);
  on.cycle(2ms);
  anna.tell(command(0.4, tick(anna)));
  EXPECT_EQ(drives(), 0.4);
}

TEST_F(driving, what_is_not_finite_is_refused) {
  peer anna{on};
  const std::string now = tick(anna);
  anna.tell(command(0.5, now));
  for (const char* const speed : {"null", "1e999", "\"fast\"", "-1e400"}) {
    anna.tell(R"({"op":"publish","topic":"/cmd_vel","msg":{"linear":)" + std::string{speed} +
                  R"(,"angular":0},"tick":)" + now + "}",
              2);
    EXPECT_EQ(drives(), 0.5) << speed;
  }
  EXPECT_EQ(on.count(counter::undecodable) + on.count(counter::malformed), 4U);
}

TEST_F(driving, a_latched_command_is_no_command) {
  peer robot{on};
  robot.tell(R"({"op":"advertise","topic":"/late","type":"test/Twist","latch":true})");
  robot.tell(command(0.5, {}, "/late"));
  auto late = on.open<rowe::subscriber<twist>>(asked("/late", 300ms));
  on.cycles(3);
  EXPECT_EQ(drives(late), std::nullopt);
}

TEST_F(driving, this_process_drives_as_any_other_does) {
  rowe::detail::queue_pair& own =
      on.offer_now(rowe::detail::pair_kind::publish_value, "/cmd_vel", sizeof(twist), {.shared = true},
                   &rowe::describe<twist>(), "test/Twist");
  const auto publish = [&](double speed) {
    const twist value{speed, 0};
    EXPECT_TRUE(rowe::detail::publish_into(
        own, sizeof value, on.now, [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); }));
    on.cycle();
  };
  publish(0.3);
  EXPECT_EQ(drives(), 0.3);
  peer anna{on};
  EXPECT_EQ(member(control(anna, ""), "driver"), R"("this process")");
  EXPECT_EQ(refused(take(anna)), R"("driven")");
  ASSERT_EQ(refused(take(anna, "take_over")), "null");
  publish(0.3);
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::commands_refused), 1U);
  (void)control(anna, R"("action":"release")");
  publish(0.1);
  EXPECT_EQ(drives(), 0.1);
}

// What this process publishes on the topic.
struct driving_itself : driving {
  void open(rowe::duration ttl) {
    own = &on.offer_now(rowe::detail::pair_kind::publish_value, "/cmd_vel", sizeof(twist),
                        {.ttl = ttl, .shared = true}, &rowe::describe<twist>(), "test/Twist");
  }
  void publish(double speed) {
    const twist value{speed, 0};
    EXPECT_TRUE(rowe::detail::publish_into(
        *own, sizeof value, on.now, [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); }));
  }
  rowe::detail::queue_pair* own = nullptr;
};

TEST_F(driving_itself, its_command_counts_from_when_it_was_published_however_late_the_service_thread_is) {
  open(rowe::rt::for_ever);
  publish(0.3);
  on.now += 200ms;
  on.cycle();
  EXPECT_EQ(drives(), 0.3);
  on.cycle(100ms);
  EXPECT_EQ(drives(), std::nullopt);
  publish(0.4);
  on.now += 300ms;
  on.cycle();
  EXPECT_EQ(drives(), std::nullopt);
  EXPECT_EQ(on.count(counter::commands_stale), 1U);
}

TEST_F(driving_itself, its_command_that_is_sent_now_or_never_has_a_lease_as_any_other) {
  open(0ms);
  publish(0.3);
  on.cycle();
  EXPECT_EQ(drives(), 0.3);
  on.cycle(300ms);
  EXPECT_EQ(drives(), std::nullopt);
}

TEST_F(driving, the_shortest_lease_of_a_topic_holds_for_all) {
  {
    rowe::detail::queue_pair& brief = on.offer_now(asked("/cmd_vel", 100ms));
    rowe::subscriber<twist> other{core_harness::handle_of(brief)};
    peer anna{on};
    EXPECT_EQ(member(control(anna, ""), "lease_ms"), "100");
    anna.tell(command(0.5, tick(anna)));
    EXPECT_EQ(drives(), 0.5);
    EXPECT_EQ(drives(other), 0.5);
    on.cycle(101ms);
    EXPECT_EQ(drives(), std::nullopt);
    brief.lifecycle.close();
  }
  on.cycles(2);
  peer bert{on};
  EXPECT_EQ(member(control(bert, ""), "lease_ms"), "300");
}

TEST_F(driving, a_handle_without_a_lease_gets_only_what_was_admitted) {
  rowe::detail::queue_pair& logs = on.offer_now(rowe::detail::pair_kind::subscribe_text, "/cmd_vel", 256);
  peer anna{on};
  peer bert{on};
  const std::string now = tick(anna);
  anna.tell(command(0.5, now));
  bert.tell(command(0.9, now));
  const texts got = take_all(logs);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_TRUE(has(got[0], "0.5"));
}

TEST_F(driving, other_calls_of_a_subscriber_with_a_lease_are_misuse) {
  EXPECT_EQ(loop->latest(on.now).code(), rowe::errc::misuse);
  EXPECT_EQ(loop->try_take(on.now).code(), rowe::errc::misuse);
  auto plain = on.open<rowe::subscriber<twist>>(rowe::detail::subscribe_request<twist>("/t", {}));
  EXPECT_EQ(plain.latest_within(on.now).code(), rowe::errc::misuse);
  EXPECT_EQ(rowe::subscriber<twist>{}.latest_within(on.now).code(), rowe::errc::misuse);
}

TEST_F(driving, nine_topics_with_a_lease_are_too_many) {
  std::deque<std::string> names;
  for (int i = 1; i < 8; ++i)
    (void)on.offer_now(asked(names.emplace_back("/drive_" + std::to_string(i)), 300ms));
  peer anna{on};
  EXPECT_EQ(refused(control(anna, "")), R"("topic")"); // which of them is not said
  rowe::detail::queue_pair& ninth = on.offer_now(asked("/ninth", 300ms));
  EXPECT_EQ(ninth.lifecycle.refusal().code, rowe::errc::too_many_leases);
  EXPECT_EQ(ninth.lifecycle.refusal().limit, 8);
}

TEST_F(driving, requests_that_mean_nothing_are_refused) {
  peer anna{on};
  EXPECT_EQ(refused(control(anna, R"("topic":"/odom")")), R"("topic")");
  EXPECT_EQ(refused(control(anna, R"("action":"fly")")), R"("action")");
  EXPECT_EQ(refused(control(anna, R"("action":"take")")), R"("tick")");
  EXPECT_EQ(refused(control(anna, R"("action":"take","tick":"x")")), R"("tick")");
  EXPECT_EQ(refused(control(anna, R"("action":"take","tick":-5)")), R"("tick")");
  EXPECT_EQ(refused(control(anna, R"("topic":7)")), "null"); // there is only one
  anna.tell(R"({"op":"publish","topic":"/cmd_vel","msg":{},"tick":"soon"})", 2);
  EXPECT_TRUE(has(anna.hear_as_one(), "tick"));
}

TEST_F(driving, the_state_says_who_drives_at_once_and_then_twenty_times_a_second) {
  peer wall{on};
  peer anna{on};
  wall.tell(R"({"op":"subscribe","topic":"/rowe/control/state"})", 2);
  std::string state = wall.hear_as_one();
  EXPECT_TRUE(has(state, R"("topic":"/cmd_vel")"));
  EXPECT_TRUE(has(state, R"("driver":null)"));
  ASSERT_EQ(refused(take(anna, "take", R"(,"name":"phone")")), "null");
  state = wall.hear_as_one();
  EXPECT_TRUE(has(state, R"("driver":"phone")")) << state;
  std::size_t states = 0;
  for (int i = 0; i < 20; ++i) {
    on.cycle(50ms);
    states += wall.hear().size();
  }
  EXPECT_GE(states, 19U);
  (void)control(anna, R"("action":"release")");
  EXPECT_TRUE(has(wall.hear_as_one(), R"("driver":null)"));
  on.cycles(4, 100ms);
  EXPECT_EQ(wall.hear_as_one(), "");
  on.cycles(2, 100ms);
  EXPECT_TRUE(has(wall.hear_as_one(), R"("driver":null)"));
}

TEST_F(driving, a_name_is_shown_as_it_is_and_cannot_break_out) {
  peer anna{on};
  const std::string answer = take(anna, "take", R"(,"name":"a\"},{\"driver\":\"b\u0000\n")");
  EXPECT_EQ(refused(answer), "null");
  EXPECT_TRUE(rowe::json::find(answer, "driver").has_value());
  EXPECT_EQ(member(answer, "yours"), "true");
}

} // namespace
} // namespace core_control_test
