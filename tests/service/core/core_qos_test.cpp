// SPDX-License-Identifier: Apache-2.0
// What `qos` of rosbridge does: lifespan, deadline, depth, durability.
#include "core_fixtures.hpp"

#include <string>
#include <string_view>

namespace core_qos_test {
namespace {

using namespace harness;

struct qos : core_test {
  qos() : core_test{with_limits(hub_options(), &limits::subscriptions_max, 256)} {} // 128 blocks for ids

  static std::string publish(int n) {
    return R"({"op":"publish","topic":"/t","msg":{"n":)" + std::to_string(n) + "}}";
  }
};

TEST_F(qos, lifespan_of_an_advertisement_is_a_time_to_live) {
  peer robot{on};
  const std::string how = R"("qos":{"lifespan":0.05,"durability":"transient_local"}})";
  robot.say(R"({"op":"advertise","topic":"/t","type":"a/B",)" + how);
  robot.say(publish(1));
  on.cycles(2);
  peer soon = peer_saying(on, R"({"op":"subscribe","topic":"/t"})", 2);
  EXPECT_TRUE(has(soon.hear_as_one(), R"("n":1)"));
  on.now += 60ms;
  peer late = peer_saying(on, R"({"op":"subscribe","topic":"/t"})", 2);
  EXPECT_EQ(late.hear_as_one(), "");
}

TEST_F(qos, lifespan_of_a_subscription_drops_what_waited_too_long_for_it_alone) {
  peer hasty{on};
  peer patient{on};
  peer robot{on};
  // Both take one message a second, and keep what comes meanwhile.
  hasty.say(
      R"({"op":"subscribe","topic":"/t","throttle_rate":1000,"queue_length":5,"qos":{"lifespan":0.2}})");
  patient.say(R"({"op":"subscribe","topic":"/t","throttle_rate":1000,"queue_length":5})");
  on.cycle();
  robot.tell(publish(1), 2);
  robot.tell(publish(2), 2);
  EXPECT_TRUE(has(hasty.hear_as_one(), R"("n":1)"));
  EXPECT_TRUE(has(patient.hear_as_one(), R"("n":1)"));
  on.cycles(12, 100ms);
  EXPECT_EQ(hasty.hear_as_one(), "");
  EXPECT_TRUE(has(patient.hear_as_one(), R"("n":2)"));
  EXPECT_EQ(on.count(counter::expired), 1U);
  robot.tell(publish(3), 2);
  EXPECT_TRUE(has(hasty.hear_as_one(), R"("n":3)")); // what is fresh comes
}

TEST_F(qos, deadline_is_counted_and_told_once_until_a_message_comes) {
  peer page{on};
  peer robot{on};
  page.say(R"({"op":"set_level","level":"warning"})");
  page.say(R"({"op":"subscribe","topic":"/t","qos":{"deadline":0.5}})");
  for (int i = 0; i < 8; ++i) {
    robot.say(publish(i));
    on.cycles(4, 100ms);
  }
  EXPECT_FALSE(has(page.hear_as_one(), "deadline"));
  EXPECT_EQ(on.count(counter::deadlines_missed), 0U);
  on.cycles(20, 100ms);
  const std::string told = page.hear_as_one();
  EXPECT_TRUE(has(told, "subscribe /t: no message came within its deadline of 500 ms"));
  EXPECT_TRUE(has(told, R"("level":"warning")"));
  EXPECT_EQ(told.find("deadline"), told.rfind("deadline"));
  EXPECT_GE(on.count(counter::deadlines_missed), 3U);
  robot.say(publish(9));
  on.cycles(20, 100ms);
  EXPECT_TRUE(has(page.hear_as_one(), "deadline"));
  page.tell(R"({"op":"unsubscribe","topic":"/t"})");
  const auto before = on.count(counter::deadlines_missed);
  on.cycles(20, 100ms);
  EXPECT_EQ(on.count(counter::deadlines_missed), before);
}

// A nanosecond is watched as a tenth of a second.
TEST_F(qos, deadline_is_told_by_the_id_of_its_subscription) {
  peer page{on};
  const auto told_by = [&](std::string_view topic, const std::string& id) {
    page.say(R"({"op":"subscribe","id":)" + id + R"(,"topic":")" + std::string{topic} +
             R"(","qos":{"deadline":0.5}})");
    page.say(R"({"op":"subscribe","id":"other","topic":")" + std::string{topic} + "\"}");
    on.cycles(8, 100ms);
    return page.hear_as_one();
  };
  EXPECT_TRUE(has(told_by("/t", R"("subscribe:/t:1")"), R"("id":"subscribe:/t:1")"));
  const std::string as_roslib = R"("subscribe:/robot/camera/front/odometry:17")";
  EXPECT_TRUE(has(told_by("/u", as_roslib), R"("id":)" + as_roslib));
  const std::string longest = '"' + std::string(rowe::service::call_id_bytes_max - 2, 'x') + '"';
  EXPECT_TRUE(has(told_by("/v", longest), R"("id":)" + longest));
}

