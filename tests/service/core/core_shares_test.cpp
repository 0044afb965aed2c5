// SPDX-License-Identifier: Apache-2.0
// What one peer may take of what all share, and what it cannot take: slots, topics, services, latched values,
// rates. Each test has one peer that takes all it gets, or is only clumsy, and others that must not notice.
#include "core_fixtures.hpp"

#include <deque>

namespace harness {
namespace core_shares_test {
namespace {

using rowe::detail::pair_kind;
using rowe::detail::pair_phase;

std::string subscribe(std::string_view topic, std::string_view more = "") {
  return R"({"op":"subscribe","topic":")" + std::string{topic} + '"' + std::string{more} + "}";
}

// Adds what it has heard; pings are answered meanwhile.
void hear_more(peer& by, texts& to) {
  for (std::string& text : by.hear()) to.push_back(std::move(text));
}

rowe::detail::queue_pair& offer_text(core_harness& on, pair_kind kind, std::string_view topic,
                                     std::size_t bytes, rowe::topic_options how = {},
                                     std::string_view type = {}) {
  return on.offer_now(kind, topic, bytes, how, nullptr, type);
}

// Closes a queue pair as its handle does.
void give_up(core_harness& on, rowe::detail::queue_pair& pair) {
  pair.lifecycle.close();
  on.cycle();
}

// ---- queues

// A live message in front of expired ones, and a depth that became smaller.
TEST(core_shares, survives_a_queue_that_becomes_shorter_with_expired_messages_behind_a_live_one) {
  core_harness on{hub_options()};
  auto& odom = offer_text(on, pair_kind::publish_text, "/odom", 64, {.ttl = 100ms});
  peer p{on};
  for (int round = 0; round < 5; ++round) {
    p.tell(subscribe("/odom", R"(,"throttle_rate":3600000,"queue_length":16)"));
    (void)publish_text(on, odom, R"({"n":0})"); // throttled from here on
    on.cycles(2);
    p.tell(published("/odom", R"({"n":"lives"})"));
    for (int i = 0; i < 8; ++i) (void)publish_text_now(on, odom, R"({"n":1})");
    on.cycle(220ms);
    p.tell(subscribe("/odom", R"(,"queue_length":1)"));
    (void)publish_text(on, odom, R"({"n":2})");
    on.cycles(2);
    (void)p.ask(R"({"op":"unsubscribe","topic":"/odom"})");
    ASSERT_TRUE(on.core.check()) << round;
  }
  EXPECT_EQ(on.core.slots_in_use(), 0U);
  EXPECT_LT(on.count(counter::expired), 100U);
}

TEST(core_shares, takes_out_what_a_shorter_queue_does_not_hold_any_more) {
  core_harness on{hub_options()};
  auto& pair = offer_text(on, pair_kind::publish_text, "/t", 64);
  peer p = peer_saying(on, subscribe("/t", R"(,"throttle_rate":1000,"queue_length":16)"));
  for (int i = 0; i < 11; ++i) (void)publish_text_now(on, pair, R"({"n":)" + std::to_string(i) + "}");
  ASSERT_EQ(on.core.slots_in_use(), 10U);
  p.tell(subscribe("/t", R"(,"throttle_rate":1000,"queue_length":2)"));
  EXPECT_EQ(on.core.slots_in_use(), 2U);
  on.cycles(3, 1s);
  EXPECT_EQ(count_of(p.hear(), R"("n":9)"), 1U);
}

TEST(core_shares, follows_a_throttle_that_is_lowered_at_once) {
  core_harness on;
  auto& pair = offer_text(on, pair_kind::publish_text, "/t", 64);
  peer p = peer_saying(on, subscribe("/t", R"(,"throttle_rate":3600000,"queue_length":4)"));
  for (int i = 0; i < 3; ++i) (void)publish_text_now(on, pair, R"({"n":)" + std::to_string(i) + "}");
  ASSERT_EQ(p.hear().size(), 1U);
  EXPECT_EQ(p.ask(subscribe("/t", R"(,"throttle_rate":10,"queue_length":4)"), 40).size(), 2U);
  p.tell(subscribe("/t", R"(,"queue_length":4)"));
  for (int i = 3; i < 6; ++i) (void)publish_text(on, pair, R"({"n":)" + std::to_string(i) + "}");
  EXPECT_EQ(p.hear_after(2).size(), 3U);
}

// ---- slots

// Topics of which a peer queues all that it may, and reads nothing.
struct hoard {
  hoard(core_harness& in, std::initializer_list<const char*> names, rowe::topic_options how = {}) : on{in} {
    for (const char* name : names) topics.push_back(&offer_text(on, pair_kind::publish_text, name, 64, how));
    for (const char* name : names)
      reader.say(subscribe(name, R"(,"throttle_rate":3600000,"queue_length":16)"));
  }
  void fill() {
    for (int i = 0; i < 20; ++i) {
      for (auto* one : topics) (void)publish_text(on, *one, R"({"x":1})");
      on.cycle();
    }
  }

