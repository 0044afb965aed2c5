// SPDX-License-Identifier: Apache-2.0
// Services and calls through the core: every way from an asker to a provider and back, and every way a call
// ends. The handles are real ones, on queue pairs without threads.
#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/responder.hpp>

#include "core_fixtures.hpp"

#include <deque>

struct addends {
  std::int64_t a, b;
};
struct sum {
  std::int64_t sum;
};
template <>
inline constexpr auto rowe::schema<addends> = rowe::fields<&addends::a, &addends::b>{};
template <>
inline constexpr auto rowe::schema<sum> = rowe::fields<&sum::sum>{};

namespace core_calls_test {
namespace {

using namespace harness;
using rowe::errc;
using rowe::detail::pair_kind;
using rowe::detail::pair_request;

rowe::lane open_lane(core_harness& on) {
  pair_request asked = lane_request(12, 512);
  asked.completions_depth = 4;
  return on.open<rowe::lane>(asked);
}
using add_responder = rowe::responder<addends, sum>;
using add_caller = rowe::caller<addends, sum>;

pair_request serve_add(std::string_view name = "/add") {
  return {.kind = pair_kind::respond_value,
          .name = name,
          .type = "test/Add",
          .out_depth = 8,
          .in_depth = 4,
          .out_bytes = 192,
          .in_bytes = sizeof(addends),
          .encoded = &rowe::describe<sum>(),
          .decoded = &rowe::describe<addends>()};
}
pair_request call_add() {
  return {.kind = pair_kind::call_value,
          .name = "/add",
          .out_depth = 4,
          .completions_depth = 4,
          .out_bytes = sizeof(addends),
          .completions_bytes = 192,
          .encoded = &rowe::describe<addends>(),
          .decoded = &rowe::describe<sum>()};
}

// The value of a string member in a text of the test's own making.
std::string member(const std::string& text, const std::string& name) {
  const auto at = text.find("\"" + name + "\":\"");
  if (at == std::string::npos) return {};
  const auto from = at + name.size() + 4;
  return text.substr(from, text.find('"', from) - from);
}

struct core_calls : core_test {
  core_calls() : core_test{room_for_calls()} {}
  static rowe::endpoint_options room_for_calls() {
    return with_limits(small_options(), &limits::calls_max, 24); // one peer may have four
  }
  void answer_one(add_responder& by) {
    auto asked = by.try_next(on.now);
    ASSERT_TRUE(asked) << asked.error().name();
    EXPECT_TRUE(by.reply(*asked, {asked->value().a + asked->value().b}, on.now));
  }
  // A program that takes plain messages, and the lane that has had its first.
  peer& program_on(rowe::lane& lane) {
    peer& program = programs.emplace_back(on);
    program.tell("{}");
    EXPECT_TRUE(lane.try_receive(on.now));
    return program;
  }
  std::deque<peer> programs;
};

// ---- peers ask, this process answers

TEST_F(core_calls, answers_a_call_of_rosbridge) {
  auto add = on.open<add_responder>(serve_add());
  peer page = peer_saying(
      on, R"({"op":"call_service","id":"call_service:/add:1","service":"\/add","args":{"a":38,"b":4}})");
  answer_one(add);
  EXPECT_EQ(page.hear_after(1),
            texts{R"({"op":"service_response","id":"call_service:/add:1","service":"/add","result":true,)"
                  R"("values":{"sum":42}})"});
  EXPECT_EQ(on.count(counter::calls_in), 1U);
}

TEST_F(core_calls, answers_a_plain_invocation_and_echoes_its_id_as_it_stood_there) {
  auto add = on.open<add_responder>(serve_add("add-two-numbers"));
  peer program{on};
  for (const std::string id : {R"("x\u0041")", "17", "-3"}) {
    program.tell(R"({"service":"add-two-numbers","a":38,"b":4,"message_id":)" + id + "}");
    answer_one(add);
    EXPECT_EQ(program.hear_after(1), texts{R"({"sum":42,"in_reply_to":)" + id + "}"});
  }
}

// Between two cycles, as the loop of a thread does that never sleeps.
TEST_F(core_calls, awaits_the_answer_of_a_handle_that_was_given_a_call_and_writes_it) {
  auto add = on.open<add_responder>(serve_add());
  peer page{on};
  on.cycle();
  EXPECT_FALSE(on.core.awaits_answer());
  page.tell(R"({"op":"call_service","service":"/add","args":{"a":1,"b":1}})");
  EXPECT_TRUE(on.core.awaits_answer());
  EXPECT_FALSE(on.core.has_answer());
  answer_one(add);
  EXPECT_TRUE(on.core.has_answer());
  on.core.write_answer(on.now);
  EXPECT_EQ(page.hear(),
            texts{R"({"op":"service_response","service":"/add","result":true,"values":{"sum":2}})"});
  EXPECT_FALSE(on.core.awaits_answer());
}

TEST_F(core_calls, awaits_nothing_of_a_handle_that_is_gone_or_was_not_given_the_call) {
  auto& pair = on.offer_now(serve_add());
  peer page = peer_saying(on, R"({"op":"call_service","service":"/add","args":{"a":"1"}})");
  EXPECT_FALSE(on.core.awaits_answer());
  page.say(R"({"op":"call_service","service":"/add","args":{"a":1,"b":1}})");
  pair.lifecycle.close();
  on.cycle();
  EXPECT_FALSE(on.core.awaits_answer());
  EXPECT_FALSE(on.core.has_answer());
}

TEST_F(core_calls, finds_a_service_with_and_without_its_slash) {
  auto add = on.open<add_responder>(serve_add());
  peer page = peer_saying(on, R"({"op":"call_service","service":"add","args":{"a":1,"b":1}})");
  answer_one(add);
  EXPECT_EQ(page.hear_after(1),
            texts{R"({"op":"service_response","service":"add","result":true,"values":{"sum":2}})"});
}

TEST_F(core_calls, refuses_arguments_that_are_not_what_the_service_reads) {
  auto add = on.open<add_responder>(serve_add());
  peer page{on};
  page.say(R"({"op":"call_service","id":1,"service":"/add","args":{"a":"38","b":4}})");
  page.say(R"({"op":"call_service","id":2,"service":"/add","args":{"a":38}})");
  page.say(R"({"op":"call_service","id":3,"service":"/add"})");
  on.cycle();
  EXPECT_EQ(add.try_next(on.now).code(), errc::empty);
  const auto heard = page.hear();
  ASSERT_EQ(heard.size(), 3U);
  for (const auto& one : heard) EXPECT_TRUE(has(one, R"("result":false,"values":")"));
  EXPECT_TRUE(has(heard[0], R"(the member \"a\" must be a whole number)"));
  EXPECT_TRUE(has(heard[0], R"(it is \"38\")"));
  EXPECT_TRUE(has(heard[1], R"(the member \"b\" is missing)"));
  // A call without args comes in a buffer of the core's own.
  EXPECT_TRUE(has(heard[2], R"(the member \"a\" is missing)"));
  EXPECT_EQ(on.count(counter::undecodable), 3U);
}

TEST_F(core_calls, refuses_at_once_what_nobody_provides) {
  peer page{on};
  page.say(R"({"op":"call_service","id":"1","service":"/nope"})");
  page.say(R"({"service":"nope","message_id":2})");
  EXPECT_EQ(page.hear_after(1),
            (texts{R"({"op":"service_response","id":"1","service":"/nope","result":false,)"
                   R"("values":"Service /nope does not exist"})",
                   R"({"error":{"code":"no_service","text":"Service nope does not exist"},)"
                   R"("in_reply_to":2})"}));
  EXPECT_EQ(on.count(counter::calls_refused), 2U);
}

TEST_F(core_calls, passes_a_refusal_on_with_its_diagnostic) {
  auto add = on.open<add_responder>(serve_add());
  peer page = peer_saying(on, R"({"op":"call_service","id":"1","service":"/add","args":{"a":1,"b":1}})");
  auto asked = add.try_next(on.now);
  ASSERT_TRUE(asked);
  EXPECT_TRUE(add.refuse(*asked, "the arm is out of reach", on.now));
  EXPECT_EQ(page.hear_after(1), texts{R"({"op":"service_response","id":"1","service":"/add","result":false,)"
                                      R"("values":"the arm is out of reach"})"});
}

TEST_F(core_calls, refuses_for_a_responder_that_forgets_a_request) {
  auto add = on.open<add_responder>(serve_add());
  peer page = peer_saying(on, R"({"op":"call_service","id":"1","service":"/add","args":{"a":1,"b":1}})");
  ASSERT_TRUE(add.try_next(on.now)); // and lets go of it
  const std::string heard = only(page.hear_after(1));
  EXPECT_TRUE(has(heard, R"("result":false)"));
}

TEST_F(core_calls, says_that_a_service_is_busy_when_its_places_are_taken) {
  on.cycle();
  auto add = on.open<add_responder>(serve_add());
  peer one{on}, two{on};
  for (int i = 0; i < 4; ++i) {
    one.say(R"({"op":"call_service","id":)" + std::to_string(i) +
            R"(,"service":"/add","args":{"a":1,"b":1}})");
  }
  const auto told = one.hear_after(1);
  ASSERT_EQ(told.size(), 1U) << "one place is left for others";
  EXPECT_TRUE(has(told[0], "busy"));
  for (const char* id : {"x", "y"}) {
    two.tell(R"({"op":"call_service","id":")" + std::string{id} +
             R"(","service":"/add","args":{"a":1,"b":1}})");
  }
  const std::string heard = only(two.hear());
  EXPECT_TRUE(has(heard, "busy"));
  EXPECT_TRUE(has(heard, R"("id":"y")"));
  for (int i = 0; i < 4; ++i) answer_one(add);
  on.cycle();
  EXPECT_EQ(one.hear().size(), 3U);
  EXPECT_EQ(two.hear().size(), 1U);
}

TEST_F(core_calls, bounds_the_calls_of_one_peer_and_refuses_an_id_twice) {
  auto pair = open_lane(on);
  peer program{on};
  program.say(R"({"service":"slow","message_id":0})");
  program.say(R"({"service":"slow","message_id":0})");
  for (int i = 1; i < 6; ++i) program.say(R"({"service":"slow","message_id":)" + std::to_string(i) + "}");
  const auto heard = program.hear_after(1);
  ASSERT_EQ(heard.size(), 3U);
  EXPECT_TRUE(has(heard[0], R"("code":"duplicate_id")"));
  EXPECT_TRUE(has(heard[1], R"("code":"busy")"));
  EXPECT_TRUE(has(heard[2], R"("in_reply_to":5)"));
  for (int i = 0; i < 4; ++i) {
    const auto asked = pair.try_receive(on.now);
    ASSERT_TRUE(asked);
    EXPECT_TRUE(pair.try_reply(*asked, R"({"done":true})", on.now));
  }
  EXPECT_EQ(program.hear_after(1).size(), 4U);
}

TEST_F(core_calls, tells_a_responder_that_the_one_who_asked_is_gone) {
  auto add = on.open<add_responder>(serve_add());
  auto page = std::make_unique<peer>(on);
  page->tell(R"({"op":"call_service","id":"1","service":"/add","args":{"a":1,"b":1}})");
  auto asked = add.try_next(on.now);
  ASSERT_TRUE(asked);
  page->leave();
  on.cycle();
  peer next{on}; // in the same place
  on.cycle();
  EXPECT_EQ(add.reply(*asked, {2}, on.now).code(), errc::peer_lost);
  EXPECT_EQ(next.hear_after(1), texts{});
}

TEST_F(core_calls, tells_an_asker_that_its_time_is_over_and_does_not_answer_twice) {
  auto add = on.open<add_responder>(serve_add());
  peer page = peer_saying(
      on, R"({"op":"call_service","id":"1","service":"/add","args":{"a":1,"b":1},"timeout":0.05})");
  auto asked = add.try_next(on.now);
  ASSERT_TRUE(asked);
  ASSERT_EQ(page.hear_after(60).size(), 1U);
  EXPECT_EQ(add.reply(*asked, {2}, on.now).code(), errc::expired);
  EXPECT_EQ(page.hear_after(1), texts{});
  EXPECT_EQ(on.count(counter::calls_timed_out), 1U);
}

TEST_F(core_calls, gives_calls_that_nobody_serves_to_whoever_receives_in_one_form) {
  auto pair = open_lane(on);
  peer page{on}, program{on};
  page.say(R"({"op":"call_service","id":"c","service":"/add","args":{"a":38,"b":4}})");
  program.say(R"({"service":"/add","a":1,"b":2,"message_id":"p"})");
  on.cycle();
  for (int i = 0; i < 2; ++i) {
    const auto asked = pair.try_receive(on.now);
    ASSERT_TRUE(asked);
    EXPECT_TRUE(asked->wants_reply());
    EXPECT_TRUE(asked->value().starts_with(R"({"service":"/add","a":)")) << asked->value();
    EXPECT_TRUE(has(asked->value(), R"("message_id":")")) << asked->value();
    EXPECT_TRUE(pair.try_reply(*asked, R"({"result":7})", on.now));
  }
  on.cycle();
  EXPECT_EQ(page.hear(), texts{R"({"op":"service_response","id":"c","service":"/add","result":true,)"
                               R"("values":{"result":7}})"});
  EXPECT_EQ(program.hear(), texts{R"({"result":7,"in_reply_to":"p"})"});
}

TEST_F(core_calls, takes_only_one_answer_to_a_call) {
  auto pair = open_lane(on);
  peer program = peer_saying(on, R"({"service":"x","message_id":1})");
  const auto asked = pair.try_receive(on.now);
  EXPECT_TRUE(pair.try_reply(*asked, "{}", on.now));
  (void)pair.try_reply(*asked, "{}", on.now); // whether the handle notices is its own test
  EXPECT_EQ(program.hear_after(1).size(), 1U);
}

// ---- what a thread that waits learns of its reply

struct replying : core_test {
  replying() { (void)on.inbox.try_receive(on.now); } // from now on the shared inbox takes calls
  rowe::detail::call_ref next_call() {
    const auto slot = on.inbox.try_receive(on.now);
    if (!slot) return {};
    const rowe::detail::call_ref asked = on.inbox.header(*slot).call;
    on.inbox.release(*slot);
    return asked;
  }
  std::uint32_t reply(rowe::detail::call_ref to, std::string_view text, rowe::duration ttl = -1ns) {
    const auto slot = on.submissions.submit({.what = rowe::detail::entry::reply,
                                             .wants_outcome = true,
                                             .call = to,
                                             .stamped = on.now,
                                             .expires = rowe::rt::deadline_after(on.now, ttl)},
                                            text);
    EXPECT_TRUE(slot);
    return *slot;
  }
  std::string outcome(std::uint32_t slot) {
    return on.submissions.drained() ? outcome_of(on, slot) : "waits";
  }
};

TEST_F(replying, hears_that_it_was_sent) {
  peer program = peer_saying(on, R"({"service":"x","message_id":1})");
  const auto slot = reply(next_call(), R"({"done":true})");
  on.cycle();
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(program.hear(), texts{R"({"done":true,"in_reply_to":1})"});
}

TEST_F(replying, hears_that_the_caller_is_closing) {
  peer program = peer_saying(on, R"({"service":"x","message_id":1})");
  program.send(rowe::wire::opcode::close, "");
  const auto slot = reply(next_call(), R"({"done":true})");
  on.cycle();
  EXPECT_EQ(outcome(slot), "peer_lost");
}

TEST_F(replying, hears_that_its_time_to_live_is_over) {
  peer program{on};
  for (const rowe::duration ttl : {50ms, 0ms}) {
    program.tell(R"({"service":"x","message_id":1})");
    on.net.link_of(program.id()).capacity_bytes = 0;
    const auto slot = reply(next_call(), R"({"done":true})", ttl);
    on.cycles(ttl == 0ms ? 2 : 60);
    EXPECT_EQ(outcome(slot), "expired");
    on.net.link_of(program.id()).capacity_bytes = 4096;
    program.hear();
    EXPECT_EQ(program.hear_after(3), texts{});
  }
  EXPECT_EQ(on.count(counter::expired), 2U);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(replying, hears_that_its_time_to_live_was_over_before_it_was_looked_at) {
  peer program = peer_saying(on, R"({"service":"x","message_id":1})");
  const auto slot = reply(next_call(), R"({"done":true})", 5ms);
  on.cycle(10ms);
  EXPECT_EQ(outcome(slot), "expired");
  const auto heard = program.hear();
  ASSERT_EQ(heard.size(), 1U) << "the one who asked is told that there will be no reply";
  EXPECT_TRUE(has(heard[0], R"("code":"refused")"));
}

TEST_F(replying, hears_that_there_was_no_room_and_may_try_again) {
  peer program = peer_saying(on, R"({"service":"x","message_id":1})");
  on.net.link_of(program.id()).capacity_bytes = 0;
  for (int i = 0; i < 70; ++i) program.say(R"({"op":"nonsense"})"); // each is answered, and 64 answers wait
  on.cycle();
  const auto call = next_call();
  auto slot = reply(call, R"({"done":true})");
  on.cycle();
  EXPECT_EQ(outcome(slot), "full");
  on.net.link_of(program.id()).capacity_bytes = 64 * 1024;
  for (int i = 0; i < 3; ++i) { // more than may be on its way to it at once
    program.hear_after(1);
  }
  slot = reply(call, R"({"done":true})");
  on.cycle();
  EXPECT_EQ(outcome(slot), "sent");
  EXPECT_EQ(program.hear(), texts{R"({"done":true,"in_reply_to":1})"});
}

// ---- this process asks, peers answer

TEST_F(core_calls, asks_the_peer_that_advertised_a_service) {
  auto add = on.open<add_caller>(call_add());
  peer page = peer_saying(on, R"({"op":"advertise_service","service":"/add","type":"test/Add"})");
  const auto call = add.start({38, 4}, 1s, on.now);
  ASSERT_TRUE(call);
  const std::string heard = only(page.hear_after(1));
  const std::string id = member(heard, "id");
  EXPECT_EQ(heard, R"({"op":"call_service","id":")" + id + R"(","service":"/add","args":{"a":38,"b":4}})");
  page.tell(R"({"op":"service_response","id":")" + id +
            R"(","service":"/add","values":{"sum":42},"result":true})");
  const auto end = add.try_finish();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->id, *call);
  ASSERT_TRUE(end->reply) << end->reply.error().name();
  EXPECT_EQ(end->reply->sum, 42);
  EXPECT_EQ(add.try_finish().code(), errc::empty);
}

