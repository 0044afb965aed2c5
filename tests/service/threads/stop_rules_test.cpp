// SPDX-License-Identifier: Apache-2.0
// The rules of docs/stop.md, one by one, on a clock that moves when told to.
#include "service/threads/core_options.hpp"
#include "service/threads/stop_rules.hpp"

#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <string_view>

#include "json/writing/writer.hpp"

namespace stop_rules_test {
namespace {

using namespace std::chrono_literals;
using rowe::rt::time_point;
using rowe::service::stop_rules;
using refusal = stop_rules::refusal;

constexpr std::uint64_t seed = 0x1234'0000'1234'5678;
constexpr std::uint64_t operator_a = 1ULL << 32, operator_b = 2ULL << 32;

// A loop as a thread would run it.
struct loop {
  rowe::detail::latch_words<> words;
  rowe::detail::latch_memory own;
  std::uint32_t place = 0;
  bool moving = false;
};

struct robot {
  explicit robot(rowe::stop_options with = {}, bool served_in_real_time = false)
      : options{rowe::service::settled(with, served_in_real_time)}, rules{options, now, seed} {}

  rowe::stop_options options;
  time_point now{1000s};
  stop_rules rules;
  rowe::detail::permit_word<> permit;
  std::deque<loop> loops;

  loop& add_loop(std::string_view name = "loop", rowe::duration timeout = 100ms) {
    loop& l = loops.emplace_back();
    l.place = rules.add_loop(name, timeout, l.words, now);
    publish();
    return l;
  }
  void publish() { rules.write_permit(permit); }
  void look(loop& l, bool acknowledges = true) {
    const bool engaged = rowe::detail::latch_engaged(permit, l.words, l.own, now);
    l.moving = !engaged;
    if (engaged && acknowledges) rowe::detail::latch_acknowledge(l.words, l.own, now);
  }
  void look_all() {
    for (loop& l : loops) look(l);
  }
  void update() {
    rules.update(now);
    publish();
  }
  // So much time, a millisecond at a time, everybody well.
  void pass(rowe::duration how_long, bool beats = true) {
    for (const time_point end = now + how_long; now < end;) {
      now += 1ms;
      if (beats) beat();
      update();
      look_all();
    }
  }
  std::int64_t tick() const { return static_cast<std::int64_t>(rules.tick(now)); }
  refusal heartbeat(std::string_view guard = "page", std::uint64_t peer = operator_a) {
    return rules.heartbeat(guard, tick(), false, peer, true, now);
  }
  refusal heartbeat_with(std::int64_t tick) {
    return rules.heartbeat("page", tick, false, operator_a, true, now);
  }
  refusal resign(std::string_view guard, bool has_role = true) {
    return rules.heartbeat(guard, -1, true, operator_b, has_role, now);
  }
  void beat() {
    if (guarded) (void)heartbeat();
  }
  // Of a stop with this number.
  refusal reset(std::uint64_t number, std::int64_t tick, bool has_role = true) {
    return rules.reset(static_cast<std::int64_t>(number), tick, has_role, now);
  }
  // With a tick that was issued after whatever was asked before.
  refusal reset() {
    now += 1ms;
    const refusal why = reset(rules.number(), tick());
    publish();
    return why;
  }
  // All loops acknowledge, and may move again.
  void let_go() {
    look_all();
    ASSERT_EQ(reset(), refusal::none);
    look_all();
  }
  void peer_gone() {
    rules.peer_gone(operator_a, now);
    publish();
    look_all();
  }
  void stop(std::string_view source = "operator", std::uint64_t peer = operator_a) {
    rules.request(source, peer, now);
    publish();
  }
  std::string state() const {
    std::array<char, 4096> buffer;
    rowe::json::writer into{buffer};
    rules.write_state(into, now);
    return {buffer.data(), into.bytes()};
  }
  bool guarded = false;
};

// With one loop and one guard, and moving.
struct moving_robot : robot {
  explicit moving_robot(rowe::stop_options with = {}, bool served_in_real_time = false)
      : robot{with, served_in_real_time} {
    add_loop();
    guarded = true;
    EXPECT_EQ(heartbeat(), refusal::none);
    let_go();
    EXPECT_TRUE(loops[0].moving);
  }
  loop& base() { return loops[0]; }
};

rowe::stop_options unguarded() {
  rowe::stop_options options;
  options.unguarded = true;
  return options;
}

TEST(stop_rules, start_stopped) {
  robot r;
  loop& l = r.add_loop();
  r.pass(1s);
  EXPECT_FALSE(l.moving);
  EXPECT_EQ(r.rules.cause_name(), "start");
}

TEST(stop_rules, let_an_unguarded_robot_move_only_if_it_may) {
  robot strict;
  strict.add_loop();
  strict.look_all();
  EXPECT_EQ(strict.reset(), refusal::guards);

  robot free{unguarded()};
  free.add_loop();
  free.look_all();
  EXPECT_EQ(free.reset(), refusal::none);
  free.pass(10s);
  EXPECT_TRUE(free.loops[0].moving);
  EXPECT_NE(free.state().find(R"("unguarded":true)"), std::string::npos);
}

TEST(stop_rules, say_for_how_long_the_robot_is_what_it_is) {
  robot r{unguarded()};
  r.add_loop();
  const auto says = [&](std::string_view since) { return r.state().find(since) != std::string::npos; };
  r.pass(1s);
  EXPECT_TRUE(says(R"("since_ms":1000,)")) << r.state();
  EXPECT_EQ(r.reset(), refusal::none);
  r.pass(2s);
  EXPECT_TRUE(says(R"("since_ms":2000,)")) << r.state();
  r.stop();
  r.pass(300ms);
  EXPECT_TRUE(says(R"("since_ms":300,)")) << r.state();
  r.stop(); // a repeat
  r.pass(300ms);
  EXPECT_TRUE(says(R"("since_ms":600,)")) << r.state();
  r.stop("another", operator_b);
  EXPECT_TRUE(says(R"("since_ms":0,)")) << r.state();
}

TEST(stop_rules, let_it_move_while_its_guard_is_there) {
  moving_robot r;
  r.pass(10s);
  EXPECT_TRUE(r.base().moving);
}

TEST(stop_rules, stop_within_the_timeout_of_a_guard_that_falls_silent_each_of_a_thousand_times) {
  std::mt19937 random{1};
  for (int round = 0; round < 1000; ++round) {
    moving_robot r;
    r.pass(std::chrono::milliseconds{random() % 700});
    const time_point last_tick = r.now;
    r.guarded = false;
    r.now += std::chrono::microseconds{random() % 1000};
    while (r.base().moving) {
      r.now += 1ms;
      r.update();
      r.look_all();
      ASSERT_LT(r.now, last_tick + r.options.guard_timeout + 20ms) << round;
    }
    ASSERT_GE(r.now, last_tick + r.options.guard_timeout - 1ms) << round;
    r.update(); // the loop may have seen it first
    ASSERT_EQ(r.rules.cause_name(), "guard");
    ASSERT_EQ(r.rules.source(), "page");
  }
}

TEST(stop_rules, renew_nothing_by_old_ticks_that_arrive_late_all_at_once) {
  moving_robot r;
  std::vector<std::int64_t> held;
  for (int i = 0; i < 24; ++i) {
    r.pass(20ms, false);
    held.push_back(r.tick());
  }
  // 480 ms of heartbeats that a stalled network kept: the newest counts from when it was issued.
  for (const std::int64_t tick : held) EXPECT_EQ(r.heartbeat_with(tick), refusal::none);
  r.pass(499ms, false);
  EXPECT_TRUE(r.base().moving);
  r.pass(2ms, false);
  EXPECT_FALSE(r.base().moving);
  // And none of them any more.
  for (const std::int64_t tick : held) EXPECT_EQ(r.heartbeat_with(tick), refusal::tick);
}

TEST(stop_rules, take_no_tick_that_was_not_issued_yet_or_is_of_another_run) {
  moving_robot r;
  for (const std::int64_t tick :
       {r.tick() + 1, std::int64_t{0}, std::int64_t{-1}, std::int64_t{1}, INT64_MAX})
    EXPECT_EQ(r.heartbeat_with(tick), refusal::tick) << tick;
  EXPECT_EQ(r.reset(r.rules.number(), r.tick() + 1),
            refusal::number); // it moves
  r.stop();
  r.look_all();
  EXPECT_EQ(r.reset(r.rules.number(), r.tick() + 1), refusal::tick);
}

TEST(stop_rules, stay_stopped_when_the_guard_comes_back) {
  moving_robot r;
  r.pass(600ms, false);
  ASSERT_FALSE(r.base().moving);
  r.pass(10s);
  EXPECT_FALSE(r.base().moving);
  EXPECT_EQ(r.reset(), refusal::none);
  r.look_all();
  EXPECT_TRUE(r.base().moving);
}

TEST(stop_rules, stop_at_once_when_a_guards_connection_ends) {
  moving_robot r;
  r.peer_gone();
  EXPECT_FALSE(r.base().moving);
  EXPECT_EQ(r.rules.cause_name(), "guard");
  EXPECT_EQ(r.reset(), refusal::guards);
}

TEST(stop_rules, let_a_guard_go_on_over_another_connection) {
  moving_robot r;
  r.rules.peer_gone(operator_a, r.now);
  EXPECT_EQ(r.heartbeat("page", operator_b), refusal::none);
  r.publish();
  r.look_all();
  EXPECT_EQ(r.reset(), refusal::none);
}

TEST(stop_rules, take_a_guards_name_from_nobody_who_is_there) {
  moving_robot r;
  EXPECT_EQ(r.heartbeat("page", operator_b), refusal::name);
}

TEST(stop_rules, want_every_guard_fresh) {
  moving_robot r;
  EXPECT_EQ(r.heartbeat("second", operator_b), refusal::none);
  r.pass(499ms);
  EXPECT_TRUE(r.base().moving);
  r.pass(5ms);
  EXPECT_FALSE(r.base().moving);
  EXPECT_EQ(r.rules.source(), "second");
  EXPECT_EQ(r.reset(), refusal::guards);
  EXPECT_EQ(r.heartbeat("second", operator_b), refusal::none);
  EXPECT_EQ(r.reset(), refusal::none);
}

TEST(stop_rules, let_a_guard_resign_while_stopped_and_stop_when_it_resigns_moving) {
  moving_robot r;
  EXPECT_EQ(r.heartbeat("second", operator_b), refusal::none);
  EXPECT_EQ(r.resign("second"), refusal::none);
  r.publish();
  r.look_all();
  EXPECT_FALSE(r.base().moving);
  EXPECT_EQ(r.reset(), refusal::none); // without it
}

TEST(stop_rules, let_those_with_the_role_resign_a_guard_that_never_comes_back) {
  moving_robot r;
  r.rules.peer_gone(operator_a, r.now);
  EXPECT_EQ(r.resign("page", false), refusal::role);
  EXPECT_EQ(r.resign("page"), refusal::none);
  r.publish();
  r.look_all();
  EXPECT_EQ(r.reset(), refusal::guards); // none is left
}

TEST(stop_rules, register_guards_and_reset_only_with_the_role) {
  robot r{unguarded()};
  r.add_loop();
  r.look_all();
  EXPECT_EQ(r.rules.heartbeat("page", r.tick(), false, operator_a, false, r.now), refusal::role);
  EXPECT_EQ(r.reset(r.rules.number(), r.tick(), false), refusal::role);
}

TEST(stop_rules, have_places_for_eight_guards_with_plain_names) {
  robot r;
  r.add_loop();
  for (int i = 0; i < 8; ++i) EXPECT_EQ(r.heartbeat("g" + std::to_string(i), operator_a), refusal::none);
  EXPECT_EQ(r.heartbeat("one-more", operator_a), refusal::guards);
  for (const std::string_view bad : {"", "a b", "\"", "a-name-that-is-longer-than-31-bytes"})
    EXPECT_EQ(r.heartbeat(bad, operator_a), refusal::name) << bad;
}

TEST(stop_rules, stop_every_loop_when_somebody_asks) {
  moving_robot r;
  loop& arm = r.add_loop("arm");
  r.let_go();
  ASSERT_TRUE(arm.moving && r.base().moving);
  r.stop();
  r.look_all();
  EXPECT_FALSE(arm.moving || r.base().moving);
  r.update();
  EXPECT_EQ(r.rules.observed(), r.now);
}

TEST(stop_rules, remember_when_loops_acknowledged_for_longer_than_their_words_do) {
  moving_robot r;
  r.stop();
  r.look_all();
  r.update();
  const time_point acknowledged = r.now;
  r.now += 100h;
  r.stop(); // a repeat
  EXPECT_EQ(r.rules.observed(), acknowledged);
}

TEST(stop_rules, cut_a_long_source_between_characters) {
  moving_robot r;
  r.stop(std::string(63, 'a') + "\u00e9");
  EXPECT_EQ(r.rules.source(), std::string(63, 'a'));
  r.stop(std::string(62, 'b') + "\u00e9");
  EXPECT_EQ(r.rules.source(), std::string(62, 'b') + "\u00e9");
}

TEST(stop_rules, keep_the_number_for_repeats_and_raise_it_for_another_source) {
  moving_robot r;
  const auto moving = r.rules.number();
  r.stop("a");
  const auto first = r.rules.number();
  EXPECT_NE(first, moving);
  r.stop("a");
  EXPECT_EQ(r.rules.number(), first);
  r.stop("b", operator_b);
  EXPECT_NE(r.rules.number(), first);
  const auto second = r.rules.number();
  for (int i = 0; i < 10; ++i) {
    r.stop("a");
    r.stop("b", operator_b);
  }
  EXPECT_EQ(r.rules.number(), second);
}

TEST(stop_rules, refuse_the_reset_of_who_has_not_seen_the_newest_stop) {
  moving_robot r;
  r.stop("a");
  r.look_all();
  const auto seen = r.rules.number();
  r.stop("b", operator_b);
  r.look_all();
  r.now += 1ms;
  EXPECT_EQ(r.reset(seen, r.tick()), refusal::number);
  EXPECT_EQ(r.reset(), refusal::none);
}

// Everybody new raises the number, and from the seventeenth on everybody is.
TEST(stop_rules, never_use_a_number_again_however_many_stops_there_are) {
  moving_robot r;
  r.stop("first");
  r.look_all();
  const auto seen = r.rules.number();
  const std::int64_t tick = r.tick();
  for (int i = 0; i < 20; ++i) r.stop(std::to_string(i), operator_b);
  for (int i = 0; i < 65'515; ++i) {
    r.rules.request("flood", operator_b, r.now + i * 690ns); // 45 ms
    ASSERT_EQ(r.rules.number(), seen + 21 + static_cast<std::uint64_t>(i));
  }
  r.now += 46ms;
  r.look_all();
  EXPECT_EQ(r.reset(seen, tick), refusal::number);
  EXPECT_EQ(r.reset(seen, r.tick()), refusal::number);
  EXPECT_EQ(r.reset(r.rules.number(), tick), refusal::tick);
  EXPECT_FALSE(r.base().moving);
}

TEST(stop_rules, raise_what_loops_know_a_stop_by_once_in_a_millisecond_at_most) {
  moving_robot r;
  r.stop("first");
  for (int i = 0; i < 20; ++i) r.stop(std::to_string(i), operator_b);
  int raised = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto before = r.rules.latch();
    r.now += 1us;
    r.stop("flood", operator_b);
    raised += r.rules.latch() != before;
  }
  EXPECT_LE(raised, 101);
  EXPECT_GE(raised, 99);
}

// It met one of many stops of one millisecond; the others found it standing.
TEST(stop_rules, take_the_answer_to_a_stop_for_all_of_its_millisecond) {
  moving_robot r;
  r.now += 1ms;
  r.stop("a");
  r.look_all();
  r.update();
  const time_point braked = r.now;
  EXPECT_EQ(r.rules.observed(), braked);
  const auto first = r.rules.number();
  r.now += 100us;
  r.stop("b", operator_b);
  EXPECT_NE(r.rules.number(), first);
  EXPECT_EQ(r.rules.source(), "b");
  EXPECT_EQ(r.rules.observed(), braked); // and not moved since
  EXPECT_NE(r.state().find(R"("acknowledged":)" + std::to_string(r.rules.number())), std::string::npos)
      << r.state();
  r.now += 1ms;
  r.stop("c", operator_b);
  EXPECT_EQ(r.rules.observed(), rowe::rt::never); // a new one
  EXPECT_NE(r.state().find(R"("acknowledged":)" + std::to_string(first)), std::string::npos) << r.state();
  r.look_all();
  r.update();
  EXPECT_EQ(r.rules.observed(), r.now);
}

TEST(stop_rules, stop_a_loop_that_was_let_go_in_the_same_millisecond) {
  moving_robot r;
  r.stop();
  r.let_go();
  ASSERT_TRUE(r.base().moving);
  r.now += 10us;
  r.stop();
  EXPECT_EQ(r.rules.observed(), rowe::rt::never); // what it acknowledged was the stop before
  r.look(r.base());
  EXPECT_FALSE(r.base().moving);
  r.update();
  EXPECT_EQ(r.rules.observed(), r.now);
  EXPECT_EQ(r.reset(r.rules.number(), r.tick()), refusal::tick);
  EXPECT_EQ(r.reset(), refusal::none);
  r.look_all();
  EXPECT_TRUE(r.base().moving);
}

// A loop that hangs for a whole turn of the latch's number still has one in its words when it is due again.
TEST(stop_rules, never_give_the_latch_a_number_that_a_loop_still_has) {
  robot r{unguarded()};
  loop& quick = r.add_loop("quick");
  loop& hangs = r.add_loop("hangs");
  r.look_all();
  ASSERT_EQ(r.reset(), refusal::none);
  r.stop("first");
  r.look(quick);
  r.look(hangs);
  const auto held = hangs.own.tripped;
  ASSERT_EQ(held, r.rules.latch());
  for (int i = 0; i < 20; ++i) r.stop(std::to_string(i), operator_b);
  for (int i = 0; i < 70'000; ++i) {
    r.now += 1ms;
    r.stop("flood", operator_b);
    ASSERT_NE(r.rules.latch(), held) << i;
    if (i % 50 == 0) r.look(quick);
  }
  r.look(quick);
  EXPECT_EQ(r.reset(), refusal::loops); // it has not looked
  r.look(hangs, false);
  EXPECT_EQ(r.reset(), refusal::loops); // nor commanded its brake again
  r.look(hangs);
  EXPECT_EQ(r.reset(), refusal::none);
  r.look_all();
  EXPECT_TRUE(quick.moving && hangs.moving);
}

TEST(stop_rules, refuse_a_reset_whose_tick_was_issued_before_the_newest_stop) {
  moving_robot r;
  r.stop("a");
  r.look_all();
  r.now += 5ms;
  const auto number = static_cast<std::int64_t>(r.rules.number());
  const std::int64_t tick = r.tick();
  r.now += 5ms;
  r.look_all();
  r.stop("a"); // a repeat, which raises no number
  ASSERT_EQ(static_cast<std::int64_t>(r.rules.number()), number);
  EXPECT_EQ(r.rules.reset(number, tick, true, r.now), refusal::tick);
  EXPECT_EQ(r.rules.reset(number, r.tick(), true, r.now), refusal::tick); // it may be from before
  r.now += 1ms;
  EXPECT_EQ(r.rules.reset(number, r.tick(), true, r.now), refusal::none);
}

TEST(stop_rules, refuse_a_reset_whose_tick_is_older_than_a_stop_that_nobody_asked_for) {
  moving_robot r;
  r.pass(10ms);
  const std::int64_t tick = r.tick();
  r.peer_gone();
  EXPECT_EQ(r.heartbeat("page", operator_b), refusal::none);
  EXPECT_EQ(r.reset(r.rules.number(), tick), refusal::tick);
  EXPECT_EQ(r.reset(), refusal::none);
}

TEST(stop_rules, refuse_the_reset_of_who_has_seen_it_moving_and_not_the_stop) {
  moving_robot r;
  const auto seen = r.rules.number();
  r.stop();
  r.look_all();
  EXPECT_EQ(r.reset(seen, r.tick()), refusal::number);
}

TEST(stop_rules, refuse_a_reset_out_of_an_offline_queue) {
  moving_robot r;
  r.stop();
  r.look_all();
  const auto number = static_cast<std::int64_t>(r.rules.number());
  r.now += 1ms;
  const std::int64_t tick = r.tick();
  r.pass(2001ms);
  EXPECT_EQ(r.rules.reset(number, tick, true, r.now), refusal::tick);
  EXPECT_EQ(r.rules.reset(number, r.tick(), true, r.now), refusal::none);
}

TEST(stop_rules, refuse_a_reset_until_every_loop_has_acknowledged_this_stop) {
  moving_robot r;
  r.stop();
  EXPECT_EQ(r.reset(), refusal::loops);
  r.look(r.base(), false);
  EXPECT_EQ(r.reset(), refusal::loops); // it stands, and has not said so
  r.look(r.base());
  r.now += 1ms;
  r.stop("b", operator_b);
  EXPECT_EQ(r.reset(), refusal::loops); // that was another stop
  r.look(r.base());
  EXPECT_EQ(r.reset(), refusal::none);
}

TEST(stop_rules, refuse_a_reset_without_any_loop) {
  robot r{unguarded()};
  loop& l = r.add_loop();
  r.look(l);
  r.rules.remove_loop(l.place, r.now);
  EXPECT_EQ(r.reset(), refusal::loops);
}

TEST(stop_rules, stop_all_when_a_loop_does_not_look) {
  moving_robot r;
  loop& arm = r.add_loop("arm", 50ms);
  r.let_go();
  while (r.base().moving) {
    r.now += 1ms;
    r.beat();
    r.update();
    r.look(r.base());
    ASSERT_LT(r.now, time_point{1000s} + 60ms);
  }
  EXPECT_EQ(r.rules.cause_name(), "loop");
  EXPECT_EQ(r.rules.source(), "arm");
  r.look(r.base());
  r.look(arm, false);
  EXPECT_EQ(r.reset(), refusal::loops);
}

TEST(stop_rules, let_loops_stop_by_themselves_when_this_thread_is_silent_and_then_stop_all) {
  moving_robot r;
  loop& arm = r.add_loop("arm");
  r.let_go();
  const time_point silent_from = r.now;
  while (r.base().moving) {
    r.now += 1ms;
    r.look(r.base());
    ASSERT_LE(r.now, silent_from + r.options.service_timeout + 1ms);
  }
  // It wakes up before the other loop has looked, and renews nothing.
  (void)r.heartbeat();
  r.update();
  r.look(arm);
  EXPECT_FALSE(arm.moving);
  EXPECT_EQ(r.rules.cause_name(), "service");
}

// How long the loop moves on when the service thread is silent.
rowe::duration until_it_stops(moving_robot& r) {
  const time_point silent_from = r.now;
  while (r.base().moving && r.now < silent_from + 1s) {
    r.now += 1ms;
    r.look(r.base());
  }
  return r.now - silent_from;
}

TEST(stop_rules, wait_for_a_service_thread_as_long_as_its_priority_asks_for) {
  moving_robot ordinary;
  EXPECT_EQ(until_it_stops(ordinary), 250ms);
  moving_robot granted{{}, true};
  EXPECT_EQ(until_it_stops(granted), 50ms);
  moving_robot chosen{{.service_timeout = 80ms}, true};
  EXPECT_EQ(until_it_stops(chosen), 80ms);
}

TEST(stop_rules, keep_a_loop_stopped_that_tripped_even_when_the_permit_is_renewed) {
  moving_robot r;
  const time_point asleep = r.now + r.options.service_timeout + 1ms;
  r.permit.grant(r.rules.latch(), r.now); // over, for one look
  r.look(r.base(), false);
  ASSERT_FALSE(r.base().moving);
  r.permit.grant(r.rules.latch(), asleep + 1s); // a renewal that did not know
  r.look(r.base(), false);
  EXPECT_FALSE(r.base().moving);
}

TEST(stop_rules, stop_when_a_loop_comes_or_goes_while_others_move) {
  moving_robot r;
  loop& arm = r.add_loop("arm");
  r.look_all();
  EXPECT_FALSE(r.base().moving);
  EXPECT_EQ(r.rules.cause_name(), "start");
  ASSERT_EQ(r.reset(), refusal::none);
  r.look_all();
  r.rules.remove_loop(arm.place, r.now);
  r.publish();
  r.look(r.base());
  EXPECT_FALSE(r.base().moving);
  EXPECT_EQ(r.rules.cause_name(), "loop");
}

TEST(stop_rules, shorten_the_permit_at_once_for_a_guard_whose_timeout_is_nearly_over) {
  moving_robot r;
  r.pass(600ms);
  const std::int64_t old_tick = r.tick() - 495;
  ASSERT_EQ(r.rules.heartbeat("second", old_tick, false, operator_b, true, r.now), refusal::none);
  r.update();
  r.now += 6ms;
  r.look(r.base()); // this thread does nothing more
  EXPECT_FALSE(r.base().moving);
}

TEST(stop_rules, renew_the_permit_in_steps) {
  moving_robot r;
  int renewals = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto before = r.permit.read();
    r.now += 100us;
    r.beat();
    r.update();
    r.look_all();
    renewals += r.permit.read() != before;
  }
  EXPECT_TRUE(r.base().moving);
  EXPECT_LE(renewals, 17); // 100 ms in steps of 6.25 ms
}