  core_harness& on;
  std::vector<rowe::detail::queue_pair*> topics;
  peer reader{on};
};

TEST(core_shares, serves_others_beside_a_reader_that_queues_all_it_may) {
  core_harness on;
  auto& pair = offer_text(on, pair_kind::publish_text, "/live", 64);
  hoard all{on, {"/a", "/b", "/c", "/d"}};
  peer other = peer_saying(on, subscribe("/live"));
  all.fill();
  (void)all.reader.hear();
  texts heard;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(publish_text(on, pair, R"({"x":1})"));
    other.tell(R"({"op":"call_service","id":"c","service":"/rosapi/topics"})");
    hear_more(other, heard);
  }
  EXPECT_EQ(count_of(heard, "/live\",\"msg"), 100U);
  EXPECT_EQ(count_of(heard, "service_response"), 100U);
  EXPECT_EQ(on.count(counter::no_slot), 0U);
  EXPECT_GT(on.count(counter::evicted), 0U);
  EXPECT_TRUE(on.core.check());
}

TEST(core_shares, has_entries_for_others_beside_one_whose_queues_are_full_of_expired_messages) {
  core_harness on{with_limits(small_options(), &limits::queued_max, 40)};
  hoard brief{on, {"/a", "/b", "/c"}, {.ttl = 2ms}};
  auto& live = offer_text(on, pair_kind::publish_text, "/live", 64);
  peer other = peer_saying(on, subscribe("/live"));
  brief.fill();
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(publish_text_now(on, live, R"({"x":1})"));
  EXPECT_EQ(other.hear().size(), 10U);
  EXPECT_TRUE(on.core.check());
}

TEST(core_shares, delivers_large_messages_beside_many_large_latched_values) {
  core_harness on{with_limits(small_options(), &limits::handles_max, 12, &limits::latched_bytes, 64 * 1024)};
  std::vector<rowe::detail::queue_pair*> maps;
  const std::string map = R"({"m":")" + std::string(3000, 'm') + R"("})";
  for (int i = 0; i < 8; ++i) { // twice as many as there are large slots
    maps.push_back(&offer_text(on, pair_kind::publish_text, "/map" + std::to_string(i), 4000,
                               {.depth = 2, .latched = true}));
    ASSERT_TRUE(publish_text_now(on, *maps.back(), map));
  }
  auto& live = offer_text(on, pair_kind::publish_text, "/live", 4000, {.depth = 2});
  peer p = peer_saying(on, subscribe("/live"));
  texts heard;
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(publish_text_now(on, live, map));
    hear_more(p, heard);
  }
  EXPECT_EQ(heard.size(), 10U);
  EXPECT_EQ(on.count(counter::no_slot) + on.count(counter::not_latched), 0U);
  peer late{on};
  for (int i = 0; i < 8; ++i) late.say(subscribe("/map" + std::to_string(i)));
  EXPECT_EQ(count_of(late.hear_during(20), map), 8U);
}

// Slots are taken back while latched values are composed for the one who loses them.
TEST(core_shares, writes_whole_frames_to_one_that_asks_for_much_when_no_slot_is_free) {
  for (const bool reads : {true, false}) {
    core_harness on{with_limits(small_options(), &limits::small_slots, 4, &limits::large_slots, 1,
                                &limits::refusals_per_second_max, 0)};
    std::vector<rowe::detail::queue_pair*> latched;
    for (const char* topic : {"/a", "/b", "/c"}) {
      latched.push_back(&offer_text(on, pair_kind::publish_text, topic, 64, {.latched = true}));
      (void)publish_text_now(on, *latched.back(), R"({"kept":1})");
    }
    peer p{on};
    if (!reads) on.net.link_of(p.id()).capacity_bytes = 30;
    for (int i = 0; i < 30; ++i) p.say(R"({"op":"unsubscribe","topic":"/none"})");
    for (const char* topic : {"/a", "/b", "/c"}) p.say(subscribe(topic));
    for (int i = 0; i < 30; ++i) p.say(R"({"op":"unsubscribe","topic":"/none"})");
    texts heard;
    for (int i = 0; i < 100; ++i) {
      on.cycle();
      ASSERT_TRUE(on.core.check());
      hear_more(p, heard);
      on.net.link_of(p.id()).capacity_bytes += 100;
    }
    EXPECT_EQ(p.violated, "");
    EXPECT_EQ(count_of(heard, "kept"), 3U);
  }
}

TEST(core_shares, sends_messages_to_everyone_beside_one_that_queues_all_it_may) {
  core_harness on;
  hoard all{on, {"/a", "/b", "/c", "/d"}};
  peer fine = peer_saying(on, "{}");
  all.fill();
  ASSERT_GT(on.core.slots_in_use(), 60U);
  std::size_t heard = 0;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(
        on.submissions.submit({.what = rowe::detail::entry::message, .stamped = on.now}, R"({"a":1})"));
    heard += fine.hear_after(1).size();
  }
  EXPECT_EQ(heard, 100U);
}