// 128 blocks of 28 bytes, of which each of 8 peers has a claim to 8. Four ids of 252 bytes are what one may
// have.
TEST_F(qos, deadline_is_told_without_an_id_only_to_who_has_many_long_ones) {
  peer greedy{on};
  peer other{on};
  const auto told_by = [&](peer& by, int topic, const std::string& id) {
    by.say(R"({"op":"subscribe","id":")" + id + R"(","topic":"/t)" + std::to_string(topic) +
           R"(","qos":{"deadline":0.5}})");
    on.cycles(12, 100ms);
    const std::string told = by.hear_as_one();
    EXPECT_TRUE(has(told, "/t" + std::to_string(topic) + ": no message came within its deadline"));
    return has(told, R"("id":")" + id + '"');
  };
  const std::string long_id(250, 'g');
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(told_by(greedy, i, long_id)) << i;
  EXPECT_FALSE(told_by(greedy, 4, long_id));
  EXPECT_TRUE(told_by(other, 0, "subscribe:/robot/camera/front/odometry:17"));
  for (int i = 0; i < 4; ++i) greedy.tell(R"({"op":"unsubscribe","topic":"/t)" + std::to_string(i) + "\"}");
  EXPECT_TRUE(told_by(greedy, 5, long_id));
}

TEST_F(qos, deadlines_of_no_time_cost_ten_looks_a_second) {
  peer page{on};
  for (int i = 0; i < 8; ++i)
    page.say(R"({"op":"subscribe","topic":"/t)" + std::to_string(i) +
             R"(","qos":{"deadline":{"secs":0,"nsecs":1}}})");
  on.cycle();
  on.cycles(1000, 1ms);
  EXPECT_LE(on.count(counter::deadlines_missed), 80U);
  EXPECT_GE(on.count(counter::deadlines_missed), 64U);
  EXPECT_TRUE(has(page.hear_as_one(), "deadline of 100 ms"));
  EXPECT_EQ(on.core.peers(), 1U);
}

TEST_F(qos, of_zero_or_infinite_times_does_nothing) {
  peer page{on};
  peer robot{on};
  page.say(R"({"op":"subscribe","topic":"/t","qos":{"deadline":0,"lifespan":"infinite"}})");
  robot.say(R"({"op":"advertise","topic":"/t","type":"a/B","qos":{"lifespan":0,"deadline":"infinite"}})");
  robot.say(publish(1));
  on.cycles(20, 100ms);
  EXPECT_TRUE(has(page.hear_as_one(), R"("n":1)"));
  EXPECT_EQ(on.count(counter::deadlines_missed), 0U);
}

TEST_F(qos, depth_is_the_length_of_the_queue) {
  peer page{on};
  peer robot{on};
  page.tell(R"({"op":"subscribe","topic":"/t","throttle_rate":1000,"qos":{"depth":2}})");
  for (int i = 0; i < 6; ++i) robot.say(publish(i));
  on.cycles(40, 100ms);
  const std::string got = page.hear_as_one();
  EXPECT_TRUE(has(got, R"("n":4)") && has(got, R"("n":5)")); // all came in one cycle
  EXPECT_FALSE(has(got, R"("n":3)")) << got;
}

} // namespace
} // namespace core_qos_test
