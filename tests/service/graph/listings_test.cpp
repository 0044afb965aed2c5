// SPDX-License-Identifier: Apache-2.0
#include "service/graph/listings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "service/graph/numbers_lists.hpp"
#include "service/incoming/peer_parts.hpp"
#include "wire/codec/own_names.hpp"

namespace listings_test {
namespace {

using namespace peer_parts;
using numbers::gone_of;
using numbers::list_of;
using rowe::service::listings_period;
using rowe::service::topic_id;

struct listings_test : peer_parts::peer_parts {
  listings_test()
      : peer_parts{::state_fixture::with({.connections_max = 3,
                                          .message_bytes_max = 4096,
                                          .topics_max = 96,
                                          .small_slots = 4 * rowe::service::replies_max,
                                          .small_slot_bytes = 1024,
                                          .large_slots = 2,
                                          .services_max = 8,
                                          .lanes_max = 2}),
                   rowe::service::side::server, numbers::protocols()} {}

  rowe::service::stop_rules rules{options.stop, cycle.now, 1};
  rowe::service::service_directory directory{memory, bounds};
  rowe::service::advertisement_table advertised{memory, bounds};
  const topic_id state_of_stop = hold_own(rowe::wire::stop_state_name); // as the core has it
  rowe::service::listings listed{memory,
                                 {.state_ = state,
                                  .service_directory_ = directory,
                                  .stop_rules_ = rules,
                                  .advertisement_table_ = advertised,
                                  .outbox_ = out,
                                  .endpoint_name_ = "robot"}};
  rowe::detail::latch_words<> loop;

