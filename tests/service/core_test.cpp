// SPDX-License-Identifier: Apache-2.0
// The core as a server: what peers and handles see of it, with no thread and no socket.
#include "service/core.hpp"

#include <gtest/gtest.h>

#include <string>

#include "stage.hpp"

struct pose {
  double x, y;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::x, &pose::y>{}.type("test/Pose");

namespace {

using namespace std::chrono_literals;
using rowe::service::counter;
using stage::peer;
using stage::theatre;
using texts = std::vector<std::string>;

rowe::detail::lane& advertise_pose(theatre& on, rowe::topic_options how = {}) {
  return on.offer(rowe::detail::lane_kind::publish_value, "/pose", sizeof(pose), how, &rowe::describe<pose>(),
                  "test/Pose");
}

rowe::status publish(theatre& on, rowe::detail::lane& lane, const pose& value) {
  return rowe::detail::publish_into(lane, sizeof value, on.now,
                                    [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); });
}

rowe::result<std::string> take(rowe::detail::lane& lane) {
  const auto slot = lane.subscriber.out->try_pop();
  if (!slot) return rowe::errc::empty;
  std::string text{reinterpret_cast<const char*>(lane.subscriber.slots.value(*slot)),
                   lane.subscriber.slots.header(*slot)->bytes};
  lane.subscriber.home->give(*slot);
  return text;
}

constexpr auto message = [](int x) {
  return R"({"op":"publish","topic":"/pose","msg":{"x":)" + std::to_string(x) + R"(,"y":0}})";
};

struct core_test : testing::Test {
  ~core_test() override { EXPECT_TRUE(on.core.check()); }
  theatre on;
};

// ---- publishing

TEST_F(core_test, sends_a_published_struct_to_the_peer_that_subscribed) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {1.5, -2}));
  on.cycle();
  EXPECT_EQ(browser.hear(), texts{R"({"op":"publish","topic":"/pose","msg":{"x":1.5,"y":-2}})"});
}

TEST_F(core_test, tells_a_publisher_that_nobody_listens_and_queues_nothing) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  on.cycle();
  EXPECT_EQ(publish(on, lane, {1, 0}).code(), rowe::errc::no_peer);
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  EXPECT_TRUE(browser.hear().empty());
  EXPECT_TRUE(publish(on, lane, {2, 0}));
  browser.say(R"({"op":"unsubscribe","topic":"/pose"})");
  on.cycle();
  EXPECT_EQ(publish(on, lane, {3, 0}).code(), rowe::errc::no_peer);
  EXPECT_EQ(on.count(counter::no_peer), 3U); // two refused, and the one that was under way
}

TEST_F(core_test, refuses_to_publish_when_all_slots_wait_and_counts_it) {
  auto& lane = advertise_pose(on, {.depth = 4});
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
  EXPECT_EQ(publish(on, lane, {9, 0}).code(), rowe::errc::full);
  on.cycle();
  EXPECT_TRUE(publish(on, lane, {5, 0}));
  EXPECT_EQ(browser.hear(), (texts{message(0), message(1), message(2), message(3)}));
  EXPECT_EQ(on.count(counter::full), 1U);
}

TEST_F(core_test, keeps_only_the_newest_value_where_asked_to_and_counts_the_others) {
  auto& lane = advertise_pose(on, {.keep = rowe::keep::newest});
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  for (int i = 1; i <= 5; ++i) ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
  on.cycle();
  EXPECT_EQ(browser.hear(), texts{message(5)});
  EXPECT_EQ(on.count(counter::replaced), 4U);
}