TEST_F(core_calls, keeps_several_calls_apart) {
  auto pair = open_lane(on);
  peer& program = program_on(pair);
  const auto first = pair.start(R"({"service":"a"})", 1s, on.now);
  const auto second = pair.start(R"({"service":"b"})", 1s, on.now);
  const auto heard = program.hear_after(1);
  ASSERT_EQ(heard.size(), 2U);
  program.say(R"({"in_reply_to":")" + member(heard[1], "message_id") + R"(","of":"b"})");
  program.say(R"({"unrelated":1})");
  program.say(R"({"in_reply_to":")" + member(heard[0], "message_id") + R"(","of":"a"})");
  on.cycle();
  const auto one = pair.try_finish();
  const auto two = pair.try_finish();
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->id, *second);
  EXPECT_TRUE(has(one->reply->value(), R"("of":"b")"));
  EXPECT_EQ(two->id, *first);
  EXPECT_EQ(pair.try_receive(on.now)->value(), R"({"unrelated":1})");
}

TEST_F(core_calls, tells_time_out_peer_lost_refusal_and_missing_service_apart) {
  auto add = on.open<add_caller>(call_add());
  auto pair = open_lane(on);
  EXPECT_TRUE(add.start({1, 1}, 1s, on.now));
  on.cycle();
  EXPECT_EQ(add.try_finish()->reply.code(), errc::no_service);

  peer page = peer_saying(on, R"({"op":"advertise_service","service":"/add"})");
  EXPECT_TRUE(add.start({1, 1}, 50ms, on.now));
  on.cycles(60);
  const auto timed_out = add.try_finish();
  ASSERT_TRUE(timed_out);
  EXPECT_EQ(timed_out->reply.error(), (rowe::error{errc::timed_out, 0, 50'000'000}));
  const std::string late = member(page.hear().at(0), "id");
  page.tell(R"({"op":"service_response","id":")" + late +
            R"(","service":"/add","values":{"sum":2},"result":true})");
  EXPECT_EQ(on.count(counter::replies_late), 1U);
  EXPECT_EQ(add.try_finish().code(), errc::empty);

  EXPECT_TRUE(add.start({1, 1}, 1s, on.now));
  const std::string refused = member(page.hear_after(1).at(0), "id");
  page.tell(R"({"op":"service_response","id":")" + refused +
            R"(","service":"/add","values":"no arms","result":false})");
  EXPECT_EQ(add.try_finish()->reply.code(), errc::refused);
  EXPECT_EQ(add.refusal(), "no arms");

  EXPECT_TRUE(add.start({1, 1}, 1s, on.now));
  on.cycle();
  page.leave();
  on.cycle();
  EXPECT_EQ(add.try_finish()->reply.code(), errc::peer_lost);
  EXPECT_EQ(on.count(counter::calls_lost), 1U);
  EXPECT_TRUE(add.start({1, 1}, 1s, on.now));
  on.cycle();
  EXPECT_EQ(add.try_finish()->reply.code(), errc::no_service) << "it went with its provider";
}