// Each message to everyone keeps its slot until the slowest has it. Those that do not read may keep half,
// also if each keeps others.
TEST(core_shares, sends_messages_beside_those_that_take_messages_and_do_not_read) {
  core_harness on;
  peer fine{on};
  fine.say("{}");
  std::deque<peer> slow;
  std::size_t heard = 0, said = 0;
  while (slow.size() != 7) {
    slow.emplace_back(on).say("{}");
    on.cycle();
    on.net.link_of(slow.back().id()).capacity_bytes = 0;
    for (int i = 0; i < 20; ++i, ++said) {
      ASSERT_TRUE(
          on.submissions.submit({.what = rowe::detail::entry::message, .stamped = on.now}, R"({"a":1})"));
      on.cycle();
      ASSERT_TRUE(on.core.check());
      heard += fine.hear().size();
    }
    EXPECT_EQ(heard, said) << slow.size();
  }
  EXPECT_GT(on.count(counter::outbox_full), 0U) << "what the others lose is counted";
  ASSERT_TRUE(on.submissions.submit({.what = rowe::detail::entry::message,
                                     .peer = {fine.id().index, fine.id().generation},
                                     .stamped = on.now},
                                    R"({"b":1})"));
  EXPECT_EQ(fine.hear_after(1), texts{R"({"b":1})"});
}

TEST(core_shares, counts_a_latched_value_for_which_there_is_no_room_and_delivers_it_all_the_same) {
  core_harness on{with_limits(small_options(), &limits::latched_bytes, 2048)}; // two blocks
  auto& pair = offer_text(on, pair_kind::publish_text, "/map", 4000, {.latched = true});
  peer p = peer_saying(on, subscribe("/map"));
  ASSERT_TRUE(publish_text(on, pair, R"({"m":")" + std::string(3000, 'm') + R"("})"));
  EXPECT_EQ(p.hear_after(1).size(), 1U);
  EXPECT_EQ(on.count(counter::not_latched), 1U);
  ASSERT_TRUE(publish_text_now(on, pair, R"({"m":1})"));
  peer late{on};
  EXPECT_EQ(late.ask(subscribe("/map"), 2).size(), 1U);
}

// ---- what is latched, and by whom

TEST(core_shares, keeps_no_value_for_those_who_latch_nothing) {
  core_harness on{hub_options()};
  peer latches{on}, plain{on};
  latches.say(R"({"op":"advertise","topic":"/t","type":"a/B","latch":true})");
  plain.say(published("/t", R"({"from":"plain"})"));
  on.cycle();
  peer late{on};
  EXPECT_EQ(late.ask(subscribe("/t")).size(), 0U);
  latches.say(published("/t", R"({"from":"latches"})"));
  plain.say(published("/t", R"({"from":"plain"})"));
  on.cycle();
  peer later{on};
  const std::string heard = only(later.ask(subscribe("/t")));
  EXPECT_TRUE(has(heard, "latches"));
}

TEST(core_shares, forgets_a_latched_value_with_the_peer_that_latched_it) {
  for (const bool leaves : {true, false}) {
    core_harness on{hub_options()};
    peer keeps_topic{on};
    keeps_topic.say(subscribe("/t"));
    auto latches = std::make_unique<peer>(on);
    latches->say(R"({"op":"advertise","topic":"/t","type":"a/B","latch":true})");
    latches->say(published("/t", R"({"n":1})"));
    on.cycle();
    leaves ? latches->leave() : latches->say(R"({"op":"unadvertise","topic":"/t"})");
    on.cycle();
    peer late{on};
    EXPECT_EQ(late.ask(subscribe("/t"), 2).size(), 0U) << leaves;
  }
}

TEST(core_shares, does_not_put_a_peers_value_in_the_place_of_what_this_process_latches) {
  core_harness on{hub_options()};
  auto& map = offer_text(on, pair_kind::publish_text, "/map", 64, {.latched = true});
  ASSERT_TRUE(publish_text_now(on, map, R"({"from":"robot"})"));
  peer rude{on};
  rude.say(R"({"op":"advertise","topic":"/map","latch":true})");
  rude.say(published("/map", R"({"from":"stranger"})"));
  on.cycle();
  peer late{on};
  const std::string heard = only(late.ask(subscribe("/map")));
  EXPECT_TRUE(has(heard, "robot"));
  give_up(on, map);
  peer later{on};
  EXPECT_EQ(later.ask(subscribe("/map")).size(), 0U);
}

TEST(core_shares, lets_no_peer_latch_more_than_its_share) {
  auto options = hub_options();
  options.limits.latched_bytes = 16 * 1024; // sixteen blocks, eight for peers
  options.limits.topics_max = 64;
  options.limits.advertisements_per_connection_max = 17;
  core_harness on{options};
  peer greedy{on}, other{on};
  for (int i = 0; i < 16; ++i) {
    const std::string topic = "/g" + std::to_string(i);
    greedy.say(R"({"op":"advertise","topic":")" + topic + R"(","latch":true})");
    greedy.say(published(topic, R"({"n":1})"));
  }
  on.cycles(4);
  EXPECT_EQ(on.count(counter::not_latched), 14U); // of the eight, four are kept for others
  other.say(R"({"op":"advertise","topic":"/o","latch":true})");
  other.say(published("/o", R"({"n":1})"));
  on.cycles(2);
  EXPECT_EQ(on.count(counter::not_latched), 14U);
  // Nor does a value that is refused end what another one has there.
  greedy.say(published("/o", R"({"n":2})"));
  greedy.say(R"({"op":"advertise","topic":"/o","latch":true})");
  greedy.say(published("/o", R"({"n":3})"));
  on.cycles(2);
  EXPECT_EQ(on.count(counter::not_latched), 15U);
  peer late{on};
  EXPECT_EQ(count_of(late.ask(subscribe("/o"), 2), R"({"n":1})"), 1U);
}