TEST(stop_rules, raise_their_version_for_all_that_is_shown) {
  moving_robot r;
  auto before = r.rules.version();
  const auto changed = [&] { return std::exchange(before, r.rules.version()) != r.rules.version(); };
  r.pass(100ms);
  EXPECT_FALSE(changed());
  r.stop();
  EXPECT_TRUE(changed());
  r.look_all();
  r.update();
  EXPECT_TRUE(changed()); // acknowledged
  EXPECT_EQ(r.reset(), refusal::none);
  EXPECT_TRUE(changed());
  (void)r.heartbeat("second", operator_b);
  EXPECT_TRUE(changed());
}

TEST(stop_rules, write_the_largest_state_in_two_and_a_half_kilobytes) {
  robot r;
  const std::string name(31, 'n');
  for (int i = 0; i < 8; ++i) r.add_loop(name);
  for (int i = 0; i < 8; ++i) (void)r.heartbeat(name.substr(1) + std::to_string(i));
  r.rules.request(std::string(200, '\x01'), operator_a, r.now);
  r.now += 9999h;
  EXPECT_LT(r.state().size(), 2560U);
}

TEST(latch_words, tell_when_they_were_acknowledged_even_across_the_end_of_their_48_bits) {
  rowe::detail::latch_words<> words;
  for (const std::int64_t at :
       {std::int64_t{5}, (std::int64_t{1} << 48) - 1, std::int64_t{1} << 48, std::int64_t{7} << 50}) {
    const time_point t{rowe::duration{at}};
    words.acknowledge(3, t);
    for (const auto later :
         {rowe::duration{0}, rowe::duration{1}, rowe::duration{30h}, rowe::duration{70h}}) {
      EXPECT_EQ(words.acknowledged(t + later).at, t);
      EXPECT_EQ(words.acknowledged(t + later).number, 3);
    }
  }
}

TEST(latch_number, begins_anew_behind_the_largest_and_is_never_none) {
  EXPECT_EQ(rowe::detail::next_latch_number(rowe::detail::latch_number_max), 1);
  for (std::uint64_t high : {std::uint64_t{0}, std::uint64_t{0xffff} << 48, std::uint64_t{0xfffe} << 48})
    EXPECT_NE(stop_rules({}, time_point{}, high).latch(), 0);
}

} // namespace
} // namespace stop_rules_test
