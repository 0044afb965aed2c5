// SPDX-License-Identifier: Apache-2.0
// The core as a server: what this process publishes, and who gets it when.
#include "core_fixtures.hpp"

namespace harness {
namespace core_publishing_test {
namespace {

TEST_F(core_test, sends_a_published_struct_to_the_peer_that_subscribed) {
  auto& pair = advertise_pose(on);
  peer browser = subscriber(on, "/pose");
  ASSERT_TRUE(publish_now(on, pair, {1.5, -2}));
  EXPECT_EQ(browser.hear(), texts{R"({"op":"publish","topic":"/pose","msg":{"x":1.5,"y":-2}})"});
}

TEST_F(core_test, tells_a_publisher_that_nobody_listens_and_queues_nothing) {
  auto& pair = advertise_pose(on);
  peer browser{on};
  on.cycle();
  EXPECT_EQ(publish(on, pair, {1, 0}).code(), rowe::errc::no_peer);
  EXPECT_TRUE(browser.ask(R"({"op":"subscribe","topic":"/pose"})").empty());
  EXPECT_TRUE(publish(on, pair, {2, 0}));
  browser.tell(R"({"op":"unsubscribe","topic":"/pose"})");
  EXPECT_EQ(publish(on, pair, {3, 0}).code(), rowe::errc::no_peer);
  EXPECT_EQ(on.count(counter::no_peer), 3U); // two refused, and the one that was under way
}

TEST_F(core_test, refuses_to_publish_when_all_slots_wait_and_counts_it) {
  auto& pair = advertise_pose(on, {.depth = 4});
  peer browser = subscriber(on, "/pose");
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  EXPECT_EQ(publish(on, pair, {9, 0}).code(), rowe::errc::full);
  on.cycle();
  EXPECT_TRUE(publish(on, pair, {5, 0}));
  EXPECT_EQ(browser.hear(), (texts{message(0), message(1), message(2), message(3)}));
  EXPECT_EQ(on.count(counter::full), 1U);
}

TEST_F(core_test, keeps_only_the_newest_value_where_asked_to_and_counts_the_others) {
  auto& pair = advertise_pose(on, {.keep = rowe::keep::newest});
  peer browser = subscriber(on, "/pose");
  for (int i = 1; i <= 5; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  EXPECT_EQ(browser.hear_after(1), texts{message(5)});
  EXPECT_EQ(on.count(counter::replaced), 4U);
}

TEST_F(core_test, encodes_once_for_all_peers) {
  auto& pair = advertise_pose(on);
  std::vector<peer> peers;
  for (int i = 0; i < 8; ++i) peers.emplace_back(on).say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  for (peer& p : peers) on.net.link_of(p.id()).capacity_bytes = 0; // nobody reads: the messages stay queued
  ASSERT_TRUE(publish_now(on, pair, {7, 0}));
  EXPECT_EQ(on.core.slots_in_use(), 1U);
  for (peer& p : peers) on.net.link_of(p.id()).capacity_bytes = 4096;
  on.cycles(2);
  for (peer& p : peers) EXPECT_EQ(p.hear(), texts{message(7)});
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(core_test, sends_nothing_after_its_time_to_live_but_a_frame_already_begun) {
  auto& pair = advertise_pose(on, {.ttl = 20ms});
  peer slow = subscriber(on, "/pose");
  on.net.link_of(slow.id()).capacity_bytes = 10; // the first frame begins, no more
  for (int i = 1; i <= 3; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  on.cycle();
  on.cycle(30ms);
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  EXPECT_EQ(slow.hear_after(3), texts{message(1)});
  EXPECT_EQ(on.count(counter::expired), 2U);
  on.cycles(20);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(core_test, drops_what_was_too_old_when_it_was_taken_from_its_lane) {
  auto& pair = advertise_pose(on, {.ttl = 20ms});
  peer browser = subscriber(on, "/pose");
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  on.cycle(25ms);
  EXPECT_TRUE(browser.hear().empty());
  EXPECT_EQ(on.count(counter::expired), 1U);
}

TEST_F(core_test, sends_a_value_without_time_to_live_only_in_the_cycle_that_sees_it) {
  auto& pair = advertise_pose(on, {.ttl = 0ms});
  peer slow = subscriber(on, "/pose");
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  EXPECT_EQ(slow.hear_after(1), texts{message(1)});
  on.net.link_of(slow.id()).capacity_bytes = 0;
  ASSERT_TRUE(publish_now(on, pair, {2, 0}));
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  EXPECT_TRUE(slow.hear_after(3).empty());
  EXPECT_EQ(on.count(counter::expired), 1U);
}

TEST_F(core_test, drops_the_oldest_for_a_peer_that_does_not_read_and_counts_it) {
  auto& pair = advertise_pose(on, {.depth = 64});
  peer slow{on};
  peer quick{on};
  for (peer* p : {&slow, &quick}) p->say(R"({"op":"subscribe","topic":"/pose"})");
  on.cycle();
  on.net.link_of(slow.id()).capacity_bytes = 0;
  for (int i = 0; i < 40; ++i) ASSERT_TRUE(publish_now(on, pair, {1.0 * i, 0}));
  EXPECT_EQ(quick.hear().size(), 40U);
  on.net.link_of(slow.id()).capacity_bytes = 1 << 20;
  const auto late = slow.hear_after(3);
  ASSERT_EQ(late.size(), 16U); // queue_depth_max
  EXPECT_EQ(late.front(), message(24));
  EXPECT_EQ(late.back(), message(39));
  EXPECT_EQ(on.count(counter::outbox_full), 24U);
}

TEST_F(core_test, gives_a_late_subscriber_the_last_value_of_a_latched_topic) {
  auto& pair = advertise_pose_now(on, {.latched = true});
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  ASSERT_TRUE(publish(on, pair, {2, 0}));
  on.cycle();
  peer late{on};
  EXPECT_EQ(late.ask(R"({"op":"subscribe","topic":"/pose"})", 2), texts{message(2)});
}

TEST_F(core_test, counts_each_expired_message_of_a_latched_topic) {
  auto& pair = advertise_pose(on, {.ttl = 20ms, .latched = true});
  peer slow = subscriber(on, "/pose");
  on.net.link_of(slow.id()).capacity_bytes = 0;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(publish_now(on, pair, {1.0 * i, 0}));
  on.cycles(60);
  EXPECT_EQ(on.count(counter::expired), 10U);
}

TEST_F(core_test, gives_the_newest_only_to_those_who_subscribed_before_it_was_asked_for) {
  peer early = subscriber(on, "/pose");
  auto& pair = advertise_pose_now(on, {.keep = rowe::keep::newest});
  on.net.link_of(early.id()).capacity_bytes = 0;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(publish_now(on, pair, {1.0 * i, 0}));
  on.net.link_of(early.id()).capacity_bytes = 4096;
  EXPECT_EQ(early.hear_after(2), texts{message(9)});
  EXPECT_EQ(on.count(counter::replaced), 9U);
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
}

TEST_F(core_test, writes_urgent_topics_before_others) {
  auto& bulk =
      on.offer(rowe::detail::pair_kind::publish_text, "/bulk", 100, {.priority = rowe::priority::bulk});
  auto& urgent =
      on.offer(rowe::detail::pair_kind::publish_text, "/urgent", 100, {.priority = rowe::priority::urgent});
  peer browser{on};
  browser.say(R"({"op":"subscribe","topic":"/bulk"})");
  browser.say(R"({"op":"subscribe","topic":"/urgent"})");
  on.cycle();
  ASSERT_TRUE(publish_text(on, bulk, "{}"));
  ASSERT_TRUE(publish_text(on, bulk, R"({"n":2})"));
  ASSERT_TRUE(publish_text(on, urgent, "{}"));
  on.cycle();
  EXPECT_EQ(browser.hear(), (texts{R"({"op":"publish","topic":"/urgent","msg":{}})",
                                   R"({"op":"publish","topic":"/bulk","msg":{}})",
                                   R"({"op":"publish","topic":"/bulk","msg":{"n":2}})"}));
}

TEST_F(core_test, lets_topics_of_one_priority_take_turns) {
  core_harness busy{with_limits(small_options(), &limits::queue_depth_max, 256, &limits::small_slots, 512,
                                &limits::queued_max, 1024)};
  auto& first = busy.offer(rowe::detail::pair_kind::publish_text, "/a", 8, {.depth = 256});
  auto& second = busy.offer(rowe::detail::pair_kind::publish_text, "/b", 8, {.depth = 256});
  peer reader{busy};
  reader.say(R"({"op":"subscribe","topic":"/a"})");
  reader.say(R"({"op":"subscribe","topic":"/b"})");
  busy.cycle();
  busy.net.link_of(reader.id()).capacity_bytes = 0;
  for (auto* pair : {&first, &second})
    for (int i = 0; i < 128; ++i) ASSERT_TRUE(publish_text(busy, *pair, "{}"));
  busy.cycles(4);
  busy.net.link_of(reader.id()).capacity_bytes = 64 * 45; // a batch at a time
  bool heard_b = false;
  for (int i = 0; i < 4 && !heard_b; ++i) {
    busy.cycle();
    for (const auto& text : reader.hear()) heard_b = heard_b || text.find("\"/b\"") != std::string::npos;
  }
  EXPECT_TRUE(heard_b); // though /a had enough to fill four batches
}

TEST_F(core_test, writes_not_a_number_as_null_and_counts_it) {
  auto& pair = advertise_pose(on);
  peer browser = subscriber(on, "/pose");
  ASSERT_TRUE(publish_now(on, pair, {std::numeric_limits<double>::quiet_NaN(), 0}));
  EXPECT_EQ(browser.hear(), texts{R"({"op":"publish","topic":"/pose","msg":{"x":null,"y":0}})"});
  EXPECT_EQ(on.count(counter::nonfinite), 1U);
}

TEST_F(core_test, drops_and_counts_text_that_is_no_json_object) {
  auto& pair = on.offer(rowe::detail::pair_kind::publish_text, "/text", 100);
  peer browser = subscriber(on, "/text");
  for (const std::string_view text : {"{", "7", "[{}]"}) ASSERT_TRUE(publish_text(on, pair, text));
  EXPECT_TRUE(browser.hear_after(1).empty());
  EXPECT_EQ(on.count(counter::malformed), 3U);
}

TEST_F(core_test, frees_a_closing_lane_and_its_topic_after_sending_what_it_held) {
  auto& pair = advertise_pose(on);
  peer browser = subscriber(on, "/pose");
  ASSERT_TRUE(publish(on, pair, {4, 0}));
  pair.lifecycle.close();
  on.cycle();
  EXPECT_EQ(pair.lifecycle.look(), rowe::detail::pair_phase::free);
  EXPECT_EQ(browser.hear(), texts{message(4)});
}

TEST_F(core_test, counts_once_what_a_lane_counted_that_a_view_holds) {
  peer other{on};
  auto& pair = on.offer_now(rowe::detail::pair_kind::subscribe_text, "/heard", 100, {.depth = 4});
  other.tell(R"({"op":"publish","topic":"/heard","msg":{"n":1}})");
  std::optional<rowe::subscriber<rowe::json_text>> handle{core_harness::handle_of(pair)};
  std::optional view{handle->try_take()};
  pair.refused_full.add(3);
  handle.reset();
  pair.lifecycle.close(); // as the handle's destructor does
  on.cycles(3);
  ASSERT_EQ(pair.lifecycle.look(), rowe::detail::pair_phase::held);
  EXPECT_EQ(on.count(counter::full), 3U);
  view.reset();
  on.cycles(3);
  ASSERT_EQ(pair.lifecycle.look(), rowe::detail::pair_phase::free);
  EXPECT_EQ(on.count(counter::full), 3U) << "and not again";
}

TEST_F(core_test, lets_a_topic_become_urgent_while_peers_wait_for_it) {
  core_harness hub{hub_options()};
  peer talker{hub};
  peer listener{hub};
  listener.tell(R"({"op":"subscribe","topic":"/pose"})");
  hub.net.link_of(listener.id()).capacity_bytes = 0;
  talker.tell(R"({"op":"publish","topic":"/pose","msg":{"x":1,"y":0}})");
  advertise_pose(hub, {.keep = rowe::keep::newest, .priority = rowe::priority::urgent});
  hub.cycle();
  talker.tell(R"({"op":"publish","topic":"/pose","msg":{"x":2,"y":0}})");
  listener.tell(R"({"op":"unsubscribe","topic":"/pose"})");
  EXPECT_EQ(hub.core.slots_in_use(), 0U);
  EXPECT_TRUE(hub.core.check());
}

TEST_F(core_test, wants_the_next_cycle_at_once_when_a_lane_had_more_than_its_share) {
  auto& pair = advertise_pose(on, {.depth = 128});
  peer p = subscriber(on, "/pose");
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  on.cycle();
  EXPECT_EQ(on.next_wake, on.now);
  on.cycle();
  EXPECT_GT(on.next_wake, on.now);
}

// A core with slots for a queue pair's larger share, and a peer that wants all and may have `queue_length`
// waiting.
struct ample {
  explicit ample(int queue_length)
      : on{with_limits(small_options(), &limits::small_slots, 1024, &limits::queue_depth_max, 256,
                       &limits::queued_max, 1024)} {
    reader.tell(R"({"op":"subscribe","topic":"/pose","queue_length":)" + std::to_string(queue_length) + "}");
  }
  void publish_all(int values) {
    for (int i = 0; i < values; ++i) ASSERT_TRUE(publish(on, pair, {1.0 * i, 0}));
  }
  std::size_t waiting() { return pair.service.out.ring->pending_at_least(); }
  std::size_t heard(std::size_t values) {
    std::size_t all = 0;
    for (int i = 0; i < 100 && all < values; ++i) {
      all += reader.hear().size();
      on.cycle();
    }
    return all;
  }
  core_harness on;
  rowe::detail::queue_pair& pair = advertise_pose(on, {.depth = 300});
  peer reader{on};
};

TEST(core_publishing, takes_more_of_a_queue_pair_at_once_where_everybody_has_room_for_it) {
  ample a{256};
  a.publish_all(300);
  a.on.cycle();
  EXPECT_EQ(a.waiting(), 44U);
  EXPECT_EQ(a.heard(300), 300U);
  EXPECT_TRUE(a.on.core.check());
}

TEST(core_publishing, takes_no_more_of_a_lane_at_once_than_the_smallest_queue_holds) {
  ample a{100};
  peer patient = subscriber(a.on, "/pose");
  a.publish_all(300);
  a.on.cycle();
  EXPECT_EQ(a.waiting(), 200U);
  EXPECT_EQ(a.on.count(counter::outbox_full), 0U);
}

TEST(core_publishing, takes_the_usual_share_of_a_lane_where_a_peer_reads_slowly) {
  ample a{256};
  a.on.net.link_of(a.reader.id()).capacity_bytes = 10;
  a.publish_all(1);
  a.on.cycle();
  a.publish_all(200);
  a.on.cycle();
  EXPECT_EQ(a.waiting(), 200U - 64U);
}

// A queue may begin with what expired long ago, in a slot that another message of the topic has now.
TEST(core_publishing, takes_back_from_peers_that_do_not_read_only_what_they_hold) {
  core_harness on{with_limits(small_options(), &limits::small_slots, 2, &limits::large_slots, 1)};
  auto& lasting = on.offer(rowe::detail::pair_kind::publish_text, "/t", 64);
  auto& brief = on.offer(rowe::detail::pair_kind::publish_text, "/t", 64, {.ttl = 5ms});
  peer stalled{on}, changed{on}, slow{on}, other{on}, asks{on};
  stalled.say(R"({"op":"subscribe","topic":"/t"})");
  changed.say(R"({"op":"subscribe","topic":"/t","throttle_rate":1000,"queue_length":9})");
  slow.say(R"({"op":"subscribe","topic":"/t","throttle_rate":1000,"queue_length":9})");
  on.cycle();
  ASSERT_TRUE(publish_text(on, lasting, R"({"n":0})")); // throttled from here on
  on.cycle();
  on.net.link_of(changed.id()).capacity_bytes = 0;
  changed.say(R"({"op":"nonsense"})"); // its answer takes a slot, and cannot go
  on.cycle();
  ASSERT_TRUE(publish_text(on, brief, R"({"n":1})"));
  on.cycles(20);
  changed.say(R"({"op":"subscribe","topic":"/t","throttle_rate":1000})"); // without a queue
  on.net.link_of(stalled.id()).capacity_bytes = 0;
  on.cycle();
  ASSERT_TRUE(publish_text(on, lasting, R"({"n":2})")); // in the slot that the last one had
  on.cycle();
  on.net.link_of(other.id()).capacity_bytes = 0;
  other.say(R"({"op":"nonsense"})"); // the last slot
  on.cycle();
  asks.tell(R"({"op":"nonsense"})", 1100);
  const auto heard = slow.hear();
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_TRUE(has(heard[1], R"({"n":2})"));
  EXPECT_TRUE(on.core.check());
}

TEST_F(core_test, takes_slots_back_from_peers_that_do_not_read_when_others_need_them) {
  for (const std::size_t bytes : {std::size_t{10}, std::size_t{3000}}) { // of small slots, and of large ones
    core_harness busy;
    auto& pair = busy.offer(rowe::detail::pair_kind::publish_text, "/pose", 4000);
    peer deaf{busy}, deaf_too{busy}, hears{busy};
    for (peer* p : {&deaf, &deaf_too, &hears}) p->say(R"({"op":"subscribe","topic":"/pose"})");
    busy.cycle();
    busy.net.link_of(deaf.id()).capacity_bytes = 0;
    busy.net.link_of(deaf_too.id()).capacity_bytes = 0;
    std::size_t heard = 0;
    for (int i = 0; i < 100; ++i) {
      EXPECT_TRUE(publish_text(busy, pair, R"({"x":")" + std::string(bytes, 'x') + R"("})"));
      heard += hears.hear_after(1).size();
    }
    EXPECT_EQ(heard, 100U);
    EXPECT_EQ(busy.count(counter::no_slot), 0U);
    EXPECT_GT(busy.count(counter::outbox_full), 0U);
    EXPECT_TRUE(busy.core.check());
  }
}

} // namespace
} // namespace core_publishing_test
} // namespace harness
