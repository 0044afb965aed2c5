// SPDX-License-Identifier: Apache-2.0
// The stop's messages: by both codecs, without any free slot, queue or place, and before everything else.
#include "core_fixtures.hpp"

#include <rowe/stop_latch.hpp>

#include <deque>
#include <optional>

namespace core_stop_service_test {
namespace {

using namespace harness;

// The answer's object in a rosbridge response, or of a published state.
std::string inside(const std::string& text) {
  for (const std::string_view name : {"values", "msg"})
    if (const std::string found = member(text, name); !found.empty()) return found;
  return text;
}

rowe::endpoint_options with_stop(bool unguarded = true) {
  rowe::endpoint_options options = small_options();
  options.stop.unguarded = unguarded;
  return options;
}

struct stopping : core_test {
  explicit stopping(const rowe::endpoint_options& options = with_stop()) : core_test{options} {
    latch = on.open<rowe::stop_latch>(rowe::detail::latch_request({.name = "base"}));
  }

  // A cycle of the loop, then one of the service thread.
  bool look(bool acknowledges = true) {
    const bool engaged = latch->engaged(on.now);
    if (engaged && acknowledges) latch->acknowledge(on.now);
    on.cycle();
    return !engaged;
  }
  // As an operator would: names what the state says.
  std::string reset(peer& by) {
    by.tell(R"({"op":"call_service","id":"s","service":"/rowe/stop/state"})");
    const std::string state = answer_in(by.hear(), "s");
    return member(
        answer_in(by.ask(R"({"op":"call_service","id":"r","service":"/rowe/stop/reset","args":{"number":)" +
                         member(state, "number") + R"(,"tick":)" + member(state, "tick") + "}}"),
                  "r"),
        "refused");
  }
  static std::string answer_in(const texts& heard, const std::string& id) {
    for (const std::string& text : heard)
      if (member(text, "id") == '"' + id + '"') return inside(text);
    return {};
  }
  void start(peer& by) {
    look();
    ASSERT_EQ(reset(by), "null");
    ASSERT_TRUE(look());
    (void)by.hear();
  }
  // An operator who has started the loop.
  peer& started() {
    peer& by = at_work.emplace_back(on);
    start(by);
    return by;
  }