TEST_F(core_calls, drops_replies_that_come_on_another_connection_or_mean_no_call) {
  auto pair = open_lane(on);
  peer program{on}, stranger{on};
  program.tell("{}");
  (void)pair.try_receive(on.now);
  ASSERT_TRUE(pair.start(R"({"service":"a"})", 1s, on.now));
  const std::string id = member(program.hear_after(1).at(0), "message_id");
  stranger.say(R"({"in_reply_to":")" + id + R"("})");
  for (const std::string bad : {"\"\"", "\"1\"", "5", "\"0000000000000000.1.0.1\""})
    program.say(R"({"in_reply_to":)" + bad + "}");
  on.cycle();
  EXPECT_EQ(pair.try_finish().code(), errc::empty);
  EXPECT_EQ(on.count(counter::replies_foreign), 5U);
  program.tell(R"({"in_reply_to":")" + id + R"("})");
  EXPECT_TRUE(pair.try_finish());
}

TEST_F(core_calls, reads_a_plain_refusal) {
  auto pair = open_lane(on);
  peer& program = program_on(pair);
  for (const auto& [code, why] :
       {std::pair{"busy", errc::refused}, std::pair{"no_service", errc::no_service}}) {
    ASSERT_TRUE(pair.start(R"({"service":"a"})", 1s, on.now));
    const std::string id = member(program.hear_after(1).at(0), "message_id");
    program.tell(R"({"error":{"code":")" + std::string{code} + R"(","text":"later"},"in_reply_to":")" + id +
                 R"("})");
    const auto end = pair.try_finish();
    ASSERT_TRUE(end);
    EXPECT_EQ(end->reply.code(), why);
  }
  EXPECT_EQ(pair.refusal(), "later");
}

