// SPDX-License-Identifier: Apache-2.0
// How much is written in one cycle, and whose turn it is.
#include "core_fixtures.hpp"

#include <rowe/stop_latch.hpp>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace core_sender_test {
namespace {

using namespace harness;

constexpr std::size_t crowd = 100;
constexpr std::size_t turns_per_cycle = 32;

rowe::endpoint_options for_a_crowd() {
  rowe::endpoint_options options = small_options();
  options.limits.connections_max = crowd + 1;
  options.limits.subscriptions_max = crowd;
  options.limits.queued_max = 16 * crowd;
  options.stop.unguarded = true;
  return options;
}

struct core_sender : core_test {
  core_sender() : core_test{for_a_crowd()} {
    peers.reserve(crowd);
    for (std::size_t i = 0; i < crowd; ++i) peers.emplace_back(on);
  }

  void all_say(std::string_view text) {
    for (peer& p : peers) p.say(text);
    do on.cycle();
    while (on.next_wake <= on.now);
    for (peer& p : peers) (void)p.hear();
  }
  // How many peers have heard something since they were asked last.
  std::size_t heard() {
    return static_cast<std::size_t>(
        std::count_if(peers.begin(), peers.end(), [](peer& p) { return !p.hear().empty(); }));
  }

  std::vector<peer> peers;
};

TEST_F(core_sender, goes_to_so_many_peers_in_one_cycle_and_to_the_others_in_the_next) {
  auto& pair = advertise_pose(on);
  all_say(R"({"op":"subscribe","topic":"/pose"})");
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  for (std::size_t left = crowd; left != 0;) {
    on.cycle();
    const std::size_t turns = std::min(left, turns_per_cycle);
    EXPECT_EQ(heard(), turns);
    left -= turns;
    EXPECT_EQ(on.next_wake <= on.now, left != 0); // what waits for its turn is for at once
  }
  on.cycle();
  EXPECT_EQ(heard(), 0U);
}

TEST_F(core_sender, gives_everybody_a_turn_however_much_there_is_for_others) {
  auto& pair = advertise_pose(on);
  all_say(R"({"op":"subscribe","topic":"/pose"})");
  std::vector<std::size_t> waits(crowd); // cycles
  for (int cycles = 0; cycles < 50; ++cycles) {
    ASSERT_TRUE(publish_now(on, pair, {1, 0}));
    for (std::size_t i = 0; i < crowd; ++i) waits[i] = peers[i].hear().empty() ? waits[i] + 1 : 0;
    EXPECT_LE(*std::max_element(waits.begin(), waits.end()), crowd / turns_per_cycle + 1);
  }
}

// They read, and so nothing of a burst may be pushed out of their queues by the next one.
TEST_F(core_sender, takes_no_more_from_lanes_than_everybody_has_been_offered) {
  constexpr int burst = 6;
  auto& pair = advertise_pose(on, {.depth = burst});
  all_say(R"({"op":"subscribe","topic":"/pose","queue_length":8})");
  std::size_t published = 0;
  std::vector<std::size_t> heard_of(crowd);
  for (int cycles = 0; cycles < 100; ++cycles) {
    for (int i = 0; cycles < 50 && i < burst; ++i) {
      if (publish(on, pair, {1, 0})) ++published; // else the queue pair is full, and the loop is told so
    }
    on.cycle();
    for (std::size_t i = 0; i < crowd; ++i) heard_of[i] += peers[i].hear().size();
  }
  EXPECT_GT(published, 10U * burst);
  EXPECT_EQ(on.count(counter::outbox_full), 0U);
  for (const std::size_t each : heard_of) EXPECT_EQ(each, published);
}

// Frames of many peers are gathered before the first is written: sockets that take a part, or nothing, and
// peers with several messages stand between those with one.
TEST_F(core_sender, gives_each_its_frames_whole_and_in_order_whatever_sockets_take) {
  auto& pair = on.offer(rowe::detail::pair_kind::publish_text, "/count", 64, {.depth = 4});
  all_say(R"({"op":"subscribe","topic":"/count","queue_length":8})");
  std::mt19937 random{7};
  std::vector<int> last(crowd, -1);
  std::vector<int> count(crowd);
  for (int n = 0; n < 300; ++n) {
    for (peer& p : peers)
      on.net.link_of(p.id()).capacity_bytes = random() % 3 == 0 ? random() % 100 : std::size_t{1} << 20;
    ASSERT_TRUE(publish_text(on, pair, R"({"n":)" + std::to_string(n) + "}"));
    on.cycles(4);
    EXPECT_TRUE(on.core.check());
    for (std::size_t i = 0; i < crowd; ++i) {
      for (const std::string& text : peers[i].hear()) {
        const int seen = std::stoi(text.substr(text.find(R"("n":)") + 4));
        EXPECT_EQ(text, R"({"op":"publish","topic":"/count","msg":{"n":)" + std::to_string(seen) + "}}");
        EXPECT_GT(seen, last[i]);
        last[i] = seen;
        ++count[i];
      }
    }
  }
  for (const int each : count) EXPECT_GT(each, 200);
}

TEST_F(core_sender, large_messages_leave_turns_to_fewer_peers) {
  auto& pair = on.offer(rowe::detail::pair_kind::publish_text, "/map", 8000, {.depth = 4});
  all_say(R"({"op":"subscribe","topic":"/map"})");
  for (int i = 0; i < 4; ++i)
    ASSERT_TRUE(publish_text(on, pair, R"({"data":")" + std::string(7000, 'x') + "\"}"));
  on.cycle();
  EXPECT_LT(heard(), turns_per_cycle);
}