  connection& greet(std::uint32_t index, std::uint32_t generation = 1) {
    connection& c = join({index, generation}, numbers::subprotocol);
    listed.greet(c);
    return c;
  }
  // One that has read its greeting and all lists.
  connection& greeted() {
    connection& c = greet(0);
    (void)heard(c);
    return c;
  }
  topic_id hold_own(std::string_view name) {
    const topic_id topic = topics.find_or_add(name);
    topics.hold_as_own(topic);
    return topic;
  }
  topic_id add_topic(std::string_view name) {
    const topic_id topic = topics.find_or_add(name);
    topics.hold(topic);
    return topic;
  }
  void remove_topic(std::string_view name) { topics.let_go(topics.find(name)); }
  std::uint32_t channel(std::string_view name) { return topics.at(topics.find(name)).channel; }
  void add_service(std::string_view name) { (void)directory.add(name, {}, {}, connection_id{9, 1}); }
  // What waited to be written to a peer; it reads all of it.
  std::vector<std::string> read(const connection& by) {
    const auto all = told(by);
    for (auto& from = out.of({by.id.index}).replies; !from.empty();) {
      const auto slot = out.entries().front(from).index;
      out.take_front(from, slot);
      store.delivered(slot);
    }
    return all;
  }
  // What a peer has been told since the last look, until there is no more.
  std::vector<std::string> heard(const connection& by) {
    std::vector<std::string> all;
    for (auto some = read(by); !some.empty(); some = read(by)) {
      all.insert(all.end(), some.begin(), some.end());
      listed.announce_changes();
    }
    return all;
  }
  bool evict() { return out.evict_for(rowe::service::slot_class::small); }
  // A pause that is long enough for all that may be told without one.
  void rest() { cycle.now += listings_period * rowe::service::listings_burst; }
  void forget(connection& c) {
    listed.forget({c.id.index});
    out.forget({c.id.index});
    c.state = connection::phase::free;
    peers.remove();
  }
};

TEST_F(listings_test, tell_nothing_twice) {
  add_topic("/odom");
  connection& peer = greeted();
  for (int i = 0; i < 10; ++i, rest()) listed.announce_changes();
  EXPECT_TRUE(heard(peer).empty());
  EXPECT_EQ(listed.due(), rowe::rt::never);
}

TEST_F(listings_test, tell_changes_at_once_and_then_at_their_pace) {
  connection& peer = greeted();
  rest();
  std::uint32_t told_at_once = 0;
  for (int i = 0; i < 20; ++i) {
    add_topic("/t" + std::to_string(i));
    listed.announce_changes();
    told_at_once += !heard(peer).empty();
  }
  EXPECT_EQ(told_at_once, rowe::service::listings_burst);
  EXPECT_EQ(listed.due(), cycle.now + listings_period);
  cycle.now = listed.due();
  listed.announce_changes();
  EXPECT_EQ(list_of(heard(peer), 'T').size(), 20 - rowe::service::listings_burst)
      << "all the others together";
  EXPECT_EQ(listed.due(), rowe::rt::never);
}

TEST_F(listings_test, say_nothing_of_what_came_and_went_in_between) {
  connection& peer = greeted();
  rest();
  for (std::uint32_t i = 0; i < rowe::service::listings_burst; ++i) {
    add_topic("/t" + std::to_string(i));
    listed.announce_changes();
  }
  (void)heard(peer);
  add_topic("/short");
  listed.announce_changes();
  remove_topic("/short");
  listed.announce_changes();
  cycle.now += listings_period;
  listed.announce_changes();
  EXPECT_TRUE(heard(peer).empty());
}

TEST_F(listings_test, wait_for_a_peer_that_does_not_read_and_for_no_other) {
  connection& slow = greet(0);
  connection& quick = greet(1);
  (void)heard(quick);
  for (int i = 0; i < 8; ++i) {
    add_topic("/t" + std::to_string(i));
    listed.announce_changes();
    EXPECT_EQ(list_of(heard(quick), 'T').size(), 1U) << i;
    rest();
  }
  EXPECT_EQ(told(slow).size(), 1U);
  EXPECT_LE(listed.due(), cycle.now);
  EXPECT_EQ(list_of(heard(slow), 'T').size(), 8U) << "what is different then";
  EXPECT_EQ(listed.due(), rowe::rt::never);
}

TEST_F(listings_test, look_again_after_a_pause_that_is_longer_for_who_does_not_read) {
  connection& slow = greet(0);
  listed.announce_changes();
  EXPECT_EQ(listed.due(), cycle.now) << "it is written in this cycle";
  ASSERT_EQ(out.take_scheduled(), peer_index{slow.id.index});
  listed.announce_changes();
  EXPECT_EQ(listed.due(), cycle.now + rowe::service::listings_retry);
  out.of({slow.id.index}).blocked = true;
  listed.announce_changes();
  EXPECT_EQ(listed.due(), cycle.now + rowe::service::listings_retry_backpressured);
  (void)read(slow);
  listed.announce_changes();
  EXPECT_TRUE(read(slow).empty()) << "nothing is queued for it";
}

TEST_F(listings_test, tell_again_what_was_evicted_as_it_is_then) {
  add_topic("/odom");
  connection& peer = greet(0);
  ASSERT_TRUE(evict());
  listed.announce_changes();
  EXPECT_EQ(read(peer), std::vector<std::string>{"hrobot"});
  listed.announce_changes();
  ASSERT_EQ(list_of(told(peer), 'T').count("/odom"), 1U);
  ASSERT_TRUE(evict());
  add_topic("/pose");
  listed.announce_changes();
  EXPECT_EQ(list_of(heard(peer), 'T'),
            (numbers::numbered{{"/odom", channel("/odom")}, {"/pose", channel("/pose")}}));
  const auto was = channel("/odom");
  remove_topic("/odom");
  rest();
  listed.announce_changes();
  ASSERT_EQ(gone_of(told(peer), 't'), std::vector{was});
  ASSERT_TRUE(evict());
  add_topic("/odom");
  rest();
  listed.announce_changes();
  const auto changed = heard(peer);
  EXPECT_EQ(gone_of(changed, 't'), std::vector{was});
  EXPECT_EQ(list_of(changed, 'T'), (numbers::numbered{{"/odom", channel("/odom")}}));
  EXPECT_TRUE(peer.open());
  EXPECT_EQ(listed.due(), rowe::rt::never);
}

// What came after a round began is for the next one. So it ends, however often something comes and goes.
TEST_F(listings_test, end_a_round_while_topics_come_and_go) {
  connection& peer = greeted();
  rest();
  std::size_t messages = 0;
  for (int i = 0; i < 1000; ++i) {
    if (i % 2 == 0) add_topic("/t");
    if (i % 2 != 0) remove_topic("/t");
    listed.announce_changes();
    messages += read(peer).size();
  }
  EXPECT_LE(messages, 2 * rowe::service::listings_burst);
}

TEST_F(listings_test, go_on_where_they_ended_however_much_there_is) {
  for (int i = 0; i < 90; ++i)
    add_topic("/a/topic/with/a/long/name/" + std::string(60, 'x') + std::to_string(i));
  connection& peer = greet(0);
  numbers::numbered all;
  std::size_t parts = 0;
  for (auto some = heard(peer); !some.empty(); listed.announce_changes(), some = heard(peer)) {
    all.merge(list_of(some, 'T'));
    for (const std::string& one : some) EXPECT_LE(one.size(), bounds.message_bytes_max);
    parts += some.size();
  }
  EXPECT_EQ(all.size(), 90U);
  EXPECT_GT(parts, 10U);
}

TEST_F(listings_test, tell_the_next_peer_at_the_same_place_everything) {
  add_topic("/odom");
  connection& gone = greeted();
  for (std::uint32_t i = 0; i <= rowe::service::listings_burst; ++i) {
    add_topic("/t" + std::to_string(i));
    listed.announce_changes();
  }
  ASSERT_NE(listed.due(), rowe::rt::never);
  forget(gone);
  EXPECT_EQ(listed.due(), rowe::rt::never) << "nobody reads";
  EXPECT_EQ(list_of(heard(greet(0, 2)), 'T').size(), 2 + rowe::service::listings_burst);
}

TEST_F(listings_test, greet_a_peer_later_that_has_no_place_for_its_greeting) {
  connection& peer = join({0, 1}, numbers::subprotocol);
  while (out.has_place_for_reply({0}))
    ASSERT_TRUE(out.reply({0}, [](rowe::json::writer& into) { into.append("{}"); }));
  listed.greet(peer);
  EXPECT_TRUE(peer.open());
  EXPECT_FALSE(was_told(peer, "hrobot"));
  const auto all = heard(peer);
  EXPECT_EQ(std::count(all.begin(), all.end(), "hrobot"), 1);
}

TEST_F(listings_test, name_the_stop_where_there_is_one) {
  connection& peer = greet(0);
  const auto before = list_of(heard(peer), 'S');
  (void)rules.add_loop("loop", 1s, loop, cycle.now);
  listed.announce_changes();
  const auto changed = heard(peer);
  EXPECT_TRUE(list_of(changed, 'T').contains(std::string{rowe::wire::stop_state_name}));
  const auto added = list_of(changed, 'S');
  EXPECT_EQ(added.size(), 4U);
  EXPECT_EQ(added.at(std::string{rowe::wire::stop_name}), 1U) << "its number never changes";
  for (const auto& [name, number] : before) EXPECT_FALSE(added.contains(name)) << name;
}

// ---- numbers in place of names

struct names_of_numbers : listings_test {
  connection& peer = greet(0);
  // The name that a number stands for; empty: it is refused.
  std::string_view service(std::uint32_t number) {
    rowe::wire::request asked;
    asked.service_number = number;
    return listed.put_names(peer, asked).why.empty() ? asked.service : std::string_view{};
  }
  std::string_view topic(std::uint32_t number) {
    rowe::wire::request asked;
    asked.channel = number;
    return listed.put_names(peer, asked).why.empty() ? asked.topic : std::string_view{};
  }
};

TEST_F(names_of_numbers, are_those_that_were_listed) {
  add_topic("/odom");
  add_service("/add");
  for (const auto& [name, number] : list_of(heard(greet(1)), 'S')) EXPECT_EQ(service(number), name);
  EXPECT_EQ(topic(channel("/odom")), "/odom");
  EXPECT_EQ(service(0), "");
  EXPECT_EQ(service(63), "");
  EXPECT_EQ(topic(channel("/odom") + 1000), "");
}

TEST_F(names_of_numbers, are_unknown_when_the_thing_is_gone) {
  add_topic("/odom");
  add_service("/add");
  const auto of_topic = channel("/odom");
  const auto of_service = directory.at(directory.find("/add")).number;
  remove_topic("/odom");
  directory.remove(directory.find("/add"));
  add_topic("/other");
  add_service("/other");
  EXPECT_EQ(topic(of_topic), "");
  EXPECT_EQ(service(of_service), "");
}

TEST_F(names_of_numbers, are_not_the_stops_where_there_is_none) {
  EXPECT_EQ(service(1), "");
  (void)rules.add_loop("loop", 1s, loop, cycle.now);
  EXPECT_EQ(service(1), rowe::wire::stop_name);
}

TEST_F(names_of_numbers, that_a_peer_gave_are_its_own) {
  connection& other = greet(1);
  const topic_id odom = add_topic("/odom"), map = add_topic("/map");
  subscriptions.at(subscriptions.add(odom, {0})).tag = 7;
  subscriptions.at(subscriptions.add(map, {1})).tag = 7;
  rowe::wire::request asked;
  asked.tag = 7;
  EXPECT_EQ(listed.put_names(peer, asked).why, "");
  EXPECT_EQ(asked.topic, "/odom");
  EXPECT_EQ(listed.put_names(other, asked).why, "");
  EXPECT_EQ(asked.topic, "/map");
  asked.tag = 8;
  EXPECT_NE(listed.put_names(peer, asked).why, "");
}

TEST_F(names_of_numbers, are_given_to_one_topic_each) {
  const topic_id odom = add_topic("/odom");
  add_topic("/map");
  subscriptions.at(subscriptions.add(odom, {0})).tag = 7;
  rowe::wire::request asked;
  asked.what = rowe::wire::verb::subscribe;
  asked.tag = 7;
  asked.channel = channel("/odom");
  EXPECT_EQ(listed.put_names(peer, asked).why, "") << "once more";
  asked.channel = channel("/map");
  EXPECT_NE(listed.put_names(peer, asked).why, "");
  asked.what = rowe::wire::verb::unsubscribe;
  EXPECT_EQ(listed.put_names(peer, asked).why, "") << "what is not given needs to be nobody's";
  asked.what = rowe::wire::verb::subscribe;
  asked.tag = 8;
  EXPECT_EQ(listed.put_names(peer, asked).why, "");
}

} // namespace
} // namespace listings_test