TEST_F(core_calls, lets_a_call_wait_for_a_peer) {
  auto pair = open_lane(on);
  ASSERT_TRUE(pair.start(R"({"service":"a"})", 5s, on.now));
  on.cycles(100);
  peer first{on}, second{on};
  first.say("{}");
  second.say("{}");
  on.cycles(2);
  const auto one = first.hear();
  EXPECT_EQ(one.size() + second.hear().size(), 1U) << "a call has one provider";
}

TEST_F(core_calls, drops_the_request_of_a_call_whose_time_is_over_before_it_was_sent) {
  auto pair = open_lane(on);
  ASSERT_TRUE(pair.start(R"({"service":"a"})", 50ms, on.now));
  on.cycles(60);
  EXPECT_EQ(pair.try_finish()->reply.code(), errc::timed_out);
  peer late{on};
  EXPECT_EQ(late.ask("{}", 2), texts{});
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(core_calls, ends_a_call_that_is_no_object_or_uses_our_names) {
  auto pair = open_lane(on);
  for (const auto& [text, why] : {std::pair{"[]", errc::not_an_object}, std::pair{"{", errc::malformed},
                                  std::pair{R"({"message_id":1})", errc::reserved_member}}) {
    ASSERT_TRUE(pair.start(text, 1s, on.now));
    on.cycle();
    const auto end = pair.try_finish();
    ASSERT_TRUE(end);
    EXPECT_EQ(end->reply.code(), why) << text;
  }
}

TEST_F(core_calls, drops_the_end_of_a_cancelled_call) {
  auto pair = open_lane(on);
  peer& program = program_on(pair);
  const auto call = pair.start(R"({"service":"a"})", 1s, on.now);
  on.cycle();
  pair.cancel(*call);
  const std::string id = member(program.hear().at(0), "message_id");
  program.tell(R"({"in_reply_to":")" + id + R"("})");
  EXPECT_EQ(pair.try_finish().code(), errc::empty);
  for (int i = 0; i < 4; ++i)
    EXPECT_TRUE(pair.start(R"({"service":"a"})", 1s, on.now)) << "its place is free again";
}

// ---- within this process, through the hub, of the endpoint itself

TEST_F(core_calls, reaches_a_service_of_its_own_process) {
  auto serves = on.open<add_responder>(serve_add());
  auto calls = on.open<add_caller>(call_add());
  ASSERT_TRUE(calls.start({20, 22}, 1s, on.now));
  on.cycle();
  answer_one(serves);
  on.cycle();
  const auto end = calls.try_finish();
  ASSERT_TRUE(end && end->reply);
  EXPECT_EQ(end->reply->sum, 42);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

struct core_calls_hub : core_test {
  core_calls_hub() : core_test{hub_options()} {}
};

TEST_F(core_calls_hub, passes_calls_between_its_peers_by_either_codec) {
  peer provider{on}, page{on}, program{on};
  provider.tell(R"({"op":"advertise_service","service":"/add","type":"test/Add"})");
  page.say(R"({"op":"call_service","id":"c1","service":"/add","args":{"a":1,"b":2}})");
  program.say(R"({"service":"/add","a":3,"b":4,"message_id":9})");
  const auto asked = provider.hear_after(1);
  ASSERT_EQ(asked.size(), 2U);
  EXPECT_TRUE(has(asked[0], R"("args":{"a":1,"b":2})"));
  EXPECT_TRUE(has(asked[1], R"("args":{"a":3,"b":4})"));
  for (const auto& one : asked) {
    provider.say(R"({"op":"service_response","service":"\/add","values":{"sum":7},"result":true,"id":")" +
                 member(one, "id") + R"("})");
  }
  on.cycle();
  EXPECT_EQ(page.hear(), texts{R"({"op":"service_response","id":"c1","service":"/add","result":true,)"
                               R"("values":{"sum":7}})"});
  EXPECT_EQ(program.hear(), texts{R"({"sum":7,"in_reply_to":9})"});
}

