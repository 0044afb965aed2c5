// SPDX-License-Identifier: Apache-2.0
// Question: what does publish(value, now) cost the real-time thread, next to the least that any way of
// handing over the same bytes costs?
//
// Measured, one publish a microsecond beside a consumer that polls without pause, each call timed alone, the
// clock's own cost (its median, taken in the same round) subtracted; p50 and p99.9 of each round, medians
// over the rounds:
//   bare      spsc_ring<odometry>::try_push: the same struct by value through a ring, and nothing else
//   all       publish_into() of a lane that keeps all: take a free slot, copy, stamp, push; the consumer
//   gives slots
//             home as the service thread does
//   newest    publish_into() of a lane that keeps the newest: the four-slot window
//   told      as all, under idle::wake while the service thread is awake: the handshake, and no system call
//   mutex     the same struct through a std::deque under a mutex with a condition variable, whose reader
//   sleeps
// and `line`: half of the time a word needs to the other core and back, which is one transfer of a cache
// line. `over_bare_in_lines` is (publish - bare) / line, inside each round: the target is at most 2.
//
// Excluded: encoding and sending, which are the service thread's; waking anybody, since publish wakes nobody.
//
// What would make it lie: other load on either core (p50 bears some, p99.9 does not); hyperthreads of one
// core; a clock that is a system call; a clock of 10 ns steps makes single samples coarse.
//
// Run: bench_publish [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/publisher.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/thread.hpp>

#include "api/lane_memory.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

constexpr int pushes = 5'000;
constexpr int trips = 2'000;
constexpr std::uint32_t depth = 1024;
constexpr rt::duration push_period = std::chrono::microseconds{1};

struct odometry {
  double values[13];
};

// One transfer of a line: half of a word's way there and back.
double line_cost() {
  alignas(rt::line_bytes) static std::atomic<std::uint64_t> word;
  word.store(0);
  const rt::thread partner = on_the_other_core([] {
    for (std::uint64_t trip = 0; trip < trips; ++trip) {
      while (word.load(std::memory_order_acquire) != 2 * trip + 1) continue; // pairs with the release below
      word.store(2 * trip + 2, std::memory_order_release);                   // pairs with the acquire below
    }
  });
  std::vector<double> each;
  for (std::uint64_t trip = 0; trip < trips; ++trip) {
    const auto begin = monotonic_clock::now();
    word.store(2 * trip + 1, std::memory_order_release);                   // pairs with the acquire above
    while (word.load(std::memory_order_acquire) != 2 * trip + 2) continue; // pairs with the release above
    each.push_back(nanoseconds_since(begin));
  }
  return std::max(median(each) - clock_cost(), 1.0) / 2;
}

// ---- the ways; take() is the other thread's

class bare {
 public:
  static constexpr const char* name = "bare";
  bool publish(const odometry& value, rt::time_point) { return in_.try_push(value); }
  void take() {
    out_.drain([](const odometry& value) { benchmark::DoNotOptimize(value); }, 64);
  }

 private:
  using ring = rt::spsc_ring<odometry>;
  std::vector<ring::entry> entries_ = std::vector<ring::entry>(depth);
  ring shared_{entries_};
  ring::producer& in_ = *shared_.take_producer();
  ring::consumer& out_ = *shared_.take_consumer();
};

