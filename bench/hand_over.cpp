// SPDX-License-Identifier: Apache-2.0
// Question: how much slower than the bare transfer of a cache line is handing an item to a thread on another
// core?
//
// Measured, for each way in queues.hpp, with both threads pinned:
//
// - rtt: the time from pushing an item to having its echo back, through one queue there and one back; the
// median of several bursts, divided by their trips. Once with the receivers polling as fast as they can and
// once with the processor's pause in between, since the better one depends on how far the cores are from each
// other; the better one counts.
//
// - push: how long one push takes beside a consumer that polls without pause, one push a microsecond; each
// push timed alone, the clock's own cost (its median, taken in the same round) subtracted; p50, p99, p99.9.
//
// - burst: what an item costs when 512 are pushed while the other thread looks elsewhere, and then popped
// while the first one looks elsewhere: the pattern of a service thread that comes by from time to time. Of
// rowe_window, which is no queue, the one read that takes the newest stands for the whole burst. How many
// items a second stream through without such turns is not given: two threads that chase each other fall into
// one of several rhythms by chance, tenfold apart.
//
// The limit, `raw`, is a plain word each way, each on a line of its own, polled in both manners: what two
// channels in opposite directions cost at least, because for each hop the sender must take the line from a
// receiver that polls it, and the receiver must fetch it again. `raw_one_line` is the other usual yardstick,
// one word thrown there and back: cheaper, since who has just received the line writes it next, and so out of
// reach of two independent channels. Ratios to both are given: `of_raw` and `of_one_line`. Every way runs in
// every round; ratios are taken inside a round, and medians over the rounds are printed.
//
// Excluded: the payload (items are 8 bytes, as slot numbers are), waking a sleeper (but in
// mutex_condvar_deque, which sleeps by nature), and what either thread does with an item.
//
// What would make it lie: two hyperthreads of one core (the line never travels); other load on either core
// (the medians bear some, push_p999 does not); a clock that is a system call (push is then all clock);
// variables of both threads on one line (so each thread works on pointers of its own); comparing nanoseconds
// of two runs, since the distance between two virtual cores changes from minute to minute.
//
// Run: bench_hand_over [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "queues.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

constexpr int bursts = 11;
constexpr int trips = 1'000;
constexpr int trips_asleep = 30; // of the way that sleeps, which takes a thousand times as long
constexpr int pushes = 3'000;
constexpr std::uint64_t bursts_by_turns = 41;
constexpr std::size_t places = 1024;
constexpr std::uint64_t burst_items = places / 2;
constexpr rt::duration push_period = std::chrono::microseconds{1};

template <template <class, std::size_t> class Way>
using of_items = Way<std::uint64_t, places>;
using sleeping = of_items<mutex_condvar>;

// What a receiver does between two looks.
struct at_once {
  void operator()() const {}
};
struct with_pause {
  void operator()() const {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }
};

// A word each way, on one line or on two. Values count up, so that each word is stored once a trip and never
// twice the same: on one line ours are odd and the echo's even.
template <std::size_t Lines, class Wait>
double raw_rtt() {
  struct alignas(rt::line_bytes) line {
    std::atomic<std::uint64_t> word{0};
  };
  const auto shared = std::make_unique<line[]>(Lines);
  auto& out = shared[0].word;
  auto& back = shared[Lines - 1].word;
  constexpr std::uint64_t step = Lines == 1 ? 2 : 1;
  const auto wait_for = [](const std::atomic<std::uint64_t>& word, std::uint64_t value) {
    while (word.load(std::memory_order_acquire) != value) Wait{}(); // pairs with the release stores below
  };
  const rt::thread partner = on_the_other_core([&] {
    for (std::uint64_t trip = 0; trip < std::uint64_t{bursts} * trips; ++trip) {
      wait_for(out, trip * step + 1);
      back.store((trip + 1) * step, std::memory_order_release); // pairs with the acquire in wait_for
    }
  });
  std::vector<double> each;
  std::uint64_t trip = 0;
  for (int burst = 0; burst < bursts; ++burst) {
    const auto begin = monotonic_clock::now();
    for (int i = 0; i < trips; ++i, ++trip) {
      out.store(trip * step + 1, std::memory_order_release); // pairs with the acquire in wait_for
      wait_for(back, (trip + 1) * step);
    }
    each.push_back(nanoseconds_since(begin) / trips);
  }
  return median(each);
}

template <class Queue, class Wait>
double queue_rtt() {
  const int count = std::is_same_v<Queue, sleeping> ? trips_asleep : trips;
  const auto there_queue = std::make_unique<Queue>();
  const auto back_queue = std::make_unique<Queue>();
  Queue* const out = there_queue.get();
  Queue* const back = back_queue.get();
  const rt::thread partner = on_the_other_core([out, back, all = bursts * count] {
    for (int trip = 0; trip < all; ++trip) {
      std::uint64_t item = 0;
      while (!out->pop(item)) Wait{}();
      while (!back->push(item)) Wait{}();
    }
  });
  std::vector<double> each;
  std::uint64_t sent = 0;
  for (int burst = 0; burst < bursts; ++burst) {
    const auto begin = monotonic_clock::now();
    for (int i = 0; i < count; ++i) {
      ++sent;
      while (!out->push(sent)) Wait{}();
      std::uint64_t item = 0;
      while (!back->pop(item)) Wait{}();
      if (item != sent) std::abort(); // then this measures something else
    }
    each.push_back(nanoseconds_since(begin) / count);
  }
  return median(each);
}

struct push_cost {
  double p50 = 0, p99 = 0, p999 = 0;
};

