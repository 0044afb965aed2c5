// SPDX-License-Identifier: Apache-2.0
// That a seq_cst load does not overtake the seq_cst store before it, to another word: what the window, the
// waker and the sleepers at the shared inbox are built on. Compilers and processors keep it. qemu 7.2
// does not when it runs arm64 on x86: it puts its barriers before an `stlr` and behind an `ldar`, and none
// between the two.
#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <vector>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace {

using rowe::rt::std_atomics;

struct alignas(rowe::rt::line_bytes) word {
  std_atomics::variable<std::uint32_t> round{0};
};

constexpr std::uint32_t rounds = 200'000;

// In each round says so in its own word, then notes what the other word says. Waits a little for the other to
// come as far, so that the two meet; never for long.
void take_part(word& own, word& other, std::vector<std::uint32_t>& seen) {
  for (std::uint32_t round = 1; round <= rounds; ++round) {
    for (int looks = 0; looks < 200; ++looks) {
      // relaxed: nothing is read by it
      if (other.round.load(std::memory_order_relaxed) + 1 >= round) break;
    }
    own.round.store(round, std::memory_order_seq_cst);
    seen[round - 1] = other.round.load(std::memory_order_seq_cst);
  }
}

TEST(seq_cst, loads_do_not_overtake_the_store_before_them) {
  word here, there;
  std::vector<std::uint32_t> seen_here(rounds), seen_there(rounds);
  std::thread second{[&] { take_part(there, here, seen_there); }};
  take_part(here, there, seen_here);
  second.join();

  std::uint32_t missed = 0; // rounds in which neither saw the other
  for (std::uint32_t round = 1; round <= rounds; ++round) {
    missed += seen_here[round - 1] < round && seen_there[round - 1] < round;
  }
  EXPECT_EQ(missed, 0U) << "of " << rounds << " rounds";
}

} // namespace
