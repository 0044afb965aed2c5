// SPDX-License-Identifier: Apache-2.0
// Question: what does publish(value, now) cost the real-time thread, next to the least that any way of
// handing over the same bytes costs?
//
// Measured, with both threads pinned: each call timed alone, the clock's own cost (its median, taken in the
// same round) subtracted; p50, p99 and p99.9 of each round, medians over the rounds. The value is a struct of
// 13 doubles. The other thread copies it out, as an encoder reads it.
//
// The ways that wake nobody take turns, call by call, one call a microsecond, beside a consumer that looks
// after all of them without pause. So whatever disturbs the machine disturbs all of them alike, and their
// tails can be compared.
//   bare         spsc_ring::try_push of the struct, by value, and nothing else
//   rowe_all     publish_into() of a queue pair that keeps all: take a free slot, stamp, copy, push; the
//                consumer releases slots as the service thread does
//   rowe_newest  publish_into() of a queue pair that keeps the newest: the four-slot window
//   rowe_told    as rowe_all, under idle::wake while the service thread is awake: the handshake, and no
//                system call
//   moodycamel_ReaderWriterQueue, moodycamel_ConcurrentQueue    the struct by value, with tokens
//
// The ways whose consumer sleeps, each by itself, one call in 100 us, so that it falls asleep again as it
// does under a loop of 1 kHz:
//   mutex_condvar_deque    the struct by value
//   json_c_mutex_condvar   the paper's design: an object of json-c is built on the real-time thread and
//                          queued under a mutex; the other thread prints and frees it
//
// `line` is half of the time a word needs to the other core and back: one transfer of a cache line.
// `over_bare_in_lines` is (this - bare) / line inside each round, at p50 and at p99.9; `of_rowe_all` the
// ratio of the medians.
//
// Excluded: encoding and sending, which are the service thread's (but for json-c, which cannot do without);
// waking anybody, since publish wakes nobody; the first laps of each queue, in which pages are touched for
// the first time by this core.
//
// What would make it lie: hyperthreads of one core; a clock that is a system call; a clock of coarse steps
// (10 ns on some machines), which shows in single samples; a consumer that does not read the values, so that
// their lines stay where they were written.
//
// Run: bench_publish [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <json-c/json.h>

#include <rowe/publisher.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/thread.hpp>

#include "api/pair_memory.hpp"
#include "queues.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

constexpr int warm_up = 1'000;
constexpr int calls = 40'000;        // of each way that takes turns: 40 of them lie above p99.9
constexpr int calls_asleep = 1'000;  // of each way whose consumer sleeps
constexpr std::uint32_t depth = 256; // so that all of them together fit into a core's second cache
constexpr rt::duration period = std::chrono::microseconds{1};
constexpr rt::duration period_asleep = std::chrono::microseconds{100};

struct odometry {
  double position[3], orientation[4], linear[3], angular[3];
};

// ---- the ways; take() is the other thread's

template <template <class, std::size_t> class Queue>
class by_value {
 public:
  static constexpr const char* name = Queue<odometry, depth>::name;
  bool publish(const odometry& value, rt::time_point) { return queue_.push(value); }
  void take() {
    odometry value;
    if (queue_.pop(value)) benchmark::DoNotOptimize(value);
  }

 private:
  Queue<odometry, depth> queue_;
};

struct bare : by_value<rowe_ring_drained> {
  static constexpr const char* name = "bare";
};

template <keep Kept, bool Tells = false>
class pair_way {
 public:
  static constexpr const char* name = Tells ? "rowe_told" : Kept == keep::all ? "rowe_all" : "rowe_newest";
  pair_way() : memory_{bytes + (1 << 12), rt::page_lock::attempted} {
    detail::build_queue(memory_.carve_bytes(bytes), Kept, depth, sizeof(odometry), pair_->user.out,
                        pair_->service.out);
    pair_->audience.set(detail::audience::somebody);
    if (Tells) pair_->waker = &waker_;
  }
  bool publish(const odometry& value, rt::time_point now) {
    return detail::publish_into(*pair_, sizeof value, now,
                                [&](std::byte* slot) { std::memcpy(slot, &value, sizeof value); })
        .has_value();
  }
  void take() {
    const detail::consumer_end& end = pair_->service.out;
    if constexpr (Kept == keep::newest) {
      const auto found = end.newest->begin_read();
      if (found.state == rt::freshness::fresh) read(found.slot);
    } else {
      end.ring->drain(
          [&](std::uint32_t slot) {
            read(slot);
            end.free_ring->release(slot);
          },
          64);
    }
  }