TEST_F(core_test, encodes_once_for_all_peers) {
  auto& lane = advertise_pose(on);
  std::vector<peer> peers;
  for (int i = 0; i < 8; ++i) peers.emplace_back(on).say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  for (peer& p : peers) on.net.weather_of(p.id()).room_bytes = 0; // nobody reads: the messages stay queued
  ASSERT_TRUE(publish(on, lane, {7, 0}));
  on.cycle();
  EXPECT_EQ(on.core.slots_in_use(), 1U);
  for (peer& p : peers) {
    on.net.weather_of(p.id()).room_bytes = 4096;
  }
  on.cycles(2);
  for (peer& p : peers) EXPECT_EQ(p.hear(), texts{message(7)});
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(core_test, sends_nothing_after_its_time_to_live_but_a_frame_already_begun) {
  auto& lane = advertise_pose(on, {.ttl = 20ms});
  peer slow{on};
  slow.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.weather_of(slow.id()).room_bytes = 10; // the first frame begins, no more
  for (int i = 1; i <= 3; ++i) ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
  on.cycle();
  on.cycle(30ms);
  on.net.weather_of(slow.id()).room_bytes = 4096;
  on.cycles(3);
  EXPECT_EQ(slow.hear(), texts{message(1)});
  EXPECT_EQ(on.count(counter::expired), 2U);
  on.cycles(20);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(core_test, drops_what_was_too_old_when_it_was_taken_from_its_lane) {
  auto& lane = advertise_pose(on, {.ttl = 20ms});
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {1, 0}));
  on.cycle(25ms);
  EXPECT_TRUE(browser.hear().empty());
  EXPECT_EQ(on.count(counter::expired), 1U);
}

TEST_F(core_test, sends_a_value_without_time_to_live_only_in_the_cycle_that_sees_it) {
  auto& lane = advertise_pose(on, {.ttl = 0ms});
  peer slow{on};
  slow.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {1, 0}));
  on.cycle(0ms);
  EXPECT_EQ(slow.hear(), texts{message(1)});
  on.net.weather_of(slow.id()).room_bytes = 0;
  ASSERT_TRUE(publish(on, lane, {2, 0}));
  on.cycle(0ms);
  on.net.weather_of(slow.id()).room_bytes = 4096;
  on.cycles(3);
  EXPECT_TRUE(slow.hear().empty());
  EXPECT_EQ(on.count(counter::expired), 1U);
}

TEST_F(core_test, drops_the_oldest_for_a_peer_that_does_not_read_and_counts_it) {
  auto& lane = advertise_pose(on, {.depth = 64});
  peer slow{on};
  peer quick{on};
  for (peer* p : {&slow, &quick}) p->say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.weather_of(slow.id()).room_bytes = 0;
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
    on.cycle();
  }
  EXPECT_EQ(quick.hear().size(), 40U);
  on.net.weather_of(slow.id()).room_bytes = 1 << 20;
  on.cycles(3);
  const auto late = slow.hear();
  ASSERT_EQ(late.size(), 16U); // queue_depth_max
  EXPECT_EQ(late.front(), message(24));
  EXPECT_EQ(late.back(), message(39));
  EXPECT_EQ(on.count(counter::outbox_full), 24U);
}

TEST_F(core_test, gives_a_late_subscriber_the_last_value_of_a_latched_topic) {
  auto& lane = advertise_pose(on, {.latched = true});
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {1, 0}));
  ASSERT_TRUE(publish(on, lane, {2, 0}));
  on.cycle();
  peer late{on};
  late.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycles(2);
  EXPECT_EQ(late.hear(), texts{message(2)});
}

TEST_F(core_test, counts_each_expired_message_of_a_latched_topic) {
  auto& lane = advertise_pose(on, {.ttl = 20ms, .latched = true});
  peer slow{on};
  slow.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.weather_of(slow.id()).room_bytes = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
    on.cycle();
  }
  on.cycles(60);
  EXPECT_EQ(on.count(counter::expired), 10U);
}

TEST_F(core_test, gives_the_newest_only_to_those_who_subscribed_before_it_was_asked_for) {
  peer early{on};
  early.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  auto& lane = advertise_pose(on, {.keep = rowe::keep::newest});
  on.cycle();
  on.net.weather_of(early.id()).room_bytes = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
    on.cycle();
  }
  on.net.weather_of(early.id()).room_bytes = 4096;
  on.cycles(2);
  EXPECT_EQ(early.hear(), texts{message(9)});
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