TEST_F(core_sender, what_has_no_time_to_live_goes_to_all_in_its_cycle) {
  all_say("{}"); // they use the plain format
  const auto sent = on.submissions.submit({.what = rowe::detail::entry::message,
                                           .wants_outcome = false,
                                           .peer = {},
                                           .call = {},
                                           .stamped = on.now,
                                           .expires = on.now},
                                          R"({"data":1})");
  ASSERT_TRUE(sent);
  on.cycle();
  EXPECT_EQ(heard(), crowd);
  EXPECT_EQ(on.count(counter::expired), 0U);
}

TEST_F(core_sender, a_stop_does_not_wait_until_all_have_had_their_turn) {
  rowe::stop_latch latch{core_harness::handle_of(on.offer(rowe::detail::latch_request({})))};
  auto& pair = advertise_pose(on);
  peer operator_{on};
  all_say(R"({"op":"subscribe","topic":"/pose"})");
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  operator_.tell(R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
  ASSERT_TRUE(latch.engaged(on.now));
  latch.acknowledge(on.now);
  EXPECT_EQ(operator_.hear_after(1).size(), 1U);
  EXPECT_EQ(heard(), 2 * turns_per_cycle);
}

// ---- nobody is forgotten who has something to write

// The front of a queue may be written while what stands behind it is over already.
TEST(sender, tells_a_peer_what_comes_behind_messages_that_were_over_while_it_did_not_read) {
  core_harness on{small_options()};
  auto& lasting = advertise_pose(on);
  auto& brief = advertise_pose(on, {.ttl = 20ms});
  peer slow = subscriber(on, "/pose");
  on.net.link_of(slow.id()).capacity_bytes = 10; // the first frame begins, no more
  for (int i = 1; i <= 2; ++i) ASSERT_TRUE(publish_now(on, lasting, {1.0 * i, 0}));
  ASSERT_TRUE(publish_now(on, brief, {3, 0}));
  on.now += 30ms;
  on.net.link_of(slow.id()).capacity_bytes = 4096;
  EXPECT_EQ(slow.hear_after(3), (texts{message(1), message(2)}));
  ASSERT_TRUE(publish(on, lasting, {4, 0}));
  EXPECT_EQ(slow.hear_after(1), texts{message(4)});
  EXPECT_EQ(on.core.inconsistency(), "");
}

// Of small slots only one may be begun. Two peers have begun the same message; the one that is done with it
// first has another one behind it, which waits until the other is done, too.
TEST(sender, begins_what_waited_for_a_frame_that_ended) {
  core_harness on{with_limits(small_options(), &limits::small_slots, 4)};
  auto& pair = advertise_pose(on);
  peer first{on}, second{on};
  for (peer* p : {&first, &second}) {
    p->tell(R"({"op":"subscribe","topic":"/pose"})");
    on.net.link_of(p->id()).capacity_bytes = 10;
  }
  for (int i = 1; i <= 2; ++i) ASSERT_TRUE(publish_now(on, pair, {1.0 * i, 0}));
  for (peer* p : {&first, &second}) {
    on.net.link_of(p->id()).capacity_bytes = 4096;
    on.cycles(3);
    EXPECT_EQ(on.core.inconsistency(), "");
  }
  for (peer* p : {&first, &second}) EXPECT_EQ(p->hear(), (texts{message(1), message(2)}));
}

} // namespace
} // namespace core_sender_test