 private:
  void read(std::uint32_t slot) {
    detail::value_header header = *pair_->service.out.memory.header(slot);
    odometry value;
    std::memcpy(&value, pair_->service.out.memory.value(slot), sizeof value);
    benchmark::DoNotOptimize(header);
    benchmark::DoNotOptimize(value);
  }

  static inline const std::size_t bytes = detail::queue_bytes(Kept, depth, sizeof(odometry));
  std::unique_ptr<detail::queue_pair> pair_ = std::make_unique<detail::queue_pair>();
  rt::waker<> waker_{rt::eventfd_signal{}}; // nobody sleeps
  rt::arena memory_;
};

class json_c_mutex_condvar {
 public:
  static constexpr const char* name = "json_c_mutex_condvar";
  bool publish(const odometry& value, rt::time_point) {
    constexpr std::array xyzw{"x", "y", "z", "w"};
    const auto object_of = [&](const auto& numbers) {
      json_object* const made = json_object_new_object();
      for (std::size_t i = 0; i < std::size(numbers); ++i)
        json_object_object_add(made, xyzw[i], json_object_new_double(numbers[i]));
      return made;
    };
    json_object* const pose = json_object_new_object();
    json_object_object_add(pose, "position", object_of(value.position));
    json_object_object_add(pose, "orientation", object_of(value.orientation));
    json_object* const twist = json_object_new_object();
    json_object_object_add(twist, "linear", object_of(value.linear));
    json_object_object_add(twist, "angular", object_of(value.angular));
    json_object* const all = json_object_new_object();
    json_object_object_add(all, "pose", pose);
    json_object_object_add(all, "twist", twist);
    if (queue_.push(all)) return true;
    json_object_put(all);
    return false;
  }
  void take() {
    json_object* object = nullptr;
    queue_.pop(object);
    benchmark::DoNotOptimize(json_object_to_json_string_ext(object, JSON_C_TO_STRING_PLAIN));
    json_object_put(object);
  }

 private:
  mutex_condvar<json_object*, depth> queue_;
};

// ---- the measures

struct cost {
  double p50, p99, p999;
};

cost cost_of(std::vector<double>& samples) {
  return {quantile(samples, 0.5), quantile(samples, 0.99), quantile(samples, 0.999)};
}

// Publishes at `next`, again until there is room, and returns what the call that succeeded took.
template <class Way>
double timed(Way& way, odometry& value, rt::time_point next) {
  value.position[0] += 1;
  while (monotonic_clock::now() < next) continue;
  for (;;) {
    const auto begin = monotonic_clock::now();
    const bool done = way.publish(value, begin);
    const double took = nanoseconds_since(begin);
    if (done) return took;
  }
}

