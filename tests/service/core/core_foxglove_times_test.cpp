// SPDX-License-Identifier: Apache-2.0
// Messages of types that hold a time: clients of Foxglove's protocol share a body of their own.
#include "core_fixtures.hpp"

#include <rowe/ros.hpp>

namespace core_foxglove_times_test {
namespace {

using namespace harness;
using rowe::ros::header;
using rowe::service::side;

constexpr std::string_view in_foxglove = R"({"seq":1,"stamp":{"sec":2,"nsec":3},"frame_id":"map"})";
constexpr std::string_view in_ros = R"({"seq":1,"stamp":{"secs":2,"nsecs":3},"frame_id":"map"})";

struct foxglove_times : core_test {
  foxglove_times() : core_test{hub_options()} {}

  rowe::detail::queue_pair& advertise(rowe::topic_options how = {}) {
    return on.offer_now(rowe::detail::pair_kind::publish_value, "/stamped", sizeof(header), how,
                        &rowe::describe<header>(), "std_msgs/Header");
  }
  void publish_header(rowe::detail::queue_pair& pair) {
    header one{.seq = 1, .stamp = {2, 3}, .frame_id = {}};
    ASSERT_TRUE(one.frame_id.assign("map"));
    ASSERT_TRUE(rowe::detail::publish_into(pair, sizeof one, on.now,
                                           [&](std::byte* slot) { std::memcpy(slot, &one, sizeof one); }));
    on.cycle();
  }
  // What it was told when it came.
  std::string greet(peer& one) {
    std::string all;
    for (int i = 0; i < 10; ++i) {
      on.cycles(2);
      for (const std::string& text : one.hear()) all += text + "\n";
    }
    return all;
  }
  // It subscribes to the topic as this number of its own.
  void subscribe(peer& one, std::uint32_t tag) {
    const std::string all = greet(one);
    const std::size_t at = all.find(R"(,"topic":"/stamped")");
    ASSERT_NE(at, std::string::npos) << all;
    const std::size_t id = all.rfind(R"("id":)", at) + 5;
    one.tell(R"({"op":"subscribe","subscriptions":[{"id":)" + std::to_string(tag) + R"(,"channelId":)" +
                 all.substr(id, at - id) + "}]}",
             2);
  }
  // Bodies of what it has heard, behind the number of its subscription.
  static texts bodies(peer& one, char tag) {
    texts all = one.hear();
    for (std::string& text : all) {
      EXPECT_EQ(text[0], '\x01');
      EXPECT_EQ(text[1], tag);
      text.erase(0, 13);
    }
    return all;
  }
  peer first{on, side::server, "127.0.0.1:50000", "/", "foxglove.websocket.v1"};
  peer second{on, side::server, "127.0.0.1:50001", "/", "foxglove.sdk.v1"};
  peer other{on};
};

TEST_F(foxglove_times, of_a_struct_are_in_one_body_for_all_and_others_get_theirs) {
  auto& pair = advertise();
  subscribe(first, 5);
  subscribe(second, 6);
  publish_header(pair);
  EXPECT_EQ(bodies(first, 5), texts{std::string{in_foxglove}});
  EXPECT_EQ(bodies(second, 6), texts{std::string{in_foxglove}});
  other.tell(R"({"op":"subscribe","topic":"/stamped"})");
  publish_header(pair);
  EXPECT_EQ(bodies(first, 5), texts{std::string{in_foxglove}});
  EXPECT_EQ(other.hear(), texts{R"({"op":"publish","topic":"/stamped","msg":)" + std::string{in_ros} + "}"});
  EXPECT_EQ(on.count(counter::no_slot), 0U);
}

TEST_F(foxglove_times, are_described_as_they_are_sent) {
  advertise();
  const std::string all = greet(first);
  EXPECT_TRUE(has(all, R"(\"stamp\":{\"title\":\"time\",\"type\":\"object\",\"properties\":{)"
                       R"(\"sec\":{\"type\":\"integer\"},\"nsec\":{\"type\":\"integer\"}}})"));
}

TEST_F(foxglove_times, of_a_latched_value_are_in_the_same_form) {
  auto& pair = advertise({.latched = true});
  publish_header(pair);
  subscribe(first, 5);
  EXPECT_EQ(bodies(first, 5), texts{std::string{in_foxglove}});
}

TEST_F(foxglove_times, that_a_peer_publishes_are_in_the_same_form) {
  advertise({.shared = true});
  subscribe(first, 5);
  other.tell(R"({"op":"publish","topic":"/stamped","msg":)" + std::string{in_ros} + "}", 2);
  EXPECT_EQ(bodies(first, 5), texts{std::string{in_foxglove}});
}

TEST_F(foxglove_times, that_a_client_publishes_are_read_by_a_handle_in_each_form) {
  auto& inbox = on.offer_now(rowe::detail::pair_kind::subscribe_value, "/stamped", sizeof(header), {},
                             &rowe::describe<header>(), "std_msgs/Header");
  rowe::subscriber<header> handle{core_harness::handle_of(inbox)};
  (void)greet(first);
  first.say(R"({"op":"advertise","channels":[{"id":1,"topic":"/stamped","encoding":"json",)"
            R"("schemaName":"std_msgs/Header"}]})");
  for (const std::string_view body : {in_foxglove, in_ros}) {
    first.send(rowe::wire::opcode::binary, std::string{"\x01\x01\0\0\0", 5} + std::string{body});
    on.cycles(2);
    const auto got = handle.try_take(on.now);
    ASSERT_TRUE(got) << body;
    EXPECT_EQ((*got)->stamp.secs, 2U);
    EXPECT_EQ((*got)->stamp.nsecs, 3U);
  }
}

TEST_F(foxglove_times, of_a_client_that_does_not_read_are_dropped_and_others_get_all) {
  auto& pair = advertise();
  subscribe(first, 5);
  subscribe(second, 6);
  on.net.link_of(first.id()).capacity_bytes = 0;
  std::size_t heard = 0;
  for (int i = 0; i < 300; ++i) {
    publish_header(pair);
    heard += bodies(second, 6).size();
  }
  EXPECT_EQ(heard, 300U);
  EXPECT_FALSE(first.cut());
  on.net.link_of(first.id()).capacity_bytes = 1U << 20U;
  on.cycles(3);
  for (const std::string& body : bodies(first, 5)) EXPECT_EQ(body, in_foxglove);
}

struct foxglove_losses : foxglove_times {
  // What it is told besides messages, in so many steps of 10 ms.
  texts statuses(int steps) {
    texts all;
    for (int i = 0; i < steps; ++i) {
      on.cycle(10ms);
      for (const std::string& text : first.hear()) {
        if (text.starts_with('{')) all.push_back(text);
      }
    }
    return all;
  }
  // Publishes while the client does not read, and then lets it read.
  void lose_some(rowe::detail::queue_pair& pair) {
    on.net.link_of(first.id()).capacity_bytes = 0;
    for (int i = 0; i < 300; ++i) publish_header(pair);
    on.net.link_of(first.id()).capacity_bytes = 1U << 20U;
  }
};

TEST_F(foxglove_losses, are_told_in_the_same_words_once_in_ten_seconds) {
  auto& pair = advertise();
  subscribe(first, 5);
  EXPECT_EQ(statuses(100), texts{});
  lose_some(pair);
  const texts told = statuses(100);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_TRUE(
      told[0].starts_with(R"({"op":"status","level":1,"message":"messages for this client were dropped)"));
  lose_some(pair);
  EXPECT_EQ(statuses(800), texts{}) << "it knows";
  EXPECT_EQ(statuses(300), told) << "those since then";
  EXPECT_EQ(statuses(2000), texts{}) << "there were no more";
  EXPECT_FALSE(first.cut());
}

} // namespace
} // namespace core_foxglove_times_test