  std::optional<rowe::stop_latch> latch;
  std::deque<peer> at_work;
};

struct stopping_guarded : stopping {
  stopping_guarded() : stopping{with_stop(false)} {}
};

constexpr const char* stop_call =
    R"({"op":"call_service","id":"1","service":"/rowe/stop","args":{"source":"hand"}})";

TEST_F(stopping, is_answered_when_the_loop_has_acknowledged_in_rosbridge) {
  peer& operator_ = started();
  operator_.tell(stop_call);
  EXPECT_TRUE(operator_.hear().empty()); // not acknowledged yet
  EXPECT_FALSE(look());
  const std::string heard = only(operator_.hear());
  EXPECT_EQ(member(heard, "id"), "\"1\"");
  EXPECT_EQ(member(heard, "result"), "true");
  const std::string answer = inside(heard);
  EXPECT_EQ(member(answer, "state"), "\"stopped\"");
  EXPECT_EQ(member(answer, "cause"), "\"request\"");
  EXPECT_EQ(member(answer, "source"), "\"hand\"");
  EXPECT_NE(member(answer, "accepted_ns"), "null");
  EXPECT_NE(member(answer, "observed_ns"), "null");
}

TEST_F(stopping, is_answered_in_plain) {
  peer& operator_ = started();
  operator_.tell(R"({"service":"/rowe/stop","message_id":7})");
  look();
  const std::string heard = only(operator_.hear());
  EXPECT_EQ(member(heard, "in_reply_to"), "7");
  EXPECT_EQ(member(heard, "state"), "\"stopped\"");
  EXPECT_EQ(member(heard, "source"), "\"127.0.0.1:50000\"");
}

TEST_F(stopping, is_answered_with_null_when_no_loop_acknowledges_in_time) {
  peer& operator_ = started();
  EXPECT_TRUE(operator_.ask(stop_call, 40).empty());
  const std::string heard = only(operator_.hear_after(15));
  EXPECT_EQ(member(inside(heard), "observed_ns"), "null");
  EXPECT_EQ(member(inside(heard), "state"), "\"stopped\"");
}

TEST_F(stopping, is_answered_as_observed_though_others_stop_more_often_than_the_loop_looks) {
  peer operator_{on};
  peer other{on};
  start(operator_);
  operator_.tell(stop_call);
  ASSERT_TRUE(latch->engaged(on.now));
  latch->acknowledge(on.now);
  other.tell(R"({"service":"/rowe/stop","source":"other"})");
  const std::string heard = only(operator_.hear());
  EXPECT_NE(member(inside(heard), "observed_ns"), "null");
}

TEST_F(stopping, takes_a_publish_and_a_plain_message_without_an_id_too) {
  for (const char* text : {R"({"op":"publish","topic":"/rowe/stop","msg":{"source":"joystick"}})",
                           R"({"service":"/rowe/stop","source":"joystick"})", R"({"service":"rowe/stop"})"}) {
    peer& operator_ = started();
    operator_.tell(text);
    EXPECT_FALSE(look()) << text;
    EXPECT_TRUE(operator_.hear().empty()) << text;
    operator_.leave();
    on.cycle();
  }
}

TEST_F(stopping, needs_no_slot_no_queue_and_no_place_for_a_call) {
  peer& operator_ = started();
  // All calls are in flight, all slots are held by a peer that does not read.
  const auto pair = [&] {
    rowe::detail::pair_request asked{.kind = rowe::detail::pair_kind::respond_text, .name = "/slow"};
    asked.in_depth = 64;
    asked.out_depth = 128;
    asked.in_bytes = asked.out_bytes = 64;
    return &on.offer(asked);
  }();
  on.cycle();
  peer busy{on};
  for (int i = 0; i < 20; ++i)
    busy.say(R"({"op":"call_service","id":")" + std::to_string(i) + R"(","service":"/slow"})");
  on.cycle();
  peer deaf{on};
  on.net.link_of(deaf.id()).capacity_bytes = 0;
  for (int topic = 0; topic < 8; ++topic)
    deaf.say(R"({"op":"call_service","id":")" + std::to_string(topic) + R"(","service":"/rosapi/topics"})");
  for (int i = 0; i < 400; ++i) deaf.say(R"({"op":"call_service","service":"/rosapi/topics"})");
  on.cycles(3);
  operator_.tell(stop_call);
  EXPECT_FALSE(look());
  EXPECT_EQ(operator_.hear().size(), 1U);
  (void)pair;
}

TEST_F(stopping, is_written_before_everything_that_waits_for_the_same_peer) {
  peer& operator_ = started();
  rowe::detail::queue_pair& pose_pair = advertise_pose(on);
  operator_.tell(R"({"op":"subscribe","topic":"/pose"})");
  on.net.link_of(operator_.id()).capacity_bytes = 10; // a frame is begun, the rest waits
  for (int i = 0; i < 10; ++i) (void)publish(on, pose_pair, {1.0 * i, 0});
  on.cycle();
  operator_.tell(stop_call);
  look();
  on.net.link_of(operator_.id()).capacity_bytes = SIZE_MAX;
  const auto heard = operator_.hear_after(1);
  ASSERT_EQ(heard.size(), 11U);
  EXPECT_EQ(heard[0], message(0)); // was begun
  EXPECT_EQ(member(heard[1], "op"), "\"service_response\"");
}

TEST_F(stopping, frames_stay_whole_however_the_socket_takes_them) {
  peer& operator_ = started();
  (void)operator_.ask(R"({"op":"subscribe","topic":"/rowe/stop/state"})");
  std::size_t answers = 0;
  for (int i = 0; i < 300; ++i) {
    on.net.link_of(operator_.id()).capacity_bytes = static_cast<std::size_t>(i % 37);
    if (i % 5 == 0) operator_.say(stop_call);
    if (i % 7 == 0) operator_.send(rowe::wire::opcode::ping, "are you there?");
    look();
    for (const std::string& text : operator_.hear()) answers += member(text, "op") == "\"service_response\"";
  }
  on.net.link_of(operator_.id()).capacity_bytes = SIZE_MAX;
  on.cycles(60);
  for (const std::string& text : operator_.hear()) answers += member(text, "op") == "\"service_response\"";
  EXPECT_EQ(operator_.violated, "");
  EXPECT_EQ(answers + on.count(counter::stop_answers_lost), 60U);
  EXPECT_GT(operator_.pongs, 0);
}

TEST_F(stopping, state_is_shown_on_change_and_every_tenth_tick) {
  peer watcher{on};
  peer operator_{on};
  watcher.tell(R"({"op":"subscribe","topic":"/rowe/stop/state"})");
  auto heard = watcher.hear();
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(member(inside(heard[0]), "cause"), "\"start\"");
  start(operator_);
  heard = watcher.hear();
  ASSERT_GE(heard.size(), 2U); // acknowledged, running
  EXPECT_EQ(member(inside(heard.back()), "state"), "\"running\"");
  for (int i = 0; i < 1000; ++i) look();
  EXPECT_NEAR(static_cast<double>(watcher.hear().size()), 5, 1);
  operator_.tell(stop_call);
  heard = watcher.hear();
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(member(inside(heard[0]), "source"), "\"hand\"");
}

TEST_F(stopping, state_is_shown_at_once_to_a_page_that_comes_later_and_then_as_often_as_to_others) {
  const std::string subscribe = R"({"op":"subscribe","topic":"/rowe/stop/state"})";
  std::vector<peer> pages;
  for (int i = 0; i < 5; ++i) {
    pages.emplace_back(on).say(subscribe);
    on.cycle(17ms);
    EXPECT_EQ(pages.back().hear().size(), 1U);
  }
  for (peer& page : pages) (void)page.hear();
  on.cycles(1000);
  for (peer& page : pages) EXPECT_NEAR(static_cast<double>(page.hear().size()), 5, 1);
}

TEST_F(stopping, answers_come_in_the_order_in_which_stops_were_asked_for) {
  std::vector<peer> operators;
  std::string order;
  for (int i = 0; i < 6; ++i) operators.emplace_back(on);
  on.cycle();
  for (int i = 0; i < 6; ++i) {
    operators[static_cast<std::size_t>(i)].say(stop_call);
    on.cycle();
  }
  for (int ms = 0; ms < 60; ++ms) {
    on.cycle();
    for (std::size_t i = 0; i < operators.size(); ++i)
      if (!answer_in(operators[i].hear(), "1").empty()) order += static_cast<char>('0' + i);
  }
  EXPECT_EQ(order, "012345");
}

TEST_F(stopping, state_reaches_subscribers_of_this_process) {
  peer operator_{on};
  rowe::detail::queue_pair& inbox =
      on.offer_now(rowe::detail::pair_kind::subscribe_text, "/rowe/stop/state", 2560, {.depth = 16});
  start(operator_);
  std::string last;
  while (const auto text = take(inbox)) last = *text;
  EXPECT_EQ(member(last, "state"), "\"running\"");
}

TEST_F(stopping, number_is_raised_by_a_second_source_so_that_an_old_reset_fails) {
  peer a{on}, b{on, rowe::service::side::server, "127.0.0.1:50001"};
  start(a);
  a.tell(stop_call);
  look();
  const std::string seen = member(inside(a.hear().back()), "number");
  b.tell(R"({"op":"call_service","service":"/rowe/stop","args":{"source":"other"}})");
  look();
  a.tell(R"({"op":"call_service","service":"/rowe/stop/state"})");
  const std::string tick = member(inside(a.hear().back()), "tick");
  EXPECT_EQ(member(inside(a.ask(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":)" +
                                seen + R"(,"tick":)" + tick + "}}")
                              .back()),
                   "refused"),
            "\"number\"");
  EXPECT_EQ(on.count(counter::stop_refusals), 1U);
}

TEST_F(stopping, takes_members_of_wrong_types_as_missing) {
  peer& operator_ = started();
  operator_.tell(R"({"op":"call_service","service":"/rowe/stop","args":{"source":7,"reason":[1]}})");
  EXPECT_FALSE(look());
  operator_.say(R"({"op":"call_service","service":"/rowe/stop","args":[1,2]})");
  operator_.say(R"({"op":"call_service","service":"/rowe/stop/reset","args":{"number":"1","tick":1.5}})");
  operator_.say(R"({"op":"call_service","service":"/rowe/stop/guard","args":{"guard":5}})");
  operator_.say(R"({"op":"call_service","service":"/rowe/stop/guard"})");
  const auto heard = operator_.hear_after(1);
  ASSERT_GE(heard.size(), 4U);
  EXPECT_EQ(member(inside(heard[heard.size() - 3]), "refused"), "\"number\"");
  EXPECT_EQ(member(inside(heard[heard.size() - 2]), "refused"), "\"name\"");
  EXPECT_EQ(member(inside(heard[heard.size() - 1]), "refused"), "\"name\"");
}

// Names that a request is known by lie unescaped beside each other while it is carried out; what is read from
// its arguments must not be written over them.
TEST_F(stopping, answers_by_the_id_it_was_asked_with_however_long_its_source_is) {
  std::string quotes;
  for (int i = 0; i < 150; ++i) quotes += "\\\"";
  peer operator_{on};
  for (const std::string_view service : {"/rowe/stop#first", "/rowe/stop/guard#second"}) {
    operator_.tell(R"({"op":"call_service","service":")" + std::string{service} + R"(","args":{"source":")" +
                   quotes + R"(","guard":")" + quotes + R"(","reason":")" + quotes + "\"}}");
    look();
    const std::string heard = only(operator_.hear());
    EXPECT_TRUE(on.validator.validate(heard)) << heard;
    EXPECT_EQ(member(heard, "id"), '"' + std::string{service.substr(service.find('#') + 1)} + '"');
  }
}

TEST_F(stopping, refuses_by_the_id_it_was_asked_with_though_the_stop_in_it_is_carried_out) {
  std::string quotes;
  for (int i = 0; i < 150; ++i) quotes += "\\\"";
  peer& operator_ = started();
  operator_.tell(R"({"op":"call_service","service":"/rowe/stop#seven","timeout":"x","source":")" + quotes +
                 "\"}");
  EXPECT_FALSE(look());
  const std::string heard = only(operator_.hear());
  EXPECT_TRUE(on.validator.validate(heard)) << heard;
  EXPECT_EQ(member(heard, "id"), "\"seven\"");
  EXPECT_TRUE(has(heard, "call_service"));
}

TEST_F(stopping, is_carried_out_whatever_else_is_wrong_with_its_request) {
  for (const char* text :
       {R"({"service":"/rowe/stop","message_id":12.5})", R"({"service":"/rowe/stop","ttl_ms":-1})",
        R"({"op":"call_service","service":"/rowe/stop","timeout":"x"})",
        R"({"op":7,"service":"/rowe/stop"})"}) {
    peer& operator_ = started();
    operator_.tell(text);
    EXPECT_FALSE(look()) << text;
    EXPECT_EQ(operator_.hear().size(), 1U) << text; // what was wrong
    operator_.leave();
    on.cycle();
  }
}

TEST_F(stopping, of_one_peer_does_not_keep_others_from_waiting_for_their_answer) {
  peer noisy{on};
  peer operator_{on, rowe::service::side::server, "127.0.0.1:50001"};
  start(operator_);
  for (int i = 0; i < 100; ++i) noisy.say(R"({"service":"/rowe/stop","message_id":1})");
  operator_.say(stop_call);
  on.cycles(2, 10us);
  look();
  const std::string heard = only(operator_.hear());
  EXPECT_NE(member(inside(heard), "observed_ns"), "null");
}

// A thread of this process: its side of the two windows.
struct local_thread {
  core_harness& on;
  rowe::service::local_stop_asked asked{};
  rowe::service::local_stop_answered heard{};

