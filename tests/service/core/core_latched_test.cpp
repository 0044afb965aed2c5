// SPDX-License-Identifier: Apache-2.0
// Latched topics with several publishers, and values of all sizes: what a late subscriber gets.
#include <memory>
#include <set>

#include <rowe/subscriber.hpp>

#include "core_fixtures.hpp"

namespace harness {
namespace core_latched_test {
namespace {

using rowe::detail::pair_kind;

struct latched : ::testing::Test {
  core_harness on{with_limits(
      hub_options(), &limits::message_bytes_max, 64 * 1024, &limits::long_message_bytes_max, 1024 * 1024,
      &limits::advertisements_per_connection_max, 16, &limits::subscriptions_per_connection_max, 16,
      &limits::latched_bytes, 256 * 1024, &limits::topics_max, 64, &limits::connections_max, 12)};

  static std::string value(std::string_view name, std::size_t bytes = 1) {
    return R"({"of":")" + std::string{name} + R"(","x":")" + std::string(bytes, 'x') + "\"}";
  }
  void latch(peer& by, std::string_view topic, const std::string& body) {
    by.say(R"({"op":"advertise","topic":")" + std::string{topic} + R"(","type":"a/Map","latch":true})");
    by.say(published(topic, body));
    on.cycles(6);
  }
  texts late(std::string_view more = "") {
    peer reader{on};
    reader.say(R"({"op":"subscribe","topic":"/map")" + std::string{more} + "}");
    texts all;
    for (int i = 0; i < 40; ++i) {
      on.cycles(2);
      for (std::string& one : reader.hear()) all.push_back(std::move(one));
    }
    reader.leave();
    on.cycles(2);
    EXPECT_EQ(on.core.inconsistency(), "");
    return all;
  }
};

TEST_F(latched, topics_have_one_value_of_each_publisher) {
  auto& own = on.offer_now(pair_kind::publish_text, "/map", 200, {.latched = true, .shared = true});
  peer a{on}, b{on};
  latch(a, "/map", value("a"));
  latch(b, "/map", value("b"));
  ASSERT_TRUE(publish_text_now(on, own, value("own")));
  latch(a, "/map", value("a again"));
  const texts all{published("/map", value("b")), published("/map", value("own")),
                  published("/map", value("a again"))};
  EXPECT_EQ(late(), all);
  EXPECT_EQ(late(R"(,"queue_length":1)"), all) << "one after the other";
  EXPECT_EQ(late(R"(,"throttle_rate":20)"), all) << "with its pauses between them";
  b.leave();
  on.cycles(2);
  EXPECT_EQ(late(), (texts{all[1], all[2]})) << "a value goes with its publisher";
}

// Also where one of the publishers goes on, whatever the subscriber's queue holds.
TEST_F(latched, values_all_reach_a_late_subscriber_beside_newer_messages) {
  constexpr int publishers = 9;
  std::vector<std::unique_ptr<peer>> all;
  for (int i = 0; i < publishers; ++i) {
    all.push_back(std::make_unique<peer>(on));
    latch(*all.back(), "/map", value(std::to_string(i)));
  }
  for (const std::string_view queue : {"", R"(,"queue_length":1)", R"(,"queue_length":3)"}) {
    peer reader{on};
    reader.say(R"({"op":"subscribe","topic":"/map")" + std::string{queue} + "}");
    all[2]->say(published("/map", value("newer")));
    all[2]->say(published("/map", value("newest")));
    std::set<std::string> got;
    std::string last;
    for (int i = 0; i < 40; ++i) {
      on.cycles(2);
      for (const std::string& one : reader.hear()) got.insert(last = one);
    }
    for (int i = 0; i < publishers; ++i)
      EXPECT_EQ(got.contains(published("/map", value(std::to_string(i)))), i != 2) << queue << i;
    EXPECT_EQ(last, published("/map", value("newest"))) << queue;
    EXPECT_EQ(on.core.inconsistency(), "");
    all[2]->say(published("/map", value("2")));
    on.cycles(4);
  }
}

// Of who may publish, and not advertise, too.
TEST_F(latched, values_go_with_the_type_that_a_handle_replaces) {
  peer a = peer_saying(on, R"({"op":"publish","topic":"/x","type":"a/A","latch":true,"msg":{"x":1}})", 2);
  on.offer(pair_kind::publish_text, "/x", 200, {.shared = true}, nullptr, "b/B");
  on.cycles(2);
  peer reader{on};
  EXPECT_EQ(reader.ask(R"({"op":"subscribe","topic":"/x"})", 4), texts{});
}

TEST_F(latched, values_all_reach_a_handle_that_subscribes_late) {
  peer a{on}, b{on};
  peer c{on}, d{on};
  latch(a, "/map", value("a"));
  latch(b, "/map", value("b", 100'000));
  on.cycles(40);
  latch(c, "/map", value("c", 20'000));
  latch(d, "/map", value("d", 90'000));
  on.cycles(40);
  auto& pair = on.offer(pair_kind::subscribe_text, "/map", 120 * 1024, {.depth = 4});
  on.cycles(20);
  std::vector<std::string> got;
  while (const auto slot = pair.user.in.ring->try_pop()) {
    got.emplace_back(reinterpret_cast<const char*>(pair.user.in.memory.value(*slot)),
                     pair.user.in.memory.header(*slot)->bytes);
    pair.user.in.free_ring->release(*slot);
  }
  EXPECT_EQ(got, (texts{value("a"), value("b", 100'000), value("c", 20'000), value("d", 90'000)}));
}

TEST_F(latched, values_that_find_no_room_among_short_ones_are_where_long_ones_are) {
  peer a{on};
  for (int i = 0; i < 12; ++i) latch(a, "/map" + std::to_string(i), value("a", 20'000));
  latch(a, "/map", value("a", 59'000));
  EXPECT_EQ(on.count(counter::not_latched), 0U);
  EXPECT_EQ(late(), texts{published("/map", value("a", 59'000))});
  a.leave();
  on.cycles(4);
  EXPECT_EQ(on.core.inconsistency(), "");
}

TEST(values_not_kept, are_told_to_who_published_them) {
  core_harness on{with_limits(hub_options(), &limits::latched_bytes, 4096)};
  auto& own = on.offer(pair_kind::publish_text, "/own", 6000, {.latched = true});
  peer a{on};
  on.cycle();
  const std::string body = R"({"x":")" + std::string(5000, 'x') + "\"}";
  a.say(R"({"op":"advertise","topic":"/map","type":"a/Map","latch":true})");
  for (int i = 0; i < 3; ++i) a.say(R"({"op":"publish","topic":"/map","id":"7","msg":)" + body + "}");
  const texts told = a.hear_after(6);
  ASSERT_EQ(told.size(), 1U) << "once a second";
  EXPECT_TRUE(
      has(told[0], "publish /map: its last value, of 5008 bytes, is not retained for late subscribers"));
  EXPECT_TRUE(has(told[0], R"("id":"7")"));
  EXPECT_EQ(on.count(counter::not_latched), 3U);
  ASSERT_TRUE(publish_text(on, own, body));
  ASSERT_TRUE(publish_text(on, own, body));
  on.cycles(2);
  EXPECT_EQ(on.count(counter::not_latched), 5U);
  std::size_t events = 0;
  while (const auto one = on.shared.try_event())
    events += std::string_view{one->what}.starts_with("publish /own");
  EXPECT_EQ(events, 1U);
}

} // namespace
} // namespace core_latched_test
} // namespace harness
