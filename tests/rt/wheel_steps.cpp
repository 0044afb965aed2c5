// SPDX-License-Identifier: Apache-2.0
// wheel_steps PENDING: for tests/instructions.cmake, which counts the instructions of the function
// wheel_steps() under callgrind. It cancels and inserts entries chosen at random, on a wheel on which PENDING
// entries are, with times to live between 1 ms and 10 s.
#include <rowe/rt/timer_wheel.hpp>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

using namespace std::chrono_literals;
using rowe::rt::time_point;

constexpr std::size_t steps = 100'000; // CMakeLists.txt says so, too: tests/instructions.cmake divides by it
constexpr time_point start{1000s};

struct step {
  std::uint32_t node;
  time_point expiry;
};

// xorshift64, by Marsaglia.
std::uint64_t random_number() {
  static std::uint64_t state = 0x9E3779B97F4A7C15;
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return state;
}

time_point random_expiry() {
  return start + 1ms + rowe::rt::duration{static_cast<std::int64_t>(random_number() % 9'999'000'000)};
}

} // namespace

extern "C" [[gnu::noinline]] void wheel_steps(rowe::rt::timer_wheel& wheel, const std::vector<step>& script) {
  for (const step& s : script) {
    wheel.cancel(s.node);
    wheel.insert(s.node, s.expiry);
  }
}

int main(int count, char** arguments) {
  const std::uint64_t pending = count == 2 ? std::strtoull(arguments[1], nullptr, 10) : 0;
  if (pending == 0) {
    std::fprintf(stderr, "wheel_steps PENDING\n");
    return 1;
  }
  std::vector<rowe::rt::timer_node> nodes(pending);
  rowe::rt::timer_wheel wheel{nodes, start};
  for (std::uint32_t node = 0; node < pending; ++node) wheel.insert(node, random_expiry());
  std::vector<step> script(steps);
  for (step& s : script) s = {static_cast<std::uint32_t>(random_number() % pending), random_expiry()};
  wheel_steps(wheel, script);
  return wheel.size() == pending ? 0 : 1;
}