template <class... Ways>
std::array<cost, sizeof...(Ways)> measure_in_turn() {
  constexpr std::size_t count = sizeof...(Ways);
  const std::tuple<std::unique_ptr<Ways>...> ways{std::make_unique<Ways>()...};
  std::atomic<bool> done{false};
  const rt::thread partner = on_the_other_core([&] {
    while (!done.load(std::memory_order_acquire)) // pairs with the release below
      std::apply([](auto&... way) { (way->take(), ...); }, ways);
  });
  std::array<std::vector<double>, count> samples;
  for (auto& each : samples) each.reserve(calls);
  const double clock = clock_cost();
  odometry value{};
  auto next = monotonic_clock::now();
  for (int i = -warm_up; i < calls; ++i) {
    const auto one = [&]<std::size_t Which>() {
      const double took = timed(*std::get<Which>(ways), value, next += period);
      if (i >= 0) samples[Which].push_back(std::max(took - clock, 0.0));
    };
    const auto forth = [&]<std::size_t... Which>(std::index_sequence<Which...>) {
      (one.template operator()<Which>(), ...);
    };
    const auto back = [&]<std::size_t... Which>(std::index_sequence<Which...>) {
      (one.template operator()<count - 1 - Which>(), ...);
    };
    // Both ways round, so that none always comes behind the same other.
    i % 2 == 0 ? forth(std::make_index_sequence<count>{}) : back(std::make_index_sequence<count>{});
  }
  done.store(true, std::memory_order_release); // pairs with the acquire above
  std::array<cost, count> costs;
  std::transform(samples.begin(), samples.end(), costs.begin(), cost_of);
  return costs;
}

template <class Way>
cost measure_asleep() {
  const auto way = std::make_unique<Way>();
  const rt::thread partner = on_the_other_core([&] {
    for (int i = 0; i < calls_asleep; ++i) way->take();
  });
  const double clock = clock_cost();
  std::vector<double> samples;
  odometry value{};
  auto next = monotonic_clock::now();
  for (int i = 0; i < calls_asleep; ++i)
    samples.push_back(std::max(timed(*way, value, next += period_asleep) - clock, 0.0));
  return cost_of(samples);
}

struct series {
  std::vector<double> p50, p99, p999, over50, over999, of_rowe;

  void enter(cost c, cost least, cost ours, double line) {
    p50.push_back(c.p50);
    p99.push_back(c.p99);
    p999.push_back(c.p999);
    over50.push_back((c.p50 - least.p50) / line);
    over999.push_back((c.p999 - least.p999) / line);
    of_rowe.push_back(c.p50 / std::max(ours.p50, 1.0));
  }
};

void report(const char* name, const series& each) {
  benchmark::RegisterBenchmark((std::string{"publish/"} + name).c_str(),
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.p50) * 1e-9);
                                 state.counters["p50_ns"] = median(each.p50);
                                 state.counters["p99_ns"] = median(each.p99);
                                 state.counters["p999_ns"] = median(each.p999);
                                 state.counters["over_bare_in_lines"] = median(each.over50);
                                 state.counters["over_bare_in_lines_p999"] = median(each.over999);
                                 state.counters["of_rowe_all"] = median(each.of_rowe);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

// In the order of both measures; the first two are what the others are compared with.
template <class... InTurn>
struct contest {
  template <class... Asleep>
  struct with {
    static constexpr std::size_t count = sizeof...(InTurn) + sizeof...(Asleep);
    static constexpr std::array<const char*, count> names{InTurn::name..., Asleep::name...};

    static void run_round(std::array<series, count>& into, double line) {
      const auto in_turn = measure_in_turn<InTurn...>();
      std::array<cost, count> all{};
      std::copy(in_turn.begin(), in_turn.end(), all.begin());
      std::size_t next = in_turn.size();
      ((all[next++] = measure_asleep<Asleep>()), ...);
      for (std::size_t i = 0; i < count; ++i) into[i].enter(all[i], all[0], all[1], line);
    }
  };
};

using ways = contest<bare, pair_way<keep::all>, pair_way<keep::newest>, pair_way<keep::all, true>,
                     by_value<moodycamel_readerwriter>,
                     by_value<moodycamel_concurrent>>::with<by_value<mutex_condvar>, json_c_mutex_condvar>;

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::array<series, ways::count> all;
  return run_on_two_cores("bench_publish", count, arguments, [&](int rounds) {
    std::vector<double> lines;
    for (int round = 0; round < rounds; ++round) {
      lines.push_back(line_cost());
      ways::run_round(all, lines.back());
    }
    benchmark::AddCustomContext("line transfer, ns", std::to_string(median(lines)));
    for (std::size_t i = 0; i < all.size(); ++i) report(ways::names[i], all[i]);
    return true;
  });
}