template <keep Kept, bool Tells = false>
class lane_way {
 public:
  static constexpr const char* name = Tells ? "told" : Kept == keep::all ? "all" : "newest";
  lane_way()
      : memory_{detail::path_bytes(Kept, depth, sizeof(odometry)) + (1 << 12), rt::page_lock::attempted} {
    detail::build_path(memory_.carve_bytes(detail::path_bytes(Kept, depth, sizeof(odometry))), Kept, depth,
                       sizeof(odometry), lane_->user.out, lane_->service.out);
    lane_->heard_by.store(detail::audience::somebody, std::memory_order_seq_cst);
    if (Tells) lane_->bell = &bell_;
  }
  bool publish(const odometry& value, rt::time_point now) {
    return detail::publish_into(*lane_, sizeof value, now,
                                [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); })
        .has_value();
  }
  void take() {
    const detail::emptying_end& path = lane_->service.out;
    if constexpr (Kept == keep::newest) {
      const auto found = path.newest->begin_read();
      if (found.state == rt::freshness::fresh) benchmark::DoNotOptimize(*path.slots.value(found.slot));
    } else {
      path.out->drain(
          [&](std::uint32_t slot) {
            benchmark::DoNotOptimize(*path.slots.value(slot));
            path.home->give(slot);
          },
          64);
    }
  }

 private:
  std::unique_ptr<detail::lane> lane_ = std::make_unique<detail::lane>();
  rt::wake_bell<> bell_{rt::eventfd_bell{}}; // nobody sleeps
  rt::arena memory_;
};

class mutex_condvar {
 public:
  static constexpr const char* name = "mutex";
  bool publish(const odometry& value, rt::time_point) {
    {
      const std::lock_guard lock{mutex_};
      items_.push_back(value);
    }
    arrived_.notify_one();
    return true;
  }
  void take() {
    std::unique_lock lock{mutex_};
    arrived_.wait_for(lock, std::chrono::milliseconds{1}, [&] { return !items_.empty(); });
    items_.clear();
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<odometry> items_;
};

struct cost {
  double p50, p999;
};

template <class Way>
cost measure() {
  const auto way = std::make_unique<Way>();
  std::atomic<bool> done{false};
  const rt::thread partner = on_the_other_core([&] {
    while (!done.load(std::memory_order_acquire)) way->take(); // pairs with the release below
  });
  const double clock = clock_cost();
  std::vector<double> each;
  odometry value{};
  auto next = monotonic_clock::now();
  for (int i = 0; i < pushes; ++i) {
    next += push_period;
    while (monotonic_clock::now() < next) continue;
    value.values[i % 13] += 1;
    const auto begin = monotonic_clock::now();
    benchmark::DoNotOptimize(way->publish(value, begin));
    each.push_back(std::max(nanoseconds_since(begin) - clock, 0.0));
  }
  done.store(true, std::memory_order_release); // pairs with the acquire above
  return {quantile(each, 0.5), quantile(each, 0.999)};
}

struct series {
  std::string name;
  std::vector<double> p50, p999, over50, over999;
};

template <class Way>
void enter(series& into, cost least, double line) {
  const cost c = measure<Way>();
  into.name = Way::name;
  into.p50.push_back(c.p50);
  into.p999.push_back(c.p999);
  into.over50.push_back((c.p50 - least.p50) / line);
  into.over999.push_back((c.p999 - least.p999) / line);
}

void report(const series& each) {
  benchmark::RegisterBenchmark(("publish/" + each.name).c_str(),
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.p50) * 1e-9);
                                 state.counters["p999_ns"] = median(each.p999);
                                 state.counters["over_bare_in_lines"] = median(each.over50);
                                 state.counters["over_bare_in_lines_p999"] = median(each.over999);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::vector<series> all(5);
  return run_on_two_cores("bench_publish", count, arguments, [&](int rounds) {
    std::vector<double> lines;
    for (int round = 0; round < rounds; ++round) {
      const double line = line_cost();
      lines.push_back(line);
      const cost least = measure<bare>();
      enter<bare>(all[0], least, line);
      enter<lane_way<rowe::keep::all>>(all[1], least, line);
      enter<lane_way<rowe::keep::newest>>(all[2], least, line);
      enter<lane_way<rowe::keep::all, true>>(all[3], least, line);
      enter<mutex_condvar>(all[4], least, line);
    }
    benchmark::AddCustomContext("line transfer, ns", std::to_string(median(lines)));
    for (const series& each : all) report(each);
    return true;
  });
}