// Each that comes takes all that it gets, and nothing is given back.
TEST(core_shares, keeps_some_of_each_pool_for_who_comes_last) {
  core_harness on{with_limits(hub_options(), &limits::latched_bytes, 40 * 1024)};
  offer_text(on, pair_kind::publish_text, "/odom", 64);
  std::vector<std::unique_ptr<peer>> greedy;
  const auto say_all = [&](peer& one, int who) {
    one.say(R"({"op":"advertise_service","service":"/never","type":"a/B"})");
    for (int i = 0; i < 8; ++i) {
      const std::string n = std::to_string(i), name = "/g" + std::to_string(who) + "_" + n;
      one.say(R"({"op":"advertise_service","service":")" + name + R"(","type":"a/B"})");
      one.say(R"({"op":"call_service","id":")" + n + R"(","service":"/never"})");
      one.say(R"({"op":"advertise","topic":")" + name + R"(","latch":true})");
      one.say(published(name, R"({"n":1})"));
    }
    for (int i = 0; i < 8; ++i) // each spelling is a subscription
      one.say(subscribe("/g" + std::to_string(i / 2) + "_0"));
  };
  for (int who = 0; who < 7; ++who) {
    greedy.push_back(std::make_unique<peer>(on));
    say_all(*greedy.back(), who);
    on.cycles(4);
    for (auto& one : greedy) (void)one->hear();
  }
  EXPECT_EQ(on.core.inconsistency(), "");
  const std::uint64_t not_latched = on.count(counter::not_latched);
  peer last{on};
  last.say(subscribe("/odom"));
  last.say(R"({"op":"advertise","topic":"/mine","latch":true})");
  last.say(published("/mine", R"({"n":1})"));
  last.say(R"({"op":"advertise_service","service":"/mine","type":"a/B"})");
  last.say(R"({"op":"call_service","id":"1","service":"/rosapi/topics"})");
  const texts heard = last.hear_after(4);
  EXPECT_EQ(count_of(heard, R"("result":true)"), 1U);
  EXPECT_EQ(count_of(heard, R"("op":"status")"), 0U) << (heard.empty() ? "" : heard[0]);
  EXPECT_EQ(on.count(counter::not_latched), not_latched);
}

TEST(core_shares, lets_a_report_find_room_whatever_topics_peers_make_up) {
  core_harness on{
      with_limits(hub_options(), &limits::topics_max, 128, &limits::advertisements_per_connection_max, 64)};
  offer_text(on, pair_kind::publish_text, "/odom", 64);
  peer makes{on}, asks{on};
  for (int i = 0; i < 64; ++i) {
    std::string quotes;
    for (int k = 0; k < 100; ++k) quotes += "\\\"";
    makes.say(R"({"op":"advertise","topic":"/)" + quotes + std::to_string(i) + R"(","type":")" + quotes +
              "\"}");
  }
  on.cycles(10);
  asks.say(R"({"op":"call_service","id":"1","service":"/rowe/stats"})");
  asks.say(subscribe("/rowe/stats"));
  const texts heard = asks.hear_after(3);
  ASSERT_EQ(count_of(heard, R"("result":true)"), 1U) << heard.size();
  EXPECT_EQ(count_of(heard, R"("topic":"/odom")"), 1U);
  EXPECT_EQ(count_of(heard, R"("topics_left_out":0)"), 0U);
}

// A slot is free only when everybody has lost the message in it.
TEST(core_shares, finds_slots_beside_many_that_hold_the_same_messages) {
  constexpr int topics = 30;
  core_harness on{with_limits(hub_options(), &limits::small_slots, 256, &limits::topics_max, 128,
                              &limits::subscriptions_max, 1024, &limits::subscriptions_per_connection_max, 64,
                              &limits::queued_max, 8192)};
  const auto name = [](int i) { return "/t" + std::to_string(i); };
  std::deque<peer> hoard;
  for (int i = 0; i < 6; ++i) {
    hoard.emplace_back(on);
    for (int t = 0; t < topics; ++t)
      hoard.back().say(subscribe(name(t), R"(,"throttle_rate":3600000,"queue_length":16)"));
    on.cycles(2);
  }
  peer feeds{on}, fine{on};
  std::size_t answered = 0;
  for (int i = 0; i < 200; ++i) {
    for (int t = 0; t < topics; ++t) feeds.say(published(name((t + i) % topics), "{}"));
    fine.say(R"({"op":"call_service","id":"1","service":"/rosapi/topics"})");
    answered += count_of(fine.hear_after(3), R"("result":true)");
  }
  EXPECT_EQ(answered, 200U);
  EXPECT_EQ(on.count(counter::no_slot), 0U);
}

