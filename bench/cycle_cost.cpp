// SPDX-License-Identifier: Apache-2.0
#include "cycle_cost.hpp"

#include <ctime>

#include <array>
#include <atomic>
#include <cstddef>

// rowe::service::core::cycle(rt::time_point), whose argument and result are one integer for the machine.
#define ROWE_BENCH_CYCLE                                                                                     \
  "_ZN4rowe7service4core5cycleENSt6chrono10time_pointINS_2rt15monotonic_clockENS2_8durationIlSt5ratioILl1"   \
  "ELl1000000000EEEEEE"
std::int64_t real_cycle(void* core, std::int64_t now) asm("__real_" ROWE_BENCH_CYCLE);
std::int64_t measured_cycle(void* core, std::int64_t now) asm("__wrap_" ROWE_BENCH_CYCLE);

namespace rowe::bench {
namespace {

constexpr std::size_t kept_max = std::size_t{1} << 20;
std::array<std::int32_t, kept_max> taken;
std::atomic<std::size_t> count{0};

std::int64_t running_ns() {
  timespec now{};
  (void)::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now); // cannot fail
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void note(std::int64_t ns) {
  const std::size_t at = count.load(std::memory_order_acquire); // pairs with the release in begin_cycles()
  if (at == kept_max) return;
  taken[at] = static_cast<std::int32_t>(ns);
  count.store(at + 1, std::memory_order_release); // pairs with the acquire in cycles_taken()
}

} // namespace

// A cycle that ends just now may be kept, or lost.
void begin_cycles() { count.store(0, std::memory_order_release); } // pairs with the acquire in note()

std::vector<double> cycles_taken() {
  const std::size_t there = count.load(std::memory_order_acquire); // pairs with the release in note()
  return {taken.begin(), taken.begin() + static_cast<std::ptrdiff_t>(there)};
}

} // namespace rowe::bench

std::int64_t measured_cycle(void* core, std::int64_t now) {
  const std::int64_t before = rowe::bench::running_ns();
  const std::int64_t next = real_cycle(core, now);
  rowe::bench::note(rowe::bench::running_ns() - before);
  return next;
}