TEST_F(core_test, writes_urgent_topics_before_others) {
  auto& bulk =
      on.offer(rowe::detail::lane_kind::publish_text, "/bulk", 100, {.priority = rowe::priority::bulk});
  auto& urgent =
      on.offer(rowe::detail::lane_kind::publish_text, "/urgent", 100, {.priority = rowe::priority::urgent});
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/bulk"})");
  browser.say(R"({"op":"subscribe","topic":"/urgent"})");
  on.cycle();
  const auto say = [&](rowe::detail::lane& lane, std::string_view text) {
    ASSERT_TRUE(rowe::detail::publish_into(
        lane, text.size(), on.now, [&](std::byte* slot) { std::memcpy(slot, text.data(), text.size()); }));
  };
  say(bulk, "{}");
  say(bulk, R"({"n":2})");
  say(urgent, "{}");
  on.cycle();
  EXPECT_EQ(browser.hear(), (texts{R"({"op":"publish","topic":"/urgent","msg":{}})",
                                   R"({"op":"publish","topic":"/bulk","msg":{}})",
                                   R"({"op":"publish","topic":"/bulk","msg":{"n":2}})"}));
}

TEST_F(core_test, lets_topics_of_one_priority_take_turns) {
  rowe::endpoint_options options = stage::small_options();
  options.limits.queue_depth_max = 256;
  options.limits.small_slots = 512;
  options.limits.queued_max = 1024;
  theatre busy{options};
  auto& first = busy.offer(rowe::detail::lane_kind::publish_text, "/a", 8, {.depth = 256});
  auto& second = busy.offer(rowe::detail::lane_kind::publish_text, "/b", 8, {.depth = 256});
  peer reader{busy};
  reader.say(R"({"op":"subscribe","topic":"/a"})");
  reader.say(R"({"op":"subscribe","topic":"/b"})");
  busy.cycle();
  busy.net.weather_of(reader.id()).room_bytes = 0;
  for (auto* lane : {&first, &second}) {
    for (int i = 0; i < 128; ++i) {
      ASSERT_TRUE(rowe::detail::publish_into(*lane, 2, busy.now,
                                             [](std::byte* slot) { std::memcpy(slot, "{}", 2); }));
    }
  }
  busy.cycles(4);
  busy.net.weather_of(reader.id()).room_bytes = 64 * 45; // a batch at a time
  bool heard_b = false;
  for (int i = 0; i < 4 && !heard_b; ++i) {
    busy.cycle();
    for (const auto& text : reader.hear()) heard_b = heard_b || text.find("\"/b\"") != std::string::npos;
  }
  EXPECT_TRUE(heard_b); // though /a had enough to fill four batches
}

TEST_F(core_test, writes_not_a_number_as_null_and_counts_it) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {std::numeric_limits<double>::quiet_NaN(), 0}));
  on.cycle();
  EXPECT_EQ(browser.hear(), texts{R"({"op":"publish","topic":"/pose","msg":{"x":null,"y":0}})"});
  EXPECT_EQ(on.count(counter::nonfinite), 1U);
}

TEST_F(core_test, drops_and_counts_text_that_is_no_json_object) {
  auto& lane = on.offer(rowe::detail::lane_kind::publish_text, "/text", 100);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/text"})");
  on.cycle();
  for (const std::string_view text : {"{", "7", "[{}]"}) {
    ASSERT_TRUE(rowe::detail::publish_into(
        lane, text.size(), on.now, [&](std::byte* slot) { std::memcpy(slot, text.data(), text.size()); }));
  }
  on.cycle();
  EXPECT_TRUE(browser.hear().empty());
  EXPECT_EQ(on.count(counter::malformed), 3U);
}

TEST_F(core_test, frees_a_closing_lane_and_its_topic_after_sending_what_it_held) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {4, 0}));
  lane.state.store(rowe::detail::lane_state::closing, std::memory_order_release);
  on.cycle();
  EXPECT_EQ(lane.state.load(std::memory_order_acquire), rowe::detail::lane_state::free);
  EXPECT_EQ(browser.hear(), texts{message(4)});
}