template <class Queue>
push_cost push() {
  const auto owned = std::make_unique<Queue>();
  Queue* const queue = owned.get();
  const rt::thread partner = on_the_other_core([queue] {
    for (std::uint64_t item = 0; item < pushes;) (void)queue->pop(item); // `item` stays when nothing is there
  });
  const double clock = clock_cost();
  std::vector<double> each;
  auto next = monotonic_clock::now();
  for (std::uint64_t item = 1; item <= pushes;) {
    next += push_period;
    while (monotonic_clock::now() < next) {
    }
    const auto begin = monotonic_clock::now();
    const bool pushed = queue->push(item);
    each.push_back(std::max(nanoseconds_since(begin) - clock, 0.0));
    if (pushed) ++item; // else the consumer was away for a whole ring; the refusal was timed as well
  }
  return {quantile(each, 0.5), quantile(each, 0.99), quantile(each, 0.999)};
}

struct burst_cost {
  double push = 0, pop = 0; // an item
};

// The two threads take turns: one pushes a burst while the other looks elsewhere, then that one takes it.
template <class Queue>
burst_cost burst() {
  const auto owned = std::make_unique<Queue>();
  const auto turns = std::make_unique<std::atomic<std::uint64_t>>(0); // even: ours; odd: the other thread's
  const auto popping = std::make_unique<std::vector<double>>();
  Queue* const queue = owned.get();
  auto* const turn = turns.get();
  auto* const pops = popping.get();
  // acquire and release: whoever gets the turn sees what the other did
  const auto wait_for = [turn](std::uint64_t value) {
    while (turn->load(std::memory_order_acquire) != value) with_pause{}();
  };
  {
    const rt::thread partner = on_the_other_core([queue, turn, pops, wait_for] {
      for (std::uint64_t round = 0; round < bursts_by_turns; ++round) {
        wait_for(2 * round + 1);
        const auto begin = monotonic_clock::now();
        const std::uint64_t last = (round + 1) * burst_items;
        for (std::uint64_t item = 0; item != last;) (void)queue->pop(item);
        pops->push_back(nanoseconds_since(begin) / burst_items);
        turn->store(2 * round + 2, std::memory_order_release);
      }
    });
    std::vector<double> each;
    std::uint64_t item = 0;
    for (std::uint64_t round = 0; round < bursts_by_turns; ++round) {
      wait_for(2 * round);
      const auto begin = monotonic_clock::now();
      for (std::uint64_t i = 0; i < burst_items; ++i)
        while (!queue->push(item + 1 + i)) {
        }
      each.push_back(nanoseconds_since(begin) / burst_items);
      item += burst_items;
      turn->store(2 * round + 1, std::memory_order_release);
    }
    wait_for(2 * bursts_by_turns);
    return {median(each), median(*pops)};
  }
}

// What the rounds said about one way.
struct series {
  std::string name;
  std::vector<double> rtt, of_raw, of_one_line, p50, p99, p999, burst_push, burst_pop;
};

struct limits {
  double raw, one_line;
};

void enter_rtt(series& into, const char* name, double rtt, limits limit) {
  into.name = name;
  into.rtt.push_back(rtt);
  into.of_raw.push_back(rtt / limit.raw);
  into.of_one_line.push_back(rtt / limit.one_line);
}

template <class Queue>
void run_round(series& into, limits limit) {
  enter_rtt(into, Queue::name, std::min(queue_rtt<Queue, at_once>(), queue_rtt<Queue, with_pause>()), limit);
  const push_cost cost = push<Queue>();
  into.p50.push_back(cost.p50);
  into.p99.push_back(cost.p99);
  into.p999.push_back(cost.p999);
  const burst_cost by_turns = burst<Queue>();
  into.burst_push.push_back(by_turns.push);
  into.burst_pop.push_back(by_turns.pop);
}

template <class... Queues>
std::vector<series> run_rounds(int rounds) {
  std::vector<series> all(2 + sizeof...(Queues));
  for (int round = 0; round < rounds; ++round) {
    const limits limit{.raw = std::min(raw_rtt<2, at_once>(), raw_rtt<2, with_pause>()),
                       .one_line = std::min(raw_rtt<1, at_once>(), raw_rtt<1, with_pause>())};
    enter_rtt(all[0], "raw", limit.raw, limit);
    enter_rtt(all[1], "raw_one_line", limit.one_line, limit);
    std::size_t i = 1;
    (run_round<Queues>(all[++i], limit), ...);
  }
  return all;
}

// The time of the one iteration that Google Benchmark counts is the median round trip.
void report(const series& each) {
  benchmark::RegisterBenchmark(("hand_over/" + each.name).c_str(),
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.rtt) * 1e-9);
                                 state.counters["of_raw"] = median(each.of_raw);
                                 state.counters["of_one_line"] = median(each.of_one_line);
                                 if (each.p50.empty()) return;
                                 state.counters["push_p50_ns"] = median(each.p50);
                                 state.counters["push_p99_ns"] = median(each.p99);
                                 state.counters["push_p999_ns"] = median(each.p999);
                                 state.counters["burst_push_ns"] = median(each.burst_push);
                                 state.counters["burst_pop_ns"] = median(each.burst_pop);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::vector<series> all;
  return run_on_two_cores("bench_hand_over", count, arguments, [&](int rounds) {
    all = run_rounds<of_items<rowe_ring>, of_items<rowe_ring_drained>, of_items<rowe_window>,
                     of_items<boost_spsc>, of_items<moodycamel_readerwriter>, of_items<moodycamel_concurrent>,
                     sleeping>(rounds);
    for (const series& each : all) report(each);
    return true;
  });
}