TEST_F(core_calls_hub, gives_no_reply_two_ids) {
  peer provider{on}, program{on};
  provider.tell(R"({"op":"advertise_service","service":"/odd"})");
  program.tell(R"({"service":"/odd","message_id":9})");
  provider.tell(
      R"({"op":"service_response","service":"/odd","values":{"in_reply_to":8},"result":true,"id":")" +
      member(provider.hear().at(0), "id") + R"("})");
  EXPECT_EQ(program.hear(), texts{R"({"result":{"in_reply_to":8},"in_reply_to":9})"});
}

TEST_F(core_calls_hub, tells_the_asker_that_the_provider_is_gone) {
  peer provider{on}, page{on};
  provider.tell(R"({"op":"advertise_service","service":"/add"})");
  page.tell(R"({"op":"call_service","id":"c1","service":"/add"})");
  provider.leave();
  EXPECT_EQ(page.hear_after(1), texts{R"({"op":"service_response","id":"c1","service":"/add","result":false,)"
                                      R"("values":"the peer went away"})"});
}

TEST_F(core_calls_hub, has_one_provider_for_a_service) {
  peer first{on}, second{on};
  first.tell(R"({"op":"advertise_service","service":"/add"})");
  second.say(R"({"op":"advertise_service","service":"add"})");
  second.say(R"({"op":"unadvertise_service","service":"/add"})");
  second.say(R"({"op":"advertise_service","service":"/rowe/stats"})");
  EXPECT_EQ(second.hear_after(1).size(), 3U) << "a status for each";
  EXPECT_EQ(first.ask(R"({"op":"advertise_service","service":"add"})"), texts{}) << "the same once more";
  first.tell(R"({"op":"unadvertise_service","service":"/add"})");
  EXPECT_EQ(second.ask(R"({"op":"advertise_service","service":"/add"})"), texts{});
}