TEST_F(core_test, refuses_a_lane_whose_type_is_not_the_topics) {
  auto& first = advertise_pose(on);
  auto& second = on.offer(rowe::detail::lane_kind::publish_text, "/pose", 100, {}, nullptr, "other/Type");
  on.cycle();
  EXPECT_EQ(first.state.load(std::memory_order_acquire), rowe::detail::lane_state::active);
  EXPECT_EQ(second.state.load(std::memory_order_acquire), rowe::detail::lane_state::refused);
  EXPECT_EQ(second.answer.code, rowe::errc::type_conflict);
}

TEST_F(core_test, lets_a_topic_become_urgent_while_peers_wait_for_it) {
  rowe::endpoint_options options = stage::small_options();
  options.relay = true;
  theatre hub{options};
  peer talker{hub};
  peer listener{hub};
  listener.say(R"({"op":"subscribe","topic":"/pose"})");
  hub.cycle();
  hub.net.weather_of(listener.id()).room_bytes = 0;
  talker.say(R"({"op":"publish","topic":"/pose","msg":{"x":1,"y":0}})");
  hub.cycle();
  advertise_pose(hub, {.keep = rowe::keep::newest, .priority = rowe::priority::urgent});
  hub.cycle();
  talker.say(R"({"op":"publish","topic":"/pose","msg":{"x":2,"y":0}})");
  hub.cycle();
  listener.say(R"({"op":"unsubscribe","topic":"/pose"})");
  hub.cycle();
  EXPECT_EQ(hub.core.slots_in_use(), 0U);
  EXPECT_TRUE(hub.core.check());
}

TEST_F(core_test, wants_the_next_cycle_at_once_when_a_lane_had_more_than_its_share) {
  auto& lane = advertise_pose(on, {.depth = 128});
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
  on.cycle();
  EXPECT_EQ(on.next_wake, on.now);
  on.cycle();
  EXPECT_GT(on.next_wake, on.now);
}

// ---- throttling, as rosbridge has it

struct throttling : core_test {
  // Publishes at 1 kHz for a while and returns what came.
  texts run(peer& to, rowe::detail::lane& lane, int milliseconds) {
    texts all;
    for (int i = 0; i < milliseconds; ++i) {
      EXPECT_TRUE(publish(on, lane, {1.0 * ++x, 0}));
      on.cycle();
      for (auto& text : to.hear()) all.push_back(std::move(text));
    }
    return all;
  }
  int x = 0;
};

TEST_F(throttling, spaces_messages_by_the_throttle_rate) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose","throttle_rate":50})");
  on.cycle();
  EXPECT_EQ(run(browser, lane, 1000).size(), 20U);
  EXPECT_EQ(on.count(counter::throttled), 980U);
}

TEST_F(throttling, with_a_queue_of_one_sends_the_newest_value_when_it_is_due) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose","throttle_rate":100,"queue_length":1})");
  on.cycle();
  const texts heard = run(browser, lane, 500);
  ASSERT_GE(heard.size(), 5U);
  EXPECT_EQ(heard[0], message(1));
  EXPECT_EQ(heard[1], message(101)); // the newest at that time, not the oldest waiting
}

TEST_F(throttling, with_a_longer_queue_drops_the_oldest_and_drains_at_its_rate) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose","throttle_rate":10,"queue_length":3})");
  on.cycle();
  EXPECT_EQ(run(browser, lane, 5), texts{message(1)});
  texts heard;
  for (int i = 0; i < 50; ++i) {
    on.cycle();
    for (auto& text : browser.hear()) heard.push_back(std::move(text));
  }
  EXPECT_EQ(heard, (texts{message(3), message(4), message(5)}));
  EXPECT_EQ(on.count(counter::throttled), 1U); // as asked for, so no loss
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

TEST_F(throttling, takes_a_period_of_centuries_for_what_it_is) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/pose","throttle_rate":9223372036854,"queue_length":1})");
  on.cycle();
  EXPECT_EQ(run(browser, lane, 100), texts{message(1)});
}

