// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "messaging_world.hpp"
#include "rt/asked.hpp"

namespace messaging_sim_test {
namespace {

using sim::messaging_world;

const std::uint64_t seeds = rowe::tests::asked_of("ROWE_SIM_SEEDS", 200);
constexpr int steps = 2000;

// A whole run: how it went is seen by broken().
void run(messaging_world& w, std::uint64_t seed) {
  for (int i = 0; i < steps; ++i) {
    w.step();
    ASSERT_EQ(w.broken(), "") << "seed " << seed;
  }
  w.finish();
  ASSERT_EQ(w.broken(), "") << "seed " << seed;
}

TEST(messaging_sim, tells_everyone_the_truth_once_whatever_happens) {
  std::uint64_t sent = 0;
  std::uint64_t answered = 0;
  for (std::uint64_t seed = 1; seed <= seeds && !HasFatalFailure(); ++seed) {
    messaging_world w{seed};
    run(w, seed);
    sent += w.book().messages_sent();
    answered += w.book().calls_answered();
  }
  EXPECT_GT(sent, 10 * seeds); // else the world is too quiet to show anything
  EXPECT_GT(answered, 2 * seeds);
}

TEST(messaging_sim, tells_the_truth_for_the_seeds_that_once_broke_it) {
  constexpr std::uint64_t that_broke_it[] = {
      4523, // a message overtook a pending one of the same sender
      4663, // a call was sent after its time, before its peer's close frame was answered
      3206, // a peer waited to begin a frame, another's ended, and nobody wrote to it any more
      605,  // a peer that left while senders were told `full` for it was counted twice
  };
  for (const std::uint64_t seed : that_broke_it) {
    messaging_world w{seed};
    run(w, seed);
  }
}

} // namespace
} // namespace messaging_sim_test