TEST_F(core_calls, does_not_pass_calls_on_unless_it_is_a_hub) {
  peer provider{on}, page{on};
  provider.tell(R"({"op":"advertise_service","service":"/add"})");
  page.tell(R"({"op":"call_service","id":"1","service":"/add"})");
  EXPECT_EQ(provider.hear(), texts{});
  EXPECT_EQ(page.hear().size(), 1U);
}

TEST_F(core_calls, reports_itself) {
  auto add = on.open<add_responder>(serve_add());
  peer page{on};
  page.say(R"({"op":"call_service","id":"1","service":"/rowe/stats"})");
  page.say(R"({"op":"call_service","id":"2","service":"rosapi/topics","args":{}})");
  page.say(R"({"op":"call_service","id":"3","service":"/rosapi/services"})");
  page.say(R"({"op":"call_service","id":"4","service":"/rosapi/service_type","args":{"service":"/add"}})");
  page.say(R"({"op":"call_service","id":"5","service":"/rosapi/topic_type","args":{"topic":"/nope"}})");
  const auto heard = page.hear_after(1);
  ASSERT_EQ(heard.size(), 5U);
  for (const char* part :
       {R"("connections":[{"address":"127.0.0.1:50000")", R"("calls_max":24)", R"("expired":0)"})
    EXPECT_TRUE(has(heard[0], part));
  EXPECT_TRUE(has(heard[1], R"("topics":["/rowe/stats"])"));
  EXPECT_TRUE(has(heard[2], R"("services":["/add","/rowe/stats",)"));
  EXPECT_TRUE(has(heard[3], R"("type":"test/Add")"));
  EXPECT_TRUE(has(heard[4], R"("type":"")"));
}