TEST_F(throttling, merges_two_subscriptions_of_one_peer_into_one_copy) {
  auto& lane = advertise_pose(on);
  peer browser{on};
  browser.say(R"({"op":"subscribe","id":"a","topic":"/pose","throttle_rate":100})");
  browser.say(R"({"op":"subscribe","id":"b","topic":"/pose"})");
  on.cycle();
  EXPECT_EQ(run(browser, lane, 10).size(), 10U);
  browser.say(R"({"op":"unsubscribe","id":"b","topic":"/pose"})");
  on.cycle();
  EXPECT_LE(run(browser, lane, 50).size(), 1U);
  browser.say(R"({"op":"unsubscribe","id":"a","topic":"/pose"})");
  on.cycle();
  EXPECT_EQ(publish(on, lane, {0, 0}).code(), rowe::errc::no_peer);
}

// ---- the hub

struct hub : testing::Test {
  hub()
      : on{[] {
          auto options = stage::small_options();
          options.relay = true;
          return options;
        }()} {}
  ~hub() override { EXPECT_TRUE(on.core.check()); }
  theatre on;
};

TEST_F(hub, relays_what_one_peer_publishes_to_those_that_subscribed_with_its_text_unchanged) {
  peer talker{on};
  peer listener{on};
  peer bystander{on};
  listener.say(R"({"op":"subscribe","topic":"/chatter"})");
  on.cycle();
  talker.say(R"({"op":"advertise","topic":"/chatter","type":"std_msgs/String"})");
  talker.say(R"({"op":"publish","topic":"\/chatter","msg":{"data": 0.10000000000000001,"n":1e2}})");
  on.cycles(2);
  EXPECT_EQ(listener.hear(),
            texts{R"({"op":"publish","topic":"/chatter","msg":{"data": 0.10000000000000001,"n":1e2}})"});
  EXPECT_TRUE(bystander.hear().empty());
  EXPECT_TRUE(talker.hear().empty());
}

TEST_F(hub, relays_messages_too_large_for_a_small_slot) {
  peer talker{on};
  peer listener{on};
  listener.say(R"({"op":"subscribe","topic":"/big"})");
  on.cycle();
  const std::string body = R"({"data":")" + std::string(6000, 'x') + R"("})";
  talker.say(R"({"op":"publish","topic":"/big","msg":)" + body + "}");
  on.cycles(2);
  EXPECT_EQ(listener.hear() == texts{R"({"op":"publish","topic":"/big","msg":)" + body + "}"}, true);
}

TEST_F(hub, keeps_topics_below_rowe_for_itself) {
  peer talker{on};
  talker.say(R"({"op":"publish","id":"p","topic":"/rowe/stats","msg":{}})");
  talker.say(R"({"op":"advertise","topic":"/rowe/stats","type":"a/B"})");
  on.cycle();
  const auto heard = talker.hear();
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_NE(heard[0].find(R"("op":"status","level":"error","id":"p")"), std::string::npos) << heard[0];
}

TEST_F(hub, delivers_to_subscribers_of_its_own_process_too) {
  auto& inbox = on.offer(rowe::detail::lane_kind::subscribe_text, "/chatter", 1000);
  peer talker{on};
  talker.say(R"({"op":"publish","topic":"/chatter","msg":{"data":1}})");
  on.cycles(2);
  talker.say(R"({"op":"publish","topic":"/chatter","msg":{"data":2}})");
  on.cycle();
  std::string newest;
  while (const auto text = take(inbox)) newest = *text;
  EXPECT_EQ(newest, R"({"data":2})");
}

TEST_F(core_test, does_not_relay_unless_it_is_a_hub) {
  peer talker{on};
  peer listener{on};
  listener.say(R"({"op":"subscribe","topic":"/chatter"})");
  on.cycle();
  talker.say(R"({"op":"publish","topic":"/chatter","msg":{}})");
  on.cycles(2);
  EXPECT_TRUE(listener.hear().empty());
}

// ---- refusals

struct refusals : core_test {
  std::string answer(peer& of, std::string_view request) {
    of.say(request);
    on.cycle();
    const auto heard = of.hear();
    return heard.empty() ? "" : heard.back();
  }
};

TEST_F(refusals, answer_an_unknown_op_with_a_status_that_names_it) {
  peer p{on};
  EXPECT_EQ(answer(p, R"({"op":"jump","id":7})").substr(0, 40),
            R"({"op":"status","level":"error","id":7,"m)");
  EXPECT_EQ(on.count(counter::refused_requests), 1U);
}