  void stop(std::string_view source, std::string_view reason = {}) {
    ++asked.stops;
    ASSERT_TRUE(asked.source.assign(source) && asked.reason.assign(reason));
    on.shared.stops.write_request(asked);
    on.shared.stops.request();
  }
  void reset(std::uint64_t number = 0, rowe::rt::time_point until = rowe::rt::never) {
    ++asked.resets;
    asked.number = number;
    asked.count_before_reset = on.shared.stops.count();
    asked.until = until;
    on.shared.stops.write_request(asked);
  }
  const rowe::service::local_stop_answered& hear() {
    on.shared.stops.read_answers(heard);
    return heard;
  }
  // How its last reset has ended when the core has done so many cycles more.
  std::string end_of_reset(int cycles) {
    on.cycles(cycles);
    if (hear().resets != asked.resets) return "waits";
    return heard.reset_outcome ? "done" : std::string{heard.reset_outcome.error().name()};
  }
};

TEST_F(stopping, asked_for_by_this_process_is_answered_when_the_loop_has_acknowledged) {
  (void)started();
  local_thread thread{on};
  thread.stop("button", "smoke");
  on.cycle();
  EXPECT_EQ(thread.hear().stops, 0U);
  EXPECT_FALSE(look());
  EXPECT_EQ(thread.hear().stops, 1U);
  EXPECT_GT(thread.heard.acknowledged, on.now - 2ms);
  thread.stop("button"); // a repeat: the loop stands already
  on.cycle();
  EXPECT_EQ(thread.hear().stops, 2U);
}

TEST_F(stopping, asked_for_by_this_process_twice_is_answered_at_once_for_both) {
  (void)started();
  local_thread thread{on};
  thread.stop("one");
  thread.stop("other");
  on.cycle();
  EXPECT_FALSE(look());
  EXPECT_EQ(thread.hear().stops, 2U);
}

TEST_F(stopping, words_that_come_behind_it_are_shown) {
  peer& operator_ = started();
  local_thread thread{on};
  on.shared.stops.request();
  on.cycle();
  EXPECT_FALSE(look());
  EXPECT_EQ(thread.hear().stops, 0U);
  thread.stop("late");
  on.cycle();
  EXPECT_FALSE(look());
  EXPECT_EQ(thread.hear().stops, 1U);
  operator_.tell(R"({"op":"call_service","id":"s","service":"/rowe/stop/state"})");
  EXPECT_EQ(member(answer_in(operator_.hear(), "s"), "source"), "\"late\"");
}

TEST_F(stopping, does_not_go_on_looking_for_an_answer_that_nobody_waits_for) {
  (void)started();
  local_thread thread{on};
  thread.stop("button");
  on.cycle();
  EXPECT_LE(on.next_wake, on.now + 1ms); // a loop cannot wake anybody
  on.cycles(60);
  EXPECT_GT(on.next_wake, on.now + 1ms);
  EXPECT_EQ(thread.hear().stops, 0U);
}

TEST_F(stopping, is_reset_by_this_process_when_the_loop_has_acknowledged) {
  local_thread thread{on};
  thread.reset();
  EXPECT_EQ(thread.end_of_reset(1), "waits");
  look();
  EXPECT_EQ(thread.end_of_reset(1), "done");
  EXPECT_TRUE(look());
  thread.reset(); // it moves
  EXPECT_EQ(thread.end_of_reset(1), "done");
}

// Rule 7 of docs/stop.md: a reset is for the requests to stop that came before it, and for no other.
TEST_F(stopping, asked_for_once_more_ends_a_reset_of_this_process_that_waits) {
  peer& operator_ = started();
  operator_.tell(stop_call);
  local_thread thread{on};
  thread.reset();
  EXPECT_EQ(thread.end_of_reset(3), "waits") << "the loop has not acknowledged";
  operator_.say(stop_call); // a repeat: the stop keeps its number
  EXPECT_EQ(thread.end_of_reset(1), "refused");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(look());
  thread.reset(); // one that came behind it
  on.cycles(2);
  EXPECT_TRUE(look());
}

TEST_F(stopping, is_not_reset_by_this_process_while_peers_are_told_that_the_endpoint_closes) {
  peer operator_{on}; // it does not answer the close frame, so the cycles go on
  start(operator_);
  local_thread thread{on};
  on.core.close_all(on.now);
  thread.reset();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(look());
  EXPECT_EQ(thread.end_of_reset(0), "closed");
}

TEST_F(stopping, is_answered_to_this_process_also_where_a_reset_comes_with_the_acknowledgment) {
  (void)started();
  local_thread thread{on};
  thread.stop("button");
  on.cycle();
  EXPECT_TRUE(latch->engaged(on.now));
  latch->acknowledge(on.now);
  const auto acknowledged = on.now;
  thread.reset();
  EXPECT_EQ(thread.end_of_reset(1), "done");
  EXPECT_EQ(thread.heard.stops, 1U);
  EXPECT_EQ(thread.heard.acknowledged, acknowledged);
  EXPECT_EQ(thread.heard.reset_number, thread.heard.stop_number + 1);
  EXPECT_TRUE(look());
}

TEST_F(stopping, is_not_reset_by_this_process_too_late) {
  local_thread thread{on};
  thread.reset(0, on.now + 5ms);
  EXPECT_EQ(thread.end_of_reset(10), "timed_out");
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(look());
}

TEST_F(stopping, is_not_reset_by_this_process_when_another_one_came) {
  peer operator_{on};
  local_thread thread{on};
  thread.reset();
  on.cycle();
  operator_.tell(stop_call);
  EXPECT_EQ(thread.end_of_reset(1), "refused");
  EXPECT_FALSE(look());
  EXPECT_FALSE(look());
}

// Rule 7: who repeats himself wants it stopped now, and the reset was asked for before.
TEST_F(stopping, is_not_reset_by_this_process_when_it_was_asked_for_again_meanwhile) {
  peer operator_ = peer_saying(on, stop_call);
  local_thread thread{on};
  thread.reset();
  on.cycle(); // the loop has yet to acknowledge
  operator_.tell(stop_call);
  EXPECT_FALSE(look());
  EXPECT_EQ(thread.end_of_reset(3), "refused");
  EXPECT_FALSE(look());
  thread.reset(); // now that this is known
  EXPECT_EQ(thread.end_of_reset(3), "done");
  EXPECT_TRUE(look());
}

TEST_F(stopping, is_not_reset_by_this_process_that_asked_for_it_afterwards) {
  local_thread thread{on};
  thread.stop("bumper");
  on.cycle();
  EXPECT_FALSE(look());
  thread.reset();
  thread.stop("bumper"); // by another thread, before the service thread looks
  on.cycle();
  EXPECT_FALSE(look());
  EXPECT_EQ(thread.end_of_reset(3), "refused");
  EXPECT_FALSE(look());
}

// Their words are still to come. One was asked for before the reset, and one behind it.
TEST_F(stopping, is_not_reset_by_this_process_where_a_stop_without_words_comes_behind_it) {
  local_thread thread{on};
  on.cycle();
  EXPECT_FALSE(look());
  on.shared.stops.request();
  thread.stop("button");
  thread.reset();
  on.shared.stops.request();
  EXPECT_EQ(thread.end_of_reset(1), "refused");
  EXPECT_FALSE(look());
}

TEST_F(stopping, is_reset_by_this_process_where_a_stop_without_words_came_before) {
  local_thread thread{on};
  on.cycle();
  EXPECT_FALSE(look());
  on.shared.stops.request();
  thread.reset();
  for (int i = 0; i < 4; ++i) {
    on.cycle();
    look();
  }
  EXPECT_EQ(thread.end_of_reset(0), "done");
  EXPECT_TRUE(look());
}

TEST_F(stopping_guarded, is_not_reset_by_this_process_without_a_guard) {
  local_thread thread{on};
  look();
  thread.reset();
  EXPECT_EQ(thread.end_of_reset(2), "refused");
  EXPECT_FALSE(look());
}

TEST_F(stopping, shows_a_change_in_the_cycle_in_which_it_happens) {
  peer watcher{on};
  peer operator_{on, rowe::service::side::server, "127.0.0.1:50001"};
  start(operator_);
  EXPECT_EQ(watcher.ask(R"({"op":"subscribe","topic":"/rowe/stop/state"})").size(), 1U);
  operator_.tell(stop_call);
  EXPECT_EQ(watcher.hear().size(), 1U);
  look();
  (void)watcher.hear();
  ASSERT_EQ(reset(operator_), "null");
  EXPECT_EQ(member(inside(watcher.hear().back()), "state"), "\"running\"");
}

TEST_F(stopping, is_never_refused_for_too_many_that_wait) {
  peer& operator_ = started();
  for (int i = 0; i < 100; ++i) {
    operator_.say(R"({"service":"/rowe/stop","message_id":)" + std::to_string(i) + "}");
    on.cycle(10us);
  }
  look();
  std::size_t answered = 0;
  for (const std::string& text : operator_.hear()) answered += member(text, "state") == "\"stopped\"";
  EXPECT_EQ(answered + on.count(counter::stop_answers_lost), 100U);
  EXPECT_GE(answered, 10U);
}

TEST_F(stopping_guarded, guard_keeps_it_moving_by_echoing_ticks_and_stops_it_by_leaving) {
  peer page{on};
  look();
  page.tell(R"({"op":"subscribe","topic":"/rowe/stop/state"})");
  const auto echo = [&] {
    for (const std::string& text : page.hear()) {
      if (member(text, "op") != "\"publish\"") continue;
      page.say(
          R"({"op":"call_service","id":"l","service":"/rowe/stop/guard","args":{"guard":"page","tick":)" +
          member(inside(text), "tick") + "}}");
    }
  };
  echo();
  on.cycle();
  EXPECT_EQ(reset(page), "null");
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(look() || i < 2) << i;
    echo();
  }
  page.leave();
  on.cycle();
  EXPECT_TRUE(latch->engaged(on.now));
}