TEST_F(core_calls, tells_who_publishes_a_topic) {
  on.offer(pair_kind::publish_text, "/odom", 100, {.shared = true});
  on.offer(pair_kind::subscribe_text, "/heard", 100);
  peer page{on};
  peer other{on, rowe::service::side::server, "10.0.0.7:4711"};
  page.say(R"({"op":"subscribe","topic":"/asked"})");
  other.say(R"({"op":"advertise","topic":"/odom","type":"nav_msgs/Odometry"})");
  (void)page.hear_after(1);
  const auto publishers = [&](std::string_view topic) {
    const auto heard = page.ask(R"({"op":"call_service","service":"/rosapi/publishers","args":{"topic":")" +
                                std::string{topic} + R"("}})");
    return heard.size() == 1 ? heard[0].substr(0, heard[0].find("},")) : "";
  };
  for (const auto& [topic, by] :
       {std::pair{"/odom", R"(["robot","10.0.0.7:4711"])"}, std::pair{"/rowe/stats", R"(["robot"])"},
        std::pair{"/asked", "[]"}, std::pair{"/heard", "[]"}, std::pair{"/nothing", "[]"}})
    EXPECT_TRUE(has(publishers(topic), R"("publishers":)" + std::string{by}))
        << topic << ": " << publishers(topic);
  other.leave();
  on.cycles(2);
  EXPECT_TRUE(has(publishers("/odom"), R"("publishers":["robot"])"));
}

// ---- as a client

struct core_calls_client : core_test {
  core_calls_client() : core_test{small_options(), rowe::service::side::client} {}
};

TEST_F(core_calls_client, asks_its_server_by_rosbridge_and_waits_for_it) {
  auto add = on.open<add_caller>(call_add());
  ASSERT_TRUE(add.start({38, 4}, 5s, on.now));
  on.cycles(10);
  peer server{on, rowe::service::side::client};
  const std::string heard = only(server.hear_after(2));
  EXPECT_TRUE(has(heard, R"("op":"call_service")"));
  server.tell(R"({"op":"service_response","service":"\/add","values":{"sum":42},"result":true,"id":")" +
              member(heard, "id") + R"("})");
  const auto end = add.try_finish();
  ASSERT_TRUE(end && end->reply);
  EXPECT_EQ(end->reply->sum, 42);
}