TEST_F(refusals, answer_what_is_not_json_and_go_on) {
  peer p{on};
  EXPECT_NE(answer(p, R"({"op":)").find("(at byte 6)"), std::string::npos);
  EXPECT_EQ(on.count(counter::malformed), 1U);
  EXPECT_EQ(answer(p, R"({"op":"subscribe","topic":"/pose"})"), "");
}

TEST_F(refusals, answer_messages_without_op) {
  peer p{on};
  EXPECT_NE(answer(p, R"({"hello":1})").find("op"), std::string::npos);
}

TEST_F(refusals, name_the_limit_on_subscriptions_of_one_peer) {
  peer p{on};
  for (int i = 0; i < 8; ++i) p.say(R"({"op":"subscribe","topic":"/t)" + std::to_string(i) + "\"}");
  on.cycle();
  EXPECT_NE(answer(p, R"({"op":"subscribe","topic":"/more"})").find("subscriptions_per_connection_max"),
            std::string::npos);
}

TEST_F(refusals, name_the_limit_on_topics_and_free_their_places_with_the_peer) {
  std::vector<peer> peers;
  for (int i = 0; i < 3; ++i) peers.emplace_back(on);
  on.cycle();
  std::string last;
  for (int i = 0; i < 20; ++i) {
    last = answer(peers[static_cast<std::size_t>(i) / 8],
                  R"({"op":"subscribe","topic":"/t)" + std::to_string(i) + "\"}");
  }
  EXPECT_NE(last.find("topics_max"), std::string::npos) << last;
  bool told = false;
  while (const auto what = on.board.try_event()) {
    told = told || (what->what_kind == rowe::event::kind::limit &&
                    std::string_view{what->remedy} == "raise `limits::topics_max`");
  }
  EXPECT_TRUE(told);
  for (peer& p : peers) p.leave();
  on.cycles(2);
  peer fresh{on};
  on.cycle();
  EXPECT_EQ(answer(fresh, R"({"op":"subscribe","topic":"/new"})"), "");
}

TEST_F(refusals, name_the_limit_on_advertisements_and_take_them_back) {
  peer p{on};
  for (int i = 0; i < 4; ++i)
    p.say(R"({"op":"advertise","type":"a/B","topic":"/t)" + std::to_string(i) + "\"}");
  on.cycle();
  EXPECT_TRUE(p.hear().empty());
  EXPECT_NE(
      answer(p, R"({"op":"advertise","type":"a/B","topic":"/t9"})").find("advertisements_per_connection_max"),
      std::string::npos);
  EXPECT_EQ(answer(p, R"({"op":"unadvertise","topic":"/t0"})"), "");
  EXPECT_EQ(answer(p, R"({"op":"advertise","type":"a/B","topic":"/t9"})"), "");
  EXPECT_NE(answer(p, R"({"op":"unadvertise","topic":"/t0"})"), "");
}

TEST_F(refusals, name_the_type_that_a_topic_has) {
  peer p{on};
  p.say(R"({"op":"advertise","topic":"/t","type":"a/B"})");
  on.cycle();
  EXPECT_NE(answer(p, R"({"op":"advertise","topic":"/t","type":"a/C"})").find("a/B"), std::string::npos);
}

TEST_F(refusals, answer_an_unsubscribe_without_subscription) {
  peer p{on};
  EXPECT_NE(answer(p, R"({"op":"unsubscribe","topic":"/t"})"), "");
  p.say(R"({"op":"subscribe","id":"a","topic":"/t"})");
  on.cycle();
  EXPECT_NE(answer(p, R"({"op":"unsubscribe","id":"b","topic":"/t"})").find("id"), std::string::npos);
}

TEST_F(refusals, are_silent_after_set_level_none) {
  peer p{on};
  EXPECT_EQ(answer(p, R"({"op":"set_level","level":"none"})"), "");
  EXPECT_EQ(answer(p, R"({"op":"jump"})"), "");
  EXPECT_EQ(on.count(counter::refused_requests), 1U);
}

