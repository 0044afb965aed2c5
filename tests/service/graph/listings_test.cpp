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
                                          .handles_max = 2}),
                   rowe::service::side::server, numbers::protocols()} {}

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
  // What the peer does not read.
  bool evict() {
    out.of(peer_index{0}).blocked = true;
    const bool done = out.evict_for(rowe::service::slot_class::small);
    out.of(peer_index{0}).blocked = false;
    return done;
  }
  // A pause that is long enough for all that may be told without one.
  void rest() { cycle.now += listings_period * rowe::service::listings_burst; }
  void forget(connection& c) {
    listed.forget({c.id.index});
    out.forget({c.id.index});
    c.state = connection::phase::free;
    peers.remove();
  }
};

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

} // namespace
} // namespace listings_test