// rosbridge has no code for it, only a diagnostic; whatever else ends likewise is the provider's own.
TEST_F(core_calls_client, knows_a_service_that_its_server_has_not_from_one_that_refuses) {
  auto add = on.open<add_caller>(call_add());
  peer server{on, rowe::service::side::client};
  on.cycle();
  for (const auto& [diagnostic, code] : {std::pair{R"(Service \/add does not exist)", errc::no_service},
                                         std::pair{"Service add does not exist", errc::no_service},
                                         std::pair{"Service /other does not exist", errc::refused},
                                         std::pair{"Service /add does not exist any more", errc::refused},
                                         std::pair{"Service  does not exist", errc::refused},
                                         std::pair{"Service does not exist", errc::refused},
                                         std::pair{"The plan for /add does not exist", errc::refused}}) {
    ASSERT_TRUE(add.start({1, 1}, 1s, on.now));
    server.tell(R"({"op":"service_response","id":")" + member(server.hear_after(1).at(0), "id") +
                R"(","service":"/add","values":")" + diagnostic + R"(","result":false})");
    EXPECT_EQ(add.try_finish()->reply.code(), code) << diagnostic;
    EXPECT_FALSE(add.refusal().empty());
  }
}

TEST_F(core_calls_client, names_the_longest_service_that_nobody_provides) {
  rowe::endpoint_options options = small_options();
  options.limits.topic_bytes_max = 255;
  core_harness hub{options};
  core_harness program{options, rowe::service::side::client};
  const std::string name = "/" + std::string(254, 'n');
  pair_request asked = call_add();
  asked.name = name;
  auto add = program.open<add_caller>(asked);
  peer server{program, rowe::service::side::client};
  program.cycle();
  ASSERT_TRUE(add.start({1, 1}, 1s, program.now));
  program.cycle();
  peer page{hub};
  server.say(page.ask(server.hear().at(0)).at(0));
  program.cycle();
  EXPECT_EQ(add.try_finish()->reply.code(), errc::no_service);
}

TEST_F(core_calls_client, names_the_member_of_a_reply_that_it_cannot_read) {
  auto add = on.open<add_caller>(call_add());
  peer server{on, rowe::service::side::client};
  on.cycle();
  for (const auto& [values, code, diagnostic] :
       {std::tuple{R"({"total":3})", errc::missing_member,
                   R"(the member "sum" is missing; a whole number of 64 bits is wanted)"},
        std::tuple{R"({"sum":0.5})", errc::wrong_type,
                   R"(the member "sum" must be a whole number of 64 bits; it is 0.5)"},
        std::tuple{"[]", errc::not_an_object, "a JSON object is wanted; it is []"}}) {
    ASSERT_TRUE(add.start({1, 1}, 1s, on.now));
    server.tell(R"({"op":"service_response","id":")" + member(server.hear_after(1).at(0), "id") +
                R"(","service":"/add","values":)" + values + R"(,"result":true})");
    EXPECT_EQ(add.try_finish()->reply.code(), code) << values;
    EXPECT_EQ(add.refusal(), diagnostic);
  }
  EXPECT_EQ(on.count(counter::undecodable), 3U);
}

TEST_F(core_calls_client, offers_its_services_to_its_server_each_time_it_connects) {
  auto add = on.open<add_responder>(serve_add());
  for (int i = 0; i < 2; ++i) {
    peer server{on, rowe::service::side::client};
    on.cycle();
    EXPECT_EQ(server.hear(), texts{R"({"op":"advertise_service","type":"test/Add","service":"/add"})"});
    server.tell(R"({"op":"call_service","id":"srv:1","service":"\/add","args":{"a":1,"b":1}})");
    auto asked = add.try_next(on.now);
    ASSERT_TRUE(asked);
    EXPECT_TRUE(add.reply(*asked, {2}, on.now));
    EXPECT_EQ(server.hear_after(1),
              texts{R"({"op":"service_response","id":"srv:1","service":"/add","result":true,)"
                    R"("values":{"sum":2}})"});
    server.leave();
    on.cycle();
  }
}

TEST_F(core_calls_client, ends_calls_when_its_server_is_lost_and_never_sends_them_again) {
  auto pair = open_lane(on);
  peer server{on, rowe::service::side::client};
  on.cycle();
  ASSERT_TRUE(pair.start(R"({"service":"a"})", 5s, on.now));
  EXPECT_EQ(server.hear_after(1).size(), 1U);
  server.leave(rowe::service::close_cause::reset);
  on.cycle();
  EXPECT_EQ(pair.try_finish()->reply.code(), errc::peer_lost);
  peer again{on, rowe::service::side::client};
  EXPECT_EQ(again.hear_after(3), texts{});
}

} // namespace
} // namespace core_calls_test