TEST_F(stopping_guarded, guard_stops_it_by_sending_a_close_frame) {
  peer page{on};
  look();
  page.say(R"({"service":"/rowe/stop/guard","guard":"g","tick":)" +
           member(page.ask(R"({"service":"/rowe/stop/guard","guard":"g","message_id":1})").back(), "tick") +
           R"(,"message_id":1})");
  on.cycle();
  ASSERT_EQ(reset(page), "null");
  ASSERT_TRUE(look());
  const std::string_view normal{"\x03\xe8", 2};
  page.send(rowe::wire::opcode::close, normal); // and keeps its side of the stream open
  on.cycle();
  EXPECT_TRUE(latch->engaged(on.now));
}

TEST_F(stopping_guarded, guard_is_told_the_newest_tick_by_each_answer) {
  peer page{on};
  look();
  std::string tick = "0";
  int granted = 0;
  for (int i = 0; i < 100; ++i) {
    page.say(R"({"service":"/rowe/stop/guard","guard":"plain","tick":)" + tick + R"(,"message_id":1})");
    look();
    const std::string heard = only(page.hear());
    tick = member(heard, "tick");
    granted += member(heard, "refused") == "null";
    EXPECT_EQ(member(heard, "timeout_ms"), "500");
  }
  EXPECT_EQ(granted, 99); // all but the first, which had no tick
}