// ---- slots that sockets have

const std::string large_text = R"({"x":")" + std::string(3000, 'x') + "\"}";

// A topic each of whose messages needs a large slot.
struct maps {
  explicit maps(std::uint32_t large_slots, rowe::topic_options how = {})
      : on{with_limits(hub_options(), &limits::large_slots, large_slots)},
        topic{offer_text(on, pair_kind::publish_text, "/map", 4000, how)} {}
  ~maps() { EXPECT_EQ(on.core.inconsistency(), ""); }
  void publish() { (void)publish_text_now(on, topic, large_text); }
  // Its socket takes a part of a message, and its transport so many bytes of the rest.
  void is_slow(peer& one, std::size_t rest_bytes_max = 0) {
    auto& how = on.net.link_of(one.id());
    how.capacity_bytes = 500;
    how.rest_bytes_max = rest_bytes_max;
  }
  void want(std::initializer_list<peer*> who) {
    for (peer* one : who) one->say(subscribe("/map", R"(,"queue_length":1)"));
    on.cycle();
  }

  core_harness on;
  rowe::detail::queue_pair& topic;
};

// Each keeps a slot of which its socket has taken a part.
TEST(core_shares, has_slots_left_beside_peers_that_finish_no_large_message) {
  maps map{8}; // two of the slots are for sockets
  auto& on = map.on;
  std::deque<peer> deaf;
  for (int i = 0; i < 6; ++i) { // each has another message begun
    map.is_slow(deaf.emplace_back(on));
    map.want({&deaf.back()});
    map.publish();
  }
  peer reads{on};
  reads.say(subscribe("/map", R"(,"queue_length":1)"));
  reads.say(R"({"op":"call_service","id":"1","service":"/rowe/stats"})");
  texts heard;
  for (int ms = 0; ms < 2500; ms += 10) {
    map.publish();
    on.cycle(9ms);
    hear_more(reads, heard);
    EXPECT_EQ(on.core.inconsistency(), "");
  }
  EXPECT_GT(count_of(heard, R"("topic":"/map")"), 20U);
  EXPECT_EQ(count_of(heard, R"("result":true)"), 1U);
  EXPECT_EQ(on.count(counter::stalled_peers), 2U) << "those that were waited for, and nobody else";
}

// A transport that keeps the rest of frames itself, as sockets can.
TEST(core_shares, lets_nobody_wait_where_the_transport_keeps_the_rest_of_frames) {
  maps map{8};
  std::deque<peer> deaf;
  for (int i = 0; i < 6; ++i) {
    map.is_slow(deaf.emplace_back(map.on), SIZE_MAX);
    map.want({&deaf.back()});
    map.publish();
  }
  peer reads{map.on};
  map.want({&reads});
  texts heard;
  for (int i = 0; i < 10; ++i) {
    map.publish();
    hear_more(reads, heard);
  }
  EXPECT_EQ(count_of(heard, R"("topic":"/map")"), 10U);
  for (std::size_t i = 1; i < deaf.size(); ++i) // the first one's is in nobody's way
    EXPECT_EQ(count_of(deaf[i].hear(), R"("topic":"/map")"), 1U) << "and whole";
}

// Of so few large slots sockets may have one.
TEST(core_shares, lets_nobody_wait_where_there_is_one_large_slot_and_the_transport_keeps_the_rest) {
  maps map{1};
  peer deaf{map.on}, reads{map.on};
  map.is_slow(deaf, SIZE_MAX);
  map.want({&deaf, &reads});
  texts heard;
  for (int i = 0; i < 10; ++i) {
    map.publish();
    hear_more(reads, heard);
  }
  EXPECT_EQ(count_of(heard, R"("topic":"/map")"), 10U);
}

// Who waited for others' frames to end, and has nothing to write any more.
TEST(core_shares, cuts_nobody_for_a_peer_that_has_left) {
  maps map{4}; // one of the slots is for sockets
  auto& on = map.on;
  peer slow{on}, waits{on};
  map.is_slow(slow);
  map.want({&slow});
  (void)publish_text(on, map.topic, large_text);
  on.cycles(50, 20ms); // more than a frame may be under way while others wait
  map.want({&waits});
  map.publish();
  waits.leave();
  on.cycles(200, 20ms);
  EXPECT_EQ(on.count(counter::stalled_peers), 0U);
}

// Nobody waits for what it has.
TEST(core_shares, cuts_no_peer_for_its_slow_reading_alone) {
  maps map{8, {.depth = 2}};
  auto& on = map.on;
  peer slow{on}, reads{on};
  map.is_slow(slow);
  map.want({&slow, &reads});
  texts heard;
  for (int ms = 0; ms < 5000; ms += 10) {
    (void)publish_text(on, map.topic, large_text);
    on.cycle(10ms);
    hear_more(reads, heard);
  }
  EXPECT_GT(count_of(heard, R"("topic":"/map")"), 400U);
  EXPECT_EQ(on.count(counter::stalled_peers), 0U);
}

// ---- events