TEST_F(refusals, close_a_connection_that_sends_binary) {
  peer p{on};
  p.send(rowe::wire::opcode::binary, "x");
  on.cycle();
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1003);
  EXPECT_TRUE(p.cut());
}

TEST_F(refusals, are_bounded_for_a_peer_that_does_not_read_its_answers) {
  peer rude{on};
  on.cycle();
  on.net.weather_of(rude.id()).room_bytes = 0;
  for (int i = 0; i < 1000; ++i) rude.say("nonsense");
  on.cycles(3);
  EXPECT_LE(on.core.slots_in_use(), 64U);
  EXPECT_GT(on.count(counter::outbox_full), 0U);
  rude.leave();
  on.cycles(2);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

// ---- the connection itself

TEST_F(core_test, answers_a_ping_and_a_close) {
  peer p{on};
  p.send(rowe::wire::opcode::ping, "are you there");
  on.cycle();
  (void)p.hear();
  EXPECT_EQ(p.pongs, 1);
  p.send(rowe::wire::opcode::close, std::string_view{"\x03\xe8", 2});
  on.cycle();
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1000);
  EXPECT_TRUE(p.cut());
}

TEST_F(core_test, writes_nothing_after_its_close_frame) {
  auto& lane = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  ASSERT_TRUE(publish(on, lane, {1, 0}));
  p.send(rowe::wire::opcode::close, "");
  on.cycles(2);
  EXPECT_TRUE(p.hear().empty());
  EXPECT_EQ(p.violated, "");
}

TEST_F(core_test, closes_a_connection_that_breaks_the_protocol_with_the_code_for_it) {
  peer p{on};
  const std::byte unmasked[] = {std::byte{0x81}, std::byte{1}, std::byte{'x'}};
  p.send_raw(unmasked);
  on.cycle();
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1002);
  EXPECT_EQ(on.count(counter::violations), 1U);
}

TEST_F(core_test, refuses_a_message_larger_than_its_limit_with_1009) {
  peer p{on};
  p.say(std::string(9000, ' '));
  on.cycle();
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1009);
}

TEST_F(core_test, pings_a_silent_peer_and_keeps_it_while_it_answers) {
  peer p{on};
  for (int i = 0; i < 60; ++i) {
    on.cycle(500ms);
    (void)p.hear();
  }
  EXPECT_GE(p.pings, 5);
  EXPECT_FALSE(p.cut());
}

TEST_F(core_test, cuts_a_peer_that_answers_no_ping) {
  peer p{on};
  p.answers_pings = false;
  for (int i = 0; i < 20; ++i) {
    on.cycle(500ms);
    (void)p.hear();
  }
  EXPECT_EQ(p.pings, 1);
  EXPECT_EQ(p.close_code, 1008);
  EXPECT_EQ(on.count(counter::silent_peers), 1U);
}

TEST_F(core_test, cuts_a_peer_that_does_not_finish_its_message_though_it_goes_on_sending) {
  peer p{on};
  on.cycle();
  const std::byte begin[] = {std::byte{0x01}, std::byte{0x81}, std::byte{0},  std::byte{0},
                             std::byte{0},    std::byte{0},    std::byte{'a'}};
  const std::byte more[] = {std::byte{0x00}, std::byte{0x81}, std::byte{0},  std::byte{0},
                            std::byte{0},    std::byte{0},    std::byte{'a'}};
  p.send_raw(begin);
  for (int i = 0; i < 13; ++i) {
    on.cycle(500ms);
    p.send_raw(more);
    (void)p.hear();
  }
  EXPECT_EQ(p.close_code, 1008);
  EXPECT_EQ(on.count(counter::unfinished_messages), 1U);
}

TEST_F(core_test, gives_everything_back_when_a_peer_vanishes_in_the_middle_of_a_frame) {
  auto& lane = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.weather_of(p.id()).room_bytes = 10;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
  on.cycle();
  EXPECT_GT(on.core.slots_in_use(), 0U);
  p.leave(rowe::service::close_cause::reset);
  on.cycles(2);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
  EXPECT_EQ(on.count(counter::lost_with_peer), 5U);
  EXPECT_EQ(on.board.peers(), 0U);
}