TEST(stopping_client, is_shown_and_answered_to_a_server_with_masked_frames) {
  core_harness on{with_stop(), rowe::service::side::client};
  auto latch = on.open<rowe::stop_latch>(rowe::detail::latch_request({}));
  peer server{on, rowe::service::side::client};
  (void)server.hear_after(1);
  (void)latch.engaged(on.now);
  server.tell(R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
  (void)latch.engaged(on.now);
  latch.acknowledge(on.now);
  const std::string heard = only(server.hear_after(1));
  EXPECT_EQ(server.violated, "");
  EXPECT_NE(member(inside(heard), "observed_ns"), "null");
}

TEST(stopping_hop, is_shown_to_programs_that_know_no_topics) {
  rowe::endpoint_options options = with_stop();
  options.profile = rowe::websocket_profile::hop;
  core_harness on{options};
  (void)on.offer(rowe::detail::latch_request({}));
  peer hop{on};
  (void)hop.hear_after(1);
  const auto heard = hop.hear_after(1000);
  EXPECT_NEAR(static_cast<double>(heard.size()), 5, 1);
  EXPECT_EQ(member(heard.back(), "state"), "\"stopped\"");
}

TEST(stopping_without_a_latch, is_no_service) {
  core_harness on{with_stop()};
  peer operator_{on};
  const std::string heard = only(operator_.ask(stop_call));
  EXPECT_EQ(member(heard, "result"), "false");
}

TEST_F(stopping, is_an_event_however_many_statuses_peers_send) {
  peer& operator_ = started();
  while (on.shared.try_event()) continue;
  for (std::uint32_t i = 0; i < on.options.limits.events_max; ++i) {
    peer says{on};
    for (int n = 0; n < 8; ++n) says.say(R"({"op":"status","level":"info","msg":"x"})");
    look();
    look();
    says.leave();
    look();
  }
  operator_.say(stop_call);
  look();
  std::size_t told = 0;
  while (const auto one = on.shared.try_event()) told += one->what_kind == rowe::event::kind::stop;
  EXPECT_EQ(told, 1U);
}

} // namespace
} // namespace core_stop_service_test
