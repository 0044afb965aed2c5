// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_service.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/calls/call_parts.hpp"

namespace stop_service_test {
namespace {

using namespace call_parts;
using rowe::service::call_index;
using rowe::service::stop_asker;
using rowe::service::stop_rules;
using rowe::service::stop_verb;

rowe::endpoint_options with_stop() {
  rowe::endpoint_options options = ::state_fixture::with(few());
  options.limits.calls_max = 32;
  options.limits.handles_max = stop_rules::loops_max + 1;
  options.stop.unguarded = true;
  options.stop.service_timeout = 10s; // the loop looks seldom here
  return options;
}

// A robot with one loop, which moves when start() was called.
struct stop_service_test : call_parts::call_parts {
  stop_service_test() : call_parts{with_stop()} {}

  rowe::service::stop_service stop{memory,
                                   {.state_ = state,
                                    .sender_ = sending,
                                    .access_control_ = access,
                                    .call_completion_ = completion,
                                    .command_gate_ = gate,
                                    .stop_rules_ = rules}};
  rowe::detail::latch_words<> words;
  rowe::detail::latch_memory own;

  connection& arrive() {
    connection& c = connect();
    c.local = true;
    stop.open({c.id.index});
    return c;
  }
  void leave(connection& c) {
    stop.leave(c);
    sending.forget({c.id.index});
    out.forget({c.id.index});
    c.state = connection::phase::free;
    peers.remove();
  }
  // What the loop does in its period. Whether it may move.
  bool look(bool acknowledges = true) {
    const bool engaged = rowe::detail::latch_engaged(shared.permit, words, own, cycle.now);
    if (engaged && acknowledges) rowe::detail::latch_acknowledge(words, own, cycle.now);
    return !engaged;
  }
  void add_loop() {
    (void)rules.add_loop("loop", 10s, words, cycle.now);
    stop.update();
  }
  void start() {
    if (!stop.in_use()) add_loop();
    (void)look();
    stop.update();
    cycle.now += 1ms;
    stop.carry_out(stop_verb::reset, {.silent = true},
                   "{\"number\":" + std::to_string(rules.number()) +
                       ",\"tick\":" + std::to_string(rules.tick(cycle.now)) + "}");
    ASSERT_TRUE(look());
  }
  // The loop sees the stop, and then this part looks.
  void acknowledge() {
    cycle.now += 1ms;
    ASSERT_FALSE(look());
    stop.update();
  }
  static stop_asker asker(const connection& c, std::string_view id) {
    return {.who = call_endpoint::of(c.id, c.protocol->topics.id()), .id_raw = id};
  }
  void ask(const connection& c, std::string_view id) { stop.carry_out(stop_verb::stop, asker(c, id), {}); }
  call_index ask_from_here() {
    const call_index index = completion.open({}, {}, "/rowe/stop", rowe::rt::never);
    EXPECT_TRUE(index);
    stop.carry_out(stop_verb::stop, {.call = calls.ref(index)}, {});
    return index;
  }
  static int count_of(std::string_view in, std::string_view part) {
    int count = 0;
    for (auto at = in.find(part); at != in.npos; at = in.find(part, at + 1)) ++count;
    return count;
  }
  static bool observed(std::string_view answer) { return answer.find("\"observed_ns\":\"") != answer.npos; }
  void TearDown() override {
    EXPECT_TRUE(stop.check());
    call_parts::TearDown();
  }
};

TEST_F(stop_service_test, answers_in_vain_when_the_time_for_it_is_over) {
  connection& peer = arrive();
  start();
  ask(peer, "\"1\"");
  cycle.now += options.stop.observe_timeout - 1ms;
  stop.update();
  EXPECT_EQ(arrived(peer), "");
  cycle.now += 1ms;
  stop.update();
  const std::string answer = arrived(peer);
  EXPECT_NE(answer.find("\"observed_ns\":null"), answer.npos);
  acknowledge();
  EXPECT_EQ(arrived(peer), "") << "once";
}

TEST_F(stop_service_test, answers_at_once_when_the_loops_have_acknowledged_before) {
  connection& peer = arrive();
  start();
  ask(peer, "\"1\"");
  acknowledge();
  (void)arrived(peer);
  ask(peer, "\"2\"");
  EXPECT_TRUE(observed(arrived(peer)));
}

TEST_F(stop_service_test, tells_nothing_to_the_next_peer_at_the_same_place) {
  connection& gone = arrive();
  start();
  ask(gone, "\"1\"");
  ask(gone, "\"2\"");
  const connection_id before = gone.id;
  transport.peer_closes(before);
  (void)arrived(gone); // which the transport reports
  leave(gone);
  EXPECT_TRUE(stop.check());
  connection& next = arrive();
  ASSERT_EQ(next.id.index, before.index);
  ASSERT_NE(next.id.generation, before.generation);
  ask(next, "\"3\"");
  ask(next, "\"4\"");
  EXPECT_EQ(arrived(next), "") << "both wait: it has the whole share";
  EXPECT_TRUE(stop.check());
  acknowledge();
  const std::string answers = arrived(next);
  EXPECT_EQ(count_of(answers, "\"values\""), 2) << answers;
  EXPECT_EQ(count_of(answers, "\"1\""), 0);
}

TEST_F(stop_service_test, lets_as_many_of_this_process_wait_as_there_are_places) {
  start();
  const auto places = bounds.connections_max + rowe::service::stops_awaited_of_process;
  for (std::size_t i = 0; i < places; ++i) (void)ask_from_here();
  EXPECT_EQ(calls.in_flight(), places);
  (void)ask_from_here();
  EXPECT_EQ(calls.in_flight(), places) << "one more is answered at once";
  EXPECT_FALSE(look(false));
  acknowledge();
  EXPECT_EQ(calls.in_flight(), 0U);
}

TEST_F(stop_service_test, answers_no_call_that_has_ended_while_it_waited) {
  start();
  const call_index first = ask_from_here();
  completion.time_out(first);
  const call_index next = completion.open({}, {}, "/add", rowe::rt::never);
  ASSERT_EQ(next, first) << "another call has its place";
  acknowledge();
  EXPECT_EQ(calls.in_flight(), 1U);
  completion.complete(next, "{}");
}

TEST_F(stop_service_test, answers_a_call_with_too_long_an_id_without_it) {
  connection& peer = arrive();
  start();
  rowe::wire::request asked;
  asked.codec = peer.protocol->topics.id();
  const std::string id = '"' + std::string(rowe::service::call_id_bytes_max, 'x') + '"';
  asked.id_raw = id;
  stop.carry_out_call(peer, asked, stop_verb::stop);
  EXPECT_FALSE(look(false)) << "it stops all the same";
  acknowledge();
  const std::string answer = arrived(peer);
  EXPECT_TRUE(observed(answer));
  EXPECT_EQ(answer.find("xxx"), answer.npos);
}

TEST_F(stop_service_test, looks_often_at_first_and_then_less_while_somebody_waits) {
  EXPECT_EQ(stop.next_update(), rowe::rt::never) << "there is nothing to stop";
  connection& peer = arrive();
  start();
  ask(peer, "\"1\"");
  EXPECT_EQ(stop.next_update(), cycle.now + rowe::service::acknowledgment_rest_min);
  cycle.now += 4ms;
  EXPECT_EQ(stop.next_update(), cycle.now + 500us);
  cycle.now += 30ms;
  EXPECT_EQ(stop.next_update(), cycle.now + rowe::service::acknowledgment_rest_max);
  ask(peer, "\"2\"");
  EXPECT_EQ(stop.next_update(), cycle.now + rowe::service::acknowledgment_rest_min) << "for the newest";
  acknowledge();
  EXPECT_GT(stop.next_update(), cycle.now + rowe::service::acknowledgment_rest_max);
}

TEST_F(stop_service_test, has_places_for_so_many_loops_and_gives_them_back) {
  std::vector<rowe::service::pair_index> all;
  for (std::size_t i = 0; i <= stop_rules::loops_max; ++i)
    all.push_back(offer({.kind = rowe::detail::pair_kind::stop_latch, .name = "loop"}));
  for (std::size_t i = 0; i < stop_rules::loops_max; ++i) EXPECT_TRUE(stop.attach(all[i]));
  const rowe::status done = stop.attach(all.back());
  ASSERT_EQ(done.code(), rowe::errc::too_many_latches);
  EXPECT_EQ(done.error().limit, static_cast<std::int64_t>(stop_rules::loops_max));
  stop.detach(all.front());
  EXPECT_TRUE(stop.attach(all.back()));
}

TEST_F(stop_service_test, stops_the_loops_when_the_endpoint_closes) {
  stop.stop_all(); // there is nothing to stop yet
  EXPECT_EQ(rules.number(), stop_rules(options.stop, cycle.now, 1).number());
  start();
  stop.stop_all();
  EXPECT_FALSE(look());
}

} // namespace
} // namespace stop_service_test