TEST_F(core_test, understands_messages_however_their_bytes_arrive) {
  auto& lane = advertise_pose(on);
  peer p{on};
  on.net.weather_of(p.id()).chunk_bytes_max = 1;
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  EXPECT_TRUE(publish(on, lane, {1, 0}));
}

TEST_F(core_test, continues_a_frame_where_the_socket_stopped_taking_it) {
  auto& lane = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.weather_of(p.id()).room_bytes = 3;
  texts heard;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(publish(on, lane, {1.0 * i, 0}));
  for (int i = 0; i < 200; ++i) {
    on.cycle();
    for (auto& text : p.hear()) heard.push_back(std::move(text));
  }
  EXPECT_EQ(heard, (texts{message(0), message(1), message(2)}));
}

TEST_F(core_test, tells_peers_goodbye_when_it_closes) {
  peer p{on};
  on.cycle();
  on.core.close_all(on.now);
  (void)p.hear();
  EXPECT_EQ(p.close_code, 1001);
}

// ---- statistics and waiting

TEST_F(core_test, publishes_its_statistics_at_their_period_while_somebody_listens) {
  auto& lane = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/rowe/stats"})");
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  texts reports;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(publish(on, lane, {1, 0}));
    on.cycle();
    for (auto& text : p.hear()) {
      if (text.find("/rowe/stats\",\"msg") != std::string::npos) reports.push_back(std::move(text));
    }
  }
  ASSERT_GE(reports.size(), 9U);
  EXPECT_LE(reports.size(), 10U);
  EXPECT_NE(reports.back().find(R"("name":"robot")"), std::string::npos) << reports.back();
  EXPECT_NE(reports.back().find(R"("topic":"/pose","type":"test/Pose")"), std::string::npos)
      << reports.back();
  EXPECT_NE(reports.back().find(R"("losses":{"full":0)"), std::string::npos) << reports.back();
  p.say(R"({"op":"unsubscribe","topic":"/rowe/stats"})");
  on.cycle();
  EXPECT_FALSE(on.core.lanes_wanted() && p.hear().size() > 1);
  on.cycles(300);
  for (const auto& text : p.hear()) EXPECT_EQ(text.find("stats"), std::string::npos);
}

TEST_F(core_test, counts_rates_from_the_time_somebody_listens_to_them) {
  auto& lane = advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(publish(on, lane, {1, 0}));
    on.cycle();
    (void)p.hear();
  }
  p.say(R"({"op":"subscribe","topic":"/rowe/stats"})");
  std::string report;
  for (int i = 0; i < 150 && report.empty(); ++i) {
    ASSERT_TRUE(publish(on, lane, {1, 0}));
    on.cycle();
    for (const auto& text : p.hear()) {
      if (text.find("rate_hz") != std::string::npos) report = text;
    }
  }
  const auto at = report.find(R"("rate_hz":)", report.find("/pose"));
  ASSERT_NE(at, std::string::npos) << report;
  const double rate = std::stod(report.substr(at + 10));
  EXPECT_GT(rate, 900) << report;
  EXPECT_LT(rate, 1100) << report;
}

TEST_F(core_test, tells_its_own_process_statistics_that_it_subscribes_to) {
  auto& inbox = on.offer(rowe::detail::lane_kind::subscribe_text, "/rowe/stats", 4000);
  on.cycles(300);
  EXPECT_TRUE(take(inbox));
}

TEST_F(core_test, has_nothing_to_wake_for_without_peers) {
  advertise_pose(on);
  on.cycle();
  EXPECT_EQ(on.next_wake, rowe::rt::never);
  EXPECT_FALSE(on.core.lanes_wanted());
}

TEST_F(core_test, must_look_at_lanes_while_somebody_listens) {
  advertise_pose(on);
  peer p{on};
  p.say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  EXPECT_TRUE(on.core.lanes_wanted());
  p.leave();
  on.cycles(2);
  EXPECT_FALSE(on.core.lanes_wanted());
}

} // namespace
