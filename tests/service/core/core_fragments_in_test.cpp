// SPDX-License-Identifier: Apache-2.0
// The core with messages that come in rosbridge's fragments: they do what they would do as a whole, others go
// between them, and what is wrong with them is said once and harms nothing else.
#include "core_fixtures.hpp"
#include "fragments.hpp"

namespace harness {
namespace core_fragments_in_test {
namespace {

using fragments::cut;
using fragments::fragment;

rowe::endpoint_options options_with(std::uint32_t long_bytes) {
  return with_limits(hub_options(), &limits::long_message_bytes_max, long_bytes, &limits::long_slots, 8);
}

std::string map_of(std::size_t bytes) {
  std::string made = R"({"data":[0)";
  while (made.size() + 20 < bytes) made += "," + std::to_string(made.size());
  return made + R"(],"é":"ü\n\"😀"})";
}

struct fragments_in_test : core_test {
  explicit fragments_in_test(const rowe::endpoint_options& chosen = options_with(64 * 1024))
      : core_test{chosen} {
    listener.tell(R"({"op":"subscribe","topic":"/map"})");
  }
  peer robot{on};
  peer listener{on};

  void say(const texts& all) {
    for (const std::string& one : all) robot.say(one);
  }
  // The one status that the robot is told for these.
  std::string refusal_of(const texts& all) {
    say(all);
    const texts told = robot.hear_during(60);
    return told.size() == 1 ? told[0] : "(" + std::to_string(told.size()) + " answers)";
  }
  bool works() {
    const std::string text = published("/map", R"({"again":1})");
    say(cut(text, 20));
    const texts heard = listener.hear_during(60);
    return !heard.empty() && heard.back() == text;
  }
};

TEST_F(fragments_in_test, are_carried_out_as_the_whole_message_would_be) {
  for (const std::size_t bytes : {30U, 5000U, 8000U, 9000U, 30'000U, 60'000U}) {
    for (const std::size_t size : {11U, 500U, 2000U, 7000U}) {
      if (bytes / size > 2000) continue;
      const std::string text = published("/map", map_of(bytes));
      say(cut(text, size));
      EXPECT_EQ(listener.hear_during(400), texts{text}) << bytes << " in " << size;
    }
  }
  EXPECT_TRUE(robot.hear_during(60).empty());
}

TEST_F(fragments_in_test, may_have_the_total_and_the_id_of_the_reference_server) {
  for (const std::size_t size : {10U, 64U, 500U}) {
    const std::string text = published("/map", map_of(2000));
    say(cut(text, size, "0", true));
    EXPECT_EQ(listener.hear_during(200), texts{text}) << size;
  }
  const std::string even = published("/map", R"({"x":123456789})"); // 15.0 where 15 is the count
  say(cut(even, 3, "0", true));
  EXPECT_EQ(listener.hear_during(60), texts{even});
}

TEST_F(fragments_in_test, let_other_messages_of_their_peer_pass) {
  peer other = subscriber(on, "/pose");
  const std::string map = published("/map", map_of(20'000));
  int poses = 0;
  for (const std::string& one : cut(map, 1000)) {
    robot.say(one);
    robot.say(published("/pose", R"({"x":1})"));
    poses += static_cast<int>(other.hear_after(1).size());
  }
  poses += static_cast<int>(other.hear_during(60).size());
  EXPECT_EQ(poses, 21);
  EXPECT_EQ(listener.hear_during(60), texts{map});
}

TEST_F(fragments_in_test, let_a_long_message_in_frames_pass) {
  const std::string first = published("/map", map_of(20'000));
  const std::string second = published("/map", map_of(21'000));
  const texts in_fragments = cut(first, 7000);
  robot.say(in_fragments[0]);
  robot.say(second);
  robot.say(in_fragments[1]);
  robot.say(in_fragments[2]);
  EXPECT_EQ(listener.hear_during(200), (texts{second, first}));
}

TEST_F(fragments_in_test, make_calls_and_are_answered) {
  say(cut(R"({"op":"call_service","id":"c","service":"/rosapi/get_time"})", 15));
  const std::string answers = only(robot.hear_during(60));
  EXPECT_TRUE(has(answers, R"("id":"c")"));
}

TEST_F(fragments_in_test, stop) {
  on.offer_now(rowe::detail::latch_request({.name = "loop"}));
  say(cut(R"({"op":"call_service","service":"/rowe/stop","args":{"reason":"a wall"}})", 16));
  (void)robot.hear_during(10);
  EXPECT_EQ(on.count(counter::stops), 1U);
}

TEST_F(fragments_in_test, that_are_out_of_order_are_refused_once) {
  const texts all = cut(published("/map", map_of(1000)), 100);
  EXPECT_TRUE(has(refusal_of({all[0], all[2], all[3], all[4]}), "num is 2, but 1 is expected"));
  EXPECT_TRUE(has(refusal_of({all[0], all[1], all[1], all[2]}), "num is 1, but 2 is expected"));
  const texts other = cut(published("/map", map_of(1000)), 100, "7");
  EXPECT_TRUE(has(refusal_of({other[3], other[4]}), "num is 3, but no message"));
  EXPECT_TRUE(works());
  EXPECT_EQ(on.count(counter::fragments_lost), 2U);
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
}

TEST_F(fragments_in_test, of_another_message_are_refused_while_one_is_under_way) {
  const std::string text = published("/map", map_of(1000));
  const texts first = cut(text, 600, R"("a")");
  const texts second = cut(text, 600, R"("b")");
  EXPECT_TRUE(has(refusal_of({first[0], second[0]}), "another message in fragments is under way"));
  robot.say(first[1]);
  EXPECT_EQ(listener.hear_during(60), texts{text}); // the first one goes on
}

TEST_F(fragments_in_test, may_begin_anew_and_their_sender_is_told_what_was_lost) {
  const std::string text = published("/map", map_of(1000));
  const texts all = cut(text, 100);
  EXPECT_TRUE(has(refusal_of({all[0], all[1], all[0]}), "begins again: fragment 2"));
  for (std::size_t i = 1; i < all.size(); ++i) robot.say(all[i]);
  EXPECT_EQ(listener.hear_during(60), texts{text});
}

TEST_F(fragments_in_test, that_are_wrong_are_refused_with_the_value) {
  const auto answer = [&](const std::string& one) { return refusal_of({one}); };
  EXPECT_TRUE(has(answer(R"({"op":"fragment","data":"","num":0,"total":1})"), "\\\"id\\\""));
  EXPECT_TRUE(has(answer(R"({"op":"fragment","id":"1","data":[],"num":0,"total":1})"),
                  "\\\"data\\\" must be a string"));
  EXPECT_TRUE(has(answer(R"({"op":"fragment","id":"1","data":"x","num":-1,"total":1})"), "it is -1"));
  EXPECT_TRUE(
      has(answer(R"({"op":"fragment","id":"1","data":"x","num":0,"total":0})"), "at least 1; it is 0"));
  EXPECT_TRUE(has(answer(fragment("1", "x", 0, "99999999")), "total is 99999999, and may be"));
  EXPECT_TRUE(has(answer(fragment("1", fragment("2", "{}", 0, "1"), 0, "1")), "must not hold another"));
  EXPECT_TRUE(has(answer(fragment("1", "{\"op\"", 0, "1")), "no valid JSON"));
  EXPECT_TRUE(has(answer(fragment("1", "", 0, "1")), "no valid JSON"));
  EXPECT_TRUE(works());
}

TEST_F(fragments_in_test, whose_total_changes_are_refused) {
  const texts all = cut(published("/map", map_of(1000)), 100);
  EXPECT_TRUE(has(refusal_of({all[0], fragment(R"("m")", "x", 1, "3")}), "total is 3, but was 11"));
  EXPECT_TRUE(works());
}

TEST_F(fragments_in_test, of_a_message_that_is_too_long_are_refused) {
  const std::string text = published("/map", map_of(66'000));
  EXPECT_TRUE(has(refusal_of(cut(text, 7000)), "long_message_bytes_max is 65536"));
  EXPECT_EQ(on.count(counter::violations), 0U);
  EXPECT_TRUE(works());
}

TEST_F(fragments_in_test, of_what_may_not_be_long_are_refused_as_a_long_message_is) {
  const std::string request = R"({"op":"advertise","topic":"/x","x":)" + map_of(20'000) + "}";
  EXPECT_TRUE(has(refusal_of(cut(request, 7000)), "message_bytes_max"));
}

TEST_F(fragments_in_test, that_never_end_are_given_up_in_time) {
  robot.say(cut(published("/map", map_of(1000)), 100)[0]);
  texts told;
  for (int i = 0; i < 100; ++i) {
    on.cycle(500ms);
    for (std::string& one : robot.hear()) told.push_back(std::move(one));
    (void)listener.hear();
  }
  ASSERT_EQ(told.size(), 1U);
  EXPECT_TRUE(has(told[0], "not finished in time: number 1 of 11"));
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
  EXPECT_FALSE(robot.cut());
}

TEST_F(fragments_in_test, of_a_peer_that_leaves_give_back_their_chunks) {
  robot.tell(cut(published("/map", map_of(1000)), 100)[0]);
  EXPECT_NE(on.core.chunks_in_use(), 0U);
  robot.leave();
  on.cycle();
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
  EXPECT_EQ(on.count(counter::fragments_lost), 1U);
}

// Each peer begins one, and the newcomer finds room all the same.
TEST_F(fragments_in_test, that_nobody_ends_keep_out_nobody_for_long) {
  std::vector<peer> hostile;
  for (int i = 0; i < 5; ++i) {
    hostile.emplace_back(on);
    for (const std::string& one : cut(published("/map", map_of(40'000)), 7000)) {
      if (one.find(R"("num":5)") == std::string::npos) hostile.back().say(one);
    }
    on.cycle(20ms);
  }
  for (int i = 0; i < 100; ++i) on.cycle(20ms);
  const std::string text = published("/map", map_of(50'000));
  say(cut(text, 7000));
  EXPECT_EQ(listener.hear_during(200), texts{text});
}

// A peer's own work in one cycle stays small, however long its fragments are.
TEST_F(fragments_in_test, leave_other_peers_their_turns) {
  peer other{on};
  (void)other.ask(R"({"op":"subscribe","topic":"/pose"})");
  for (const std::string& one : cut(published("/map", map_of(60'000)), 7900)) robot.say(one);
  listener.say(published("/pose", R"({"x":1})"));
  int cycles = 0;
  for (; cycles < 20; ++cycles) {
    on.cycle();
    if (!other.hear().empty()) break;
  }
  EXPECT_LE(cycles, 1);
  (void)listener.hear_during(100);
}

struct no_long_messages_test : fragments_in_test {
  no_long_messages_test() : fragments_in_test{options_with(0)} {}
};

TEST_F(no_long_messages_test, takes_no_fragments_and_says_so) {
  EXPECT_TRUE(has(refusal_of(cut(published("/map", R"({"x":1})"), 10)), "long_message_bytes_max is 0"));
}

// A call whose handle has no room is parked, and so is one that came in fragments.
TEST_F(fragments_in_test, are_parked_until_a_handle_has_room) {
  auto& receiver = on.offer_now(lane_request(2, 256));
  for (int i = 0; i < 6; ++i) say(cut(R"({"n":)" + std::to_string(i) + "}", 3, std::to_string(i)));
  texts taken;
  for (int i = 0; i < 100; ++i) {
    on.cycle();
    EXPECT_EQ(on.core.inconsistency(), "");
    if (i % 5 == 0) {
      if (const auto text = take(receiver)) taken.push_back(*text);
    }
  }
  EXPECT_EQ(taken,
            (texts{R"({"n":0})", R"({"n":1})", R"({"n":2})", R"({"n":3})", R"({"n":4})", R"({"n":5})"}));
}

} // namespace
} // namespace core_fragments_in_test
} // namespace harness
