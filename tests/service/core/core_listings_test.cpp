// SPDX-License-Identifier: Apache-2.0
// Lists of topics and services for many peers at once, of which some read slowly, beside one that takes back
// at once what it advertises and provides.
#include "core_fixtures.hpp"

#include <algorithm>
#include <deque>
#include <string>

#include "service/graph/numbers_lists.hpp"

namespace core_listings_test {
namespace {

using namespace harness;
using numbers::numbered;
using rowe::service::counter;
using rowe::service::listings_per_cycle;
using rowe::service::listings_period;
using rowe::service::side;

constexpr std::uint32_t readers = 300;

rowe::endpoint_options for_many() {
  rowe::endpoint_options options = small_options();
  options.relay = true;
  options.stop.unguarded = true;
  options.limits.connections_max = readers + 2;
  options.limits.small_slots = readers / 2;
  options.limits.queued_max = 16 * readers;
  options.limits.messages_per_second_max = 0;
  options.silence_max = 1min;
  return options;
}

// One that is told lists. Each message must fit to those before it.
struct reader : peer {
  explicit reader(core_harness& in) : peer{in, side::server, "10.0.0.9:1", "/", numbers::subprotocol} {}

  // Returns how many messages with lists came.
  std::size_t listen() {
    std::size_t count = 0;
    for (const std::string& one : hear()) {
      EXPECT_EQ(greeted, !one.starts_with('h')) << one;
      greeted = true;
      take(one, 'T', topics);
      take(one, 'S', services);
      count += one.find_first_of("TtSs") == 0;
    }
    return count;
  }
  bool greeted = false;
  numbered topics;
  numbered services;

 private:
  static void take(const std::string& one, char kind, numbered& into) {
    for (const auto& [name, number] : numbers::list_of({one}, kind))
      EXPECT_TRUE(into.emplace(name, number).second) << name << " is listed twice";
    for (const std::uint32_t number : numbers::gone_of({one}, static_cast<char>(kind - 'A' + 'a')))
      EXPECT_EQ(std::erase_if(into, [&](const auto& known) { return known.second == number; }), 1U) << number;
  }
};

struct core_listings : core_test {
  core_listings() : core_test{for_many(), side::server, &numbers::protocols()} { on.cycle(); }

  void come(std::uint32_t count = readers) {
    for (std::uint32_t i = 0; i < count; ++i) all.emplace_back(on);
  }
  // Advertises and provides, or takes that back.
  void flap(peer& by) {
    const bool come = turn_++ % 2 == 0;
    for (const char* const name : {"/a", "/b"})
      by.say((come ? R"({"op":"advertise","type":"a/A","topic":")" : R"({"op":"unadvertise","topic":")") +
             std::string{name} + "\"}");
    by.say(come ? R"({"op":"advertise_service","service":"/s"})"
                : R"({"op":"unadvertise_service","service":"/s"})");
  }
  std::size_t listen() {
    std::size_t count = 0;
    for (reader& one : all) count += one.listen();
    return count;
  }
  std::size_t cut() const {
    return static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [](const reader& one) { return one.cut(); }));
  }
  void know_the_same() {
    for (int i = 0; i < 400; ++i) {
      on.cycle();
      listen();
    }
    EXPECT_EQ(on.next_wake > on.now, true) << "nothing is left to do";
    for (const reader& one : all) {
      ASSERT_TRUE(one.greeted);
      ASSERT_EQ(one.topics, all.front().topics);
      ASSERT_EQ(one.services, all.front().services);
    }
    EXPECT_TRUE(all.front().topics.contains("/rowe/stats"));
    EXPECT_EQ(cut(), 0U);
  }

  std::deque<reader> all;

 private:
  int turn_ = 0;
};

TEST_F(core_listings, are_told_to_all_who_come_at_once) {
  come();
  on.cycle();
  std::size_t most = 0;
  for (int i = 0; i < 400; ++i) {
    on.cycle();
    most = std::max(most, listen());
  }
  EXPECT_LE(most, listings_per_cycle);
  EXPECT_EQ(on.count(counter::evicted), 0U);
  know_the_same();
}

// Each reads once a second.
TEST_F(core_listings, cut_nobody_who_reads_slowly_while_a_peer_flaps) {
  peer busy{on};
  come();
  std::size_t told = 0;
  constexpr std::uint32_t cycles = 6000;
  for (std::uint32_t ms = 0; ms < cycles; ++ms) {
    if (ms % 3 == 0) flap(busy);
    (void)busy.hear_after(1);
    for (std::uint32_t i = ms * 7 % 1000; i < readers; i += 1000) told += all[i].listen();
  }
  EXPECT_EQ(cut(), 0U);
  EXPECT_FALSE(busy.cut());
  const std::size_t rounds = 2 + rowe::service::listings_burst + cycles / (listings_period / 1ms);
  EXPECT_LE(told, readers * 4 * rounds) << "at most one message of each kind in a period";
  know_the_same();
}

TEST_F(core_listings, that_nobody_reads_take_one_place_for_each_peer) {
  peer busy{on};
  come();
  for (reader& one : all) on.net.link_of(one.id()).capacity_bytes = 0;
  for (int i = 0; i < 3000; ++i) {
    flap(busy);
    (void)busy.hear_after(1);
  }
  EXPECT_LE(on.count(counter::queued_max), readers + 8);
  EXPECT_EQ(cut(), 0U);
  for (reader& one : all) on.net.link_of(one.id()).capacity_bytes = 1U << 20U;
  know_the_same();
}

TEST_F(core_listings, do_not_keep_a_stop_waiting) {
  on.offer(rowe::detail::latch_request({.name = "loop"}));
  peer busy{on};
  on.cycle();
  come();
  std::size_t most = 0;
  for (std::uint32_t i = 0; i < 600; ++i) {
    flap(busy);
    if (i % 10 == 0)
      busy.say(R"({"op":"call_service","id":"stop)" + std::to_string(i) + R"(","service":"/rowe/stop"})");
    (void)busy.hear_after(1);
    EXPECT_EQ(on.count(counter::stops), i / 10 + 1U) << "in the cycle in which it came";
    most = std::max(most, listen());
  }
  EXPECT_GT(most, 0U);
  EXPECT_LE(most, listings_per_cycle);
}

} // namespace
} // namespace core_listings_test
