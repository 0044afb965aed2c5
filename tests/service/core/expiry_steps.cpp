// SPDX-License-Identifier: Apache-2.0
// expiry_steps PENDING: for tests/instructions.cmake, which counts the instructions of the function
// expiry_steps() under callgrind. In a core without peers it sends messages, one in a cycle, with times to
// live between 0 and 10 s at random, while on average PENDING others wait for a peer: so much time passes in
// each step that in the long run as many expire as come.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "core_harness.hpp"

namespace {

using namespace std::chrono_literals;
using rowe::rt::duration;

constexpr std::uint32_t steps = 20'000; // CMakeLists.txt says so, too: tests/instructions.cmake divides by it

// xorshift64, by Marsaglia.
std::uint64_t random_number() {
  static std::uint64_t state = 0x9E3779B97F4A7C15;
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return state;
}

rowe::endpoint_options options(std::uint32_t pending) {
  auto chosen = harness::small_options();
  chosen.limits.small_slot_bytes = 64;
  chosen.limits.small_slots = 3 * pending + 64; // those that peers have claims to stay free
  return chosen;
}

void send(harness::core_harness& on, duration ttl) {
  const auto slot = on.submissions.submit({.what = rowe::detail::entry::message,
                                           .stamped = on.now,
                                           .expires = rowe::rt::deadline_after(on.now, ttl)},
                                          R"({"status":"ok","battery":0.73})");
  if (!slot) std::abort();
}

} // namespace

// The lives are chosen before, so that only the core's instructions are counted, and the submission queue's.
extern "C" [[gnu::noinline]] void expiry_steps(harness::core_harness& on, const std::vector<duration>& lives,
                                               duration each) {
  for (const duration ttl : lives) {
    send(on, ttl);
    on.cycle(each);
  }
}

int main(int count, char** arguments) {
  const auto pending = static_cast<std::uint32_t>(count == 2 ? std::strtoul(arguments[1], nullptr, 10) : 0);
  if (pending == 0) {
    std::fprintf(stderr, "expiry_steps PENDING\n");
    return 1;
  }
  harness::core_harness on{options(pending)};
  constexpr double life_ns_max = 1e10;
  const auto share = [] { return static_cast<double>(random_number() >> 11) * 0x1p-53; };
  const duration each = duration{5s} / pending; // half the longest life
  for (std::uint32_t i = 0; i < pending; ++i) {
    // What is left of the lives of those that are there at any moment: long ones are more often met.
    send(on, duration{static_cast<std::int64_t>(life_ns_max * (1 - std::sqrt(share())))});
    on.cycle(0ns);
  }
  std::vector<duration> lives(steps);
  for (duration& one : lives) one = duration{static_cast<std::int64_t>(life_ns_max * share())};
  expiry_steps(on, lives, each);
  const bool right = on.core.check() && on.count(rowe::service::counter::no_slot) == 0 &&
                     on.count(rowe::service::counter::expired) + on.core.slots_in_use() == pending + steps;
  if (!right) std::fprintf(stderr, "a message is lost\n");
  return right ? 0 : 1;
}