TEST(core_shares, tells_so_many_times_a_second_that_somebody_came_or_said_something_is_wrong) {
  core_harness on;
  peer says{on};
  for (int i = 0; i < 100; ++i) says.say(R"({"op":"status","level":"error","msg":"wrong"})");
  on.cycles(10);
  std::size_t statuses = 0;
  while (const auto one = on.shared.try_event())
    statuses += one->what_kind == rowe::event::kind::status_from_peer;
  EXPECT_EQ(statuses, 8U);
  EXPECT_EQ(on.count(counter::events_lost), 92U);
  std::size_t comings = 0;
  for (int i = 0; i < 500; ++i) { // a second
    peer comes{on};
    on.cycle();
    comes.leave();
    on.cycle();
    while (const auto one = on.shared.try_event())
      comings +=
          one->what_kind == rowe::event::kind::peer_joined || one->what_kind == rowe::event::kind::peer_left;
  }
  EXPECT_LE(comings, 128U + 50U + 1U);
  EXPECT_GE(comings, 128U);
}

TEST(core_shares, has_room_for_events_of_this_process_however_many_peers_come_and_go) {
  core_harness on;
  for (std::uint32_t i = 0; i < on.options.limits.events_max; ++i) {
    peer comes{on};
    on.cycle();
    comes.leave();
    on.cycle();
  }
  EXPECT_GT(on.count(counter::events_lost), 0U);
  offer_text(on, pair_kind::publish_text, "/a", 64, {}, "test/A");
  offer_text(on, pair_kind::publish_text, "/a", 64, {}, "test/B"); // which is refused
  bool told = false;
  while (const auto one = on.shared.try_event()) told = told || one->what_kind == rowe::event::kind::warning;
  EXPECT_TRUE(told);
}

// ---- topics

TEST(core_shares, leaves_this_process_places_for_its_topics_and_its_stop) {
  core_harness on;
  std::vector<std::unique_ptr<peer>> crowd;
  for (int k = 0; k < 7; ++k) {
    crowd.push_back(std::make_unique<peer>(on));
    for (int i = 0; i < 40; ++i) {
      const std::string name = "/x" + std::to_string(k) + "_" + std::to_string(i);
      crowd.back()->say(i % 2 == 0 ? subscribe(name) : R"({"op":"advertise","topic":")" + name + R"("})");
    }
    on.cycles(3);
  }
  for (int i = 0; i < 4; ++i) {
    auto& pair = offer_text(on, pair_kind::publish_text, "/mine" + std::to_string(i), 64);
    EXPECT_EQ(pair.lifecycle.look(), pair_phase::active) << i;
  }
  EXPECT_EQ(on.offer(rowe::detail::latch_request({})).lifecycle.look(), pair_phase::offered);
  on.cycle();
  peer page{on};
  EXPECT_EQ(page.ask(subscribe("/rowe/stop/state")).size(), 1U);
}

TEST(core_shares, takes_places_back_that_handles_left_to_those_who_subscribed) {
  core_harness on{with_limits(small_options(), &limits::topics_max, 8)};
  peer greedy{on}, other{on};
  other.say(subscribe("/others"));
  for (int i = 0; i < 12; ++i) { // each costs its subscriber nothing, and stays when the handle closes
    auto& pair = offer_text(on, pair_kind::publish_text, "/left" + std::to_string(i), 64);
    ASSERT_EQ(pair.lifecycle.look(), pair_phase::active) << i;
    greedy.say(subscribe("/left" + std::to_string(i)));
    greedy.say(R"({"op":"advertise","topic":"/left)" + std::to_string(i) + R"("})");
    on.cycle();
    give_up(on, pair);
  }
  EXPECT_EQ(on.core.inconsistency(), "");
  EXPECT_EQ(other.hear().size(), 0U) << "it is taken from who holds most";
  const texts said = greedy.hear();
  EXPECT_EQ(count_of(said, "is given up: this process needs its place (limit topics_max)"), 7U);
}

TEST(core_shares, lets_no_peer_make_up_more_topics_than_it_leaves) {
  core_harness on{with_limits(small_options(), &limits::topics_max, 20)}; // twelve of them for peers
  peer greedy{on}, other{on};
  for (int i = 0; i < 8; ++i) greedy.say(subscribe("/g" + std::to_string(i)));
  const texts said = greedy.hear_after(1);
  ASSERT_EQ(said.size(), 5U);
  EXPECT_TRUE(has(said[0], "holds 3, 9 of 12 are left, 6 of them reserved for peers that hold fewer "
                           "(limit topics_max)"));
  EXPECT_EQ(other.ask(subscribe("/mine")).size(), 0U);
  greedy.say(subscribe("/mine")); // no more than it leaves, whoever made it
  EXPECT_EQ(greedy.ask(R"({"op":"unsubscribe","topic":"/g0"})").size(), 1U);
}

