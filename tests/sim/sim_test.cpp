// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "rt/asked.hpp"
#include "world.hpp"

namespace sim_test {
namespace {

using rowe::service::counter;
using sim::habits;
using sim::world;

const std::uint64_t seeds = rowe::tests::asked_of("ROWE_SIM_SEEDS", 200);
constexpr int steps = 2000;

TEST(sim, keeps_order_ttl_and_protocol_whatever_the_network_and_the_peers_do_and_loses_no_slot) {
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    world w{seed, {}};
    for (int i = 0; i < steps; ++i) {
      w.step();
      ASSERT_EQ(w.broken(), "") << "seed " << seed;
    }
    w.everyone_leaves();
    ASSERT_EQ(w.broken(), "") << "seed " << seed;
    ASSERT_EQ(w.on().core.slots_in_use(), 0U) << "seed " << seed;
    ASSERT_EQ(w.on().shared.peers(), 0U) << "seed " << seed;
    ASSERT_TRUE(w.on().core.drained()) << "seed " << seed;
  }
}

// Every message ends in exactly one of: received, expired, dropped for a peer that does not read.
TEST(sim, accounts_for_every_message_to_every_peer) {
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    world w{seed,
            {.peers_leave = false, .peers_misbehave = false, .throttles = false, .handles_change = false}};
    w.add_viewers(3);
    for (int i = 0; i < steps; ++i) {
      w.step();
      ASSERT_EQ(w.broken(), "") << "seed " << seed;
    }
    w.drain();
    ASSERT_EQ(w.broken(), "") << "seed " << seed;
    const auto count = [&](counter c) { return w.on().count(c); };
    ASSERT_EQ(count(counter::lost_with_peer) + count(counter::no_slot) + count(counter::too_big), 0U);
    EXPECT_EQ(w.heard() + count(counter::expired) + count(counter::outbox_full), w.published() * w.viewers())
        << "seed " << seed;
    EXPECT_GT(w.heard(), 0U);
  }
}

TEST(sim, does_the_same_twice_from_one_seed) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    world first{seed, {}};
    world second{seed, {}};
    for (int i = 0; i < steps; ++i) {
      first.step();
      second.step();
    }
    EXPECT_EQ(first.trace(), second.trace()) << "seed " << seed;
    world other{seed + 1000, {}};
    for (int i = 0; i < steps; ++i) other.step();
    EXPECT_NE(first.trace(), other.trace()) << "seed " << seed;
  }
}

} // namespace
} // namespace sim_test