// Many hold one topic, somebody takes what he gets, and they leave: what is kept for those who come is there.
TEST(core_shares, charges_one_of_those_who_share_a_topic) {
  auto options = hub_options();
  options.limits.connections_max = 20;
  options.limits.topics_max = 68; // sixty less eight for this process
  options.limits.subscriptions_max = 400;
  options.limits.subscriptions_per_connection_max = 64;
  core_harness on{options};
  std::vector<std::unique_ptr<peer>> shares;
  for (int i = 0; i < 15; ++i) {
    shares.push_back(std::make_unique<peer>(on));
    shares.back()->say(subscribe("/shared"));
  }
  on.cycle();
  std::vector<std::unique_ptr<peer>> greedy;
  for (int who = 0; who < 3; ++who) {
    greedy.push_back(std::make_unique<peer>(on));
    for (int i = 0; i < 60; ++i)
      greedy.back()->say(subscribe("/g" + std::to_string(who) + "_" + std::to_string(i)));
    on.cycles(4);
  }
  peer late{on};
  late.say(subscribe("/shared")); // which takes no place
  EXPECT_EQ(late.hear_after(1).size(), 0U);
  for (auto& one : shares) one->leave();
  on.cycles(2);
  std::size_t refused = 0;
  std::vector<std::unique_ptr<peer>> last;
  for (int i = 0; i < 15; ++i) {
    last.push_back(std::make_unique<peer>(on));
    last.back()->say(subscribe("/mine" + std::to_string(i)));
    on.cycle();
    refused += last.back()->hear().size();
  }
  EXPECT_EQ(refused, 0U);
  EXPECT_EQ(on.core.inconsistency(), "");
}

TEST(core_shares, charges_nobody_for_topics_of_this_process) {
  core_harness on;
  for (int i = 0; i < 4; ++i) offer_text(on, pair_kind::publish_text, "/mine" + std::to_string(i), 64);
  peer p{on};
  for (int i = 0; i < 4; ++i) p.say(subscribe("/mine" + std::to_string(i)));
  for (int i = 0; i < 4; ++i) p.say(subscribe("/other" + std::to_string(i)));
  EXPECT_EQ(p.hear_after(1).size(), 0U);
}

TEST(core_shares, gives_a_topic_the_type_of_this_process_whoever_named_it_first) {
  core_harness on;
  peer early = peer_saying(on, R"({"op":"advertise","topic":"/cmd","type":"strange/Type"})");
  auto& pair = offer_text(on, pair_kind::subscribe_text, "/cmd", 64, {}, "geometry_msgs/Twist");
  EXPECT_EQ(pair.lifecycle.look(), pair_phase::active);
  const std::string said = only(early.hear());
  EXPECT_TRUE(has(said, "/cmd has the type geometry_msgs/Twist here now; it was advertised as strange/Type"));
  auto& second = offer_text(on, pair_kind::publish_text, "/cmd", 64, {}, "other/Type"); // of one process
  EXPECT_EQ(second.lifecycle.look(), pair_phase::refused);
  peer late = peer_saying(on, R"({"op":"advertise","topic":"/cmd","type":"strange/Type"})");
  EXPECT_EQ(count_of(late.hear(), "exists with the type"), 1U);
}

// ---- services and calls

TEST(core_shares, gives_a_service_to_this_process_whoever_advertised_it_first) {
  core_harness on{hub_options()};
  peer early{on}, asks{on};
  early.say(R"({"op":"advertise_service","service":"/add","type":"a/Add"})");
  for (int i = 0; i < 20; ++i)
    early.say(R"({"op":"advertise_service","service":"/x)" + std::to_string(i) + R"(","type":"a/Add"})");
  const texts refused = early.hear_after(1);
  // Of sixteen services ten are for peers, five of them kept for those who have none, and one may have three.
  EXPECT_EQ(refused.size(), 18U);
  auto& mine = on.offer_now({.kind = pair_kind::respond_text,
                             .name = "/add",
                             .out_depth = 1,
                             .in_depth = 1,
                             .completions_depth = 1,
                             .out_bytes = 64,
                             .in_bytes = 64,
                             .completions_bytes = 64});
  EXPECT_EQ(mine.lifecycle.look(), pair_phase::active);
  EXPECT_EQ(count_of(early.hear(), "this process provides /add now"), 1U);
  asks.tell(R"({"op":"call_service","id":"1","service":"/add","args":{"a":1}})");
  EXPECT_TRUE(take(mine)) << "the handle was asked";
  peer other{on};
  EXPECT_EQ(other.ask(R"({"op":"advertise_service","service":"/other","type":"a/Add"})").size(), 0U);
}

TEST(core_shares, leaves_calls_to_others_beside_one_that_asks_for_what_is_never_answered) {
  core_harness on{hub_options()}; // sixteen calls, twelve for peers, four for one
  peer provides{on}, first{on}, second{on}, third{on};
  provides.tell(R"({"op":"advertise_service","service":"/never","type":"a/B"})");
  for (peer* one : {&first, &second, &third}) {
    for (int i = 0; i < 6; ++i)
      one->say(R"({"op":"call_service","id":")" + std::to_string(i) + R"(","service":"/never"})");
  }
  on.cycles(2);
  peer fine = peer_saying(on, R"({"op":"call_service","id":"1","service":"/rosapi/topics"})");
  EXPECT_EQ(count_of(fine.hear(), R"("result":true)"), 1U);
  // And none of them lasts for ever, although nobody named a time.
  for (int i = 0; i < 80; ++i) {
    on.cycle(500ms);
    for (peer* one : {&provides, &first, &second, &third, &fine}) (void)one->hear();
  }
  EXPECT_GT(on.count(counter::calls_timed_out), 0U);
}

// ---- rates

TEST(core_shares, drops_what_a_peer_says_beyond_its_rate_but_not_a_stop) {
  core_harness on{with_limits(hub_options(), &limits::messages_per_second_max, 100)};
  (void)on.offer(rowe::detail::latch_request({}));
  peer flood{on}, other{on};
  other.tell(subscribe("/t"));
  texts heard;
  for (int i = 0; i < 60; ++i) {
    for (int k = 0; k < 5; ++k) flood.say(published("/t", R"({"n":1})"));
    on.cycle(1us);
    hear_more(other, heard);
  }
  flood.say(R"({"op":"publish","topic":"\/rowe\/stop","msg":{}})");
  flood.say(R"({"op":"call_service","id":"s","service":"/rowe/stop","args":{"source":"x"}})");
  flood.say(R"({"service":"/rowe/stop","message_id":"b"})");
  on.cycle();
  EXPECT_EQ(count_of(heard, "/t"), 100U);
  EXPECT_EQ(on.count(counter::over_rate), 200U);
  EXPECT_EQ(on.count(counter::stops), 3U);
  EXPECT_FALSE(flood.cut());
  for (int i = 0; i < 20; ++i) { // and its rate comes back
    on.cycle(100ms);
    (void)flood.hear();
    (void)other.hear();
  }
  flood.tell(published("/t", R"({"n":2})"), 2);
  EXPECT_EQ(count_of(other.hear(), R"("n":2)"), 1U);
}

TEST(core_shares, cuts_a_peer_that_goes_on_beyond_its_rate) {
  core_harness on{with_limits(small_options(), &limits::messages_per_second_max, 10)};
  peer flood{on};
  int seconds = 0;
  for (; seconds < 20 && !flood.cut(); ++seconds) {
    for (int i = 0; i < 10 && !flood.cut(); ++i) {
      for (int k = 0; k < 5; ++k) flood.say(R"({"op":"unsubscribe","topic":"/none"})");
      on.cycle(100ms);
      (void)flood.hear();
    }
  }
  EXPECT_EQ(seconds, 6); // the first one is a burst
  EXPECT_EQ(flood.close_code, 1008);
  EXPECT_EQ(flood.close_reason,
            "more than 10 messages a second for 5 s: send fewer (limit messages_per_second_max)");
  EXPECT_EQ(on.count(counter::flooding_peers), 1U);
}

// Who calls waits for an answer.
TEST(core_shares, answers_each_call_that_it_refuses) {
  core_harness on;
  peer wakes{on};
  on.cycle();
  for (int i = 0; i < 50; ++i)
    wakes.say(R"({"op":"call_service","id":")" + std::to_string(i) + R"(","service":"/none"})");
  EXPECT_EQ(count_of(wakes.hear_after(2), R"("result":false)"), 50U);
  EXPECT_EQ(on.count(counter::refusals_unsaid), 0U);
}

TEST(core_shares, cuts_nobody_because_others_have_taken_all_calls) {
  core_harness on{hub_options()};
  peer provides{on}, asks{on};
  provides.tell(R"({"op":"advertise_service","service":"/never","type":"a/B"})");
  for (int i = 0; i < 4000; ++i) {
    asks.say(R"({"op":"call_service","id":")" + std::to_string(i) + R"(","service":"/never"})");
    on.cycle(5ms);
    (void)asks.hear();
    (void)provides.hear();
  }
  EXPECT_GT(on.count(counter::calls_refused), 3000U);
  EXPECT_FALSE(asks.cut());
}

TEST(core_shares, says_and_reports_refusals_that_repeat_so_often_and_counts_the_others) {
  core_harness on;
  peer clumsy{on};
  on.cycle();
  while (on.shared.try_event()) continue;
  for (int i = 0; i < 50; ++i) clumsy.say(R"({"op":"unsubscribe","topic":"/none"})");
  EXPECT_EQ(clumsy.hear_after(1).size(), 20U);
  EXPECT_EQ(on.count(counter::refusals_unsaid), 30U);
  int events = 0;
  while (on.shared.try_event()) ++events;
  EXPECT_EQ(events, 8);
  on.cycles(4, 500ms);
  std::string last;
  while (const auto one = on.shared.try_event()) last = std::string_view{one->what};
  EXPECT_EQ(last, "42 more requests were refused");
}

TEST(core_shares, composes_no_answer_for_which_its_asker_has_no_place) {
  core_harness on;
  peer deaf{on};
  on.cycle();
  on.net.link_of(deaf.id()).capacity_bytes = 0;
  for (int i = 0; i < 40; ++i)
    deaf.say(R"({"op":"call_service","id":")" + std::to_string(i) + R"(","service":"/rowe/stats"})");
  on.cycles(20);
  EXPECT_LE(on.core.slots_in_use(), 16U);
  EXPECT_TRUE(on.core.check());
}

} // namespace
} // namespace core_shares_test
} // namespace harness
