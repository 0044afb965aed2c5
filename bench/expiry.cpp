// SPDX-License-Identifier: Apache-2.0
// Question: what does it cost to know which of many pending things expire next, and does that cost depend on
// how many are pending?
//
// Measured, for each way below and 1 k, 100 k and 1 M pending entries, on one pinned thread, in nanoseconds a
// step:
//
// - recent: an entry is inserted, and the one that was inserted 64 steps ago is cancelled, while all the
// others stay: what happens to a message that is sent soon after it was published, which is the rule.
//
// - random: an entry is inserted and one of all the others, chosen at random, is cancelled. The same
// instructions as above; what is added is the memory that nobody has touched for long.
//
// - random_ahead: the same, by a caller that knows 32 entries ahead which it will cancel, and tells the wheel
// (prefetch, prefetch_neighbours). The wheel alone has it.
//
// - passing: time moves on by what lies between two expiries, whatever is due is taken off, and as many
// entries are inserted: what happens when everything expires. In the others, time stands still.
//
// Times to live are uniform between 1 ms and 10 s: random order, which is what an index is for. (With one and
// the same time to live for all, a queue would do, and the paper's list is one.)
//
// The ways: rowe's wheel; std::multimap, its nodes kept and re-used, so that no allocator is measured; a
// binary heap in which cancelled entries stay until they surface or make up half of it; and the paper's
// doubly linked list in order of expiry, searched from its late end. The list makes fewer steps, since one of
// its insertions passes half of all entries, and no `passing` where that takes milliseconds.
//
// Every way runs in every round; ratios to the wheel are taken inside a round, medians over the rounds are
// printed.
//
// Excluded: drawing the random numbers, which lie ready in an array; filling the index in the beginning. The
// heap's sweeps come once in as many steps as entries are pending, so at 1 M they hardly fall into what is
// measured, and its figures there are too good.
//
// What would make it lie: entries in the order of their memory (so their numbers are shuffled); too few of
// them for the caches to show (so there are a million); an index from which nothing ever comes due (so there
// is `passing`).
//
// Run: bench_expiry [--rounds=11] [--here=CPU] [Google Benchmark's options]
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>
#include <rowe/rt/timer_wheel.hpp>

#include "rounds.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;
using rt::duration;
using rt::time_point;
using entry = std::uint32_t;

constexpr entry none = ~entry{0};
constexpr duration ttl_min = 1ms;
constexpr duration ttl_max = 10s;
constexpr std::size_t steps_max = 20'000; // of a round

// ---- the ways: entries are numbers below `entries`

class wheel {
 public:
  static constexpr const char* name = "rowe_wheel";
  wheel(entry entries, time_point now) : nodes_(entries), wheel_{nodes_, now} {}
  void insert(entry e, time_point expiry) { wheel_.insert(e, expiry); }
  void cancel(entry e) { wheel_.cancel(e); }
  entry expire(time_point now) { return wheel_.expire(now); }
  void look_ahead(entry far, entry near) {
    wheel_.prefetch(far);
    wheel_.prefetch_neighbours(near);
  }

 private:
  static_assert(rt::timer_wheel::none == none);
  std::vector<rt::timer_node> nodes_;
  rt::timer_wheel wheel_;
};

class multimap {
 public:
  static constexpr const char* name = "multimap";
  multimap(entry entries, time_point) : at_(entries) {}
  void insert(entry e, time_point expiry) {
    if (spare_.empty()) {
      at_[e] = map_.emplace(expiry, e);
      return;
    }
    auto node = std::move(spare_.back());
    spare_.pop_back();
    node.key() = expiry;
    node.mapped() = e;
    at_[e] = map_.insert(std::move(node));
  }
  void cancel(entry e) { spare_.push_back(map_.extract(at_[e])); }
  entry expire(time_point now) {
    if (map_.empty() || map_.begin()->first > now) return none;
    const entry due = map_.begin()->second;
    cancel(due);
    return due;
  }

 private:
  using map = std::multimap<time_point, entry>;
  map map_;
  std::vector<map::iterator> at_;
  std::vector<map::node_type> spare_;
};

class lazy_heap {
 public:
  static constexpr const char* name = "lazy_heap";
  lazy_heap(entry entries, time_point) : use_(entries) { heap_.reserve(2 * std::size_t{entries} + 2); }
  void insert(entry e, time_point expiry) {
    heap_.push_back({expiry, e, ++use_[e]});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }
  void cancel(entry e) {
    ++use_[e]; // whatever the heap still has of it is stale
    if (++stale_ * 2 > heap_.size()) sweep();
  }
  entry expire(time_point now) {
    while (!heap_.empty() && heap_.front().expiry <= now) {
      std::pop_heap(heap_.begin(), heap_.end(), later);
      const item due = heap_.back();
      heap_.pop_back();
      if (use_[due.which] == due.use) {
        ++use_[due.which];
        return due.which;
      }
      --stale_;
    }
    return none;
  }

 private:
  struct item {
    time_point expiry;
    entry which;
    std::uint32_t use;
  };
  static bool later(const item& a, const item& b) { return a.expiry > b.expiry; }
  void sweep() {
    std::erase_if(heap_, [&](const item& i) { return use_[i.which] != i.use; });
    std::make_heap(heap_.begin(), heap_.end(), later);
    stale_ = 0;
  }

  std::vector<item> heap_;
  std::vector<std::uint32_t> use_;
  std::size_t stale_ = 0;
};

class sorted_list {
 public:
  static constexpr const char* name = "sorted_list";
  sorted_list(entry entries, time_point) : nodes_(entries + 1), end_{entries} {
    nodes_[end_] = {end_, end_, {}};
  }
  void insert(entry e, time_point expiry) {
    entry before = nodes_[end_].previous;
    while (before != end_ && nodes_[before].expiry > expiry) before = nodes_[before].previous;
    const entry after = nodes_[before].next;
    nodes_[e] = {after, before, expiry};
    nodes_[before].next = nodes_[after].previous = e;
  }
  void cancel(entry e) {
    nodes_[nodes_[e].previous].next = nodes_[e].next;
    nodes_[nodes_[e].next].previous = nodes_[e].previous;
  }
  entry expire(time_point now) {
    const entry first = nodes_[end_].next;
    if (first == end_ || nodes_[first].expiry > now) return none;
    cancel(first);
    return first;
  }

 private:
  struct node {
    entry next, previous;
    time_point expiry;
  };
  std::vector<node> nodes_;
  entry end_;
};

// ---- the measures

double nanoseconds_since(rt::time_point begin) {
  return static_cast<double>((rt::monotonic_clock::now() - begin).count());
}

// An index with `pending` entries, of which `recent_entries` more are on it for a short time only.
template <class Way>
class measured {
 public:
  measured(entry pending, std::size_t steps)
      : way_{pending + recent_entries, now_}, pending_{pending}, victims_(steps), ttls_(steps) {
    // In order of expiry, since the list could not be filled in any other.
    std::vector<duration> ttl(pending + recent_entries);
    for (duration& each : ttl) each = random_ttl();
    std::sort(ttl.begin(), ttl.end());
    std::vector<entry> order(ttl.size());
    std::iota(order.begin(), order.end(), entry{0});
    std::shuffle(order.begin(), order.end(), random_);
    for (std::size_t i = 0; i < order.size(); ++i) way_.insert(order[i], now_ + ttl[i]);
  }

  double recent() {
    choose();
    entry next = 0;
    return timed([&](std::size_t step) {
      const entry oldest = pending_ + next++ % recent_entries;
      way_.cancel(oldest);
      way_.insert(oldest, now_ + ttls_[step]);
    });
  }

  double random() {
    choose();
    return timed([&](std::size_t step) {
      way_.cancel(victims_[step]);
      way_.insert(victims_[step], now_ + ttls_[step]);
    });
  }

  // 0 for a way that cannot look ahead.
  double random_ahead() {
    choose();
    if constexpr (requires { way_.look_ahead(entry{}, entry{}); }) {
      const std::size_t last = victims_.size() - 1;
      return timed([&](std::size_t step) {
        way_.look_ahead(victims_[std::min(step + ahead, last)], victims_[std::min(step + ahead / 2, last)]);
        way_.cancel(victims_[step]);
        way_.insert(victims_[step], now_ + ttls_[step]);
      });
    }
    return 0;
  }

  double passing() {
    choose();
    const duration gap = (ttl_min + ttl_max) / 2 / pending_;
    return timed([&](std::size_t step) {
      now_ += gap;
      for (entry due; (due = way_.expire(now_)) != none;) way_.insert(due, now_ + ttls_[step]);
    });
  }

 private:
  static constexpr entry recent_entries = 64;
  static constexpr std::size_t ahead = 32;

  template <class Step>
  double timed(Step step) {
    const auto begin = rt::monotonic_clock::now();
    for (std::size_t i = 0; i < ttls_.size(); ++i) step(i);
    return nanoseconds_since(begin) / static_cast<double>(ttls_.size());
  }
  duration random_ttl() {
    return duration{std::uniform_int_distribution<std::int64_t>{ttl_min.count(), ttl_max.count()}(random_)};
  }
  void choose() {
    std::uniform_int_distribution<entry> any{0, pending_ - 1};
    for (entry& victim : victims_) victim = any(random_);
    for (duration& ttl : ttls_) ttl = random_ttl();
  }

  std::mt19937_64 random_{1};
  time_point now_{1000s};
  Way way_;
  entry pending_;
  std::vector<entry> victims_;
  std::vector<duration> ttls_;
};

constexpr std::size_t measures = 4;
constexpr const char* measure_names[measures] = {"recent", "random", "passing", "random_ahead"};

struct series {
  std::string name;
  std::vector<double> ns, of_wheel;
};

// One way with one number of pending entries, over all rounds.
template <class Way>
class contender {
 public:
  contender(entry pending, std::size_t steps, bool lets_time_pass)
      : measured_{std::make_unique<measured<Way>>(pending, steps)}, lets_time_pass_{lets_time_pass} {
    for (std::size_t i = 0; i < measures; ++i) {
      all[i].name = std::string{measure_names[i]} + "/" + Way::name + "/" + std::to_string(pending);
    }
  }
  using costs = std::array<double, measures>;
  // Returns what it cost, for the others' ratios.
  costs run_round(const costs* wheel) {
    costs cost{measured_->recent(), measured_->random(), lets_time_pass_ ? measured_->passing() : 0,
               measured_->random_ahead()};
    for (std::size_t i = 0; i < measures; ++i) {
      if (cost[i] == 0) continue; // not measured
      all[i].ns.push_back(cost[i]);
      all[i].of_wheel.push_back(wheel == nullptr ? 1 : cost[i] / (*wheel)[i]);
    }
    return cost;
  }

  std::array<series, measures> all;

 private:
  std::unique_ptr<measured<Way>> measured_;
  bool lets_time_pass_;
};

struct contest {
  explicit contest(entry pending)
      : ours{pending, steps_max, true},
        map{pending, steps_max, true},
        heap{pending, steps_max, true},
        list{pending, std::clamp<std::size_t>(2'000'000 / pending, 2, steps_max), pending <= 1000} {}
  void run_round() {
    const auto cost = ours.run_round(nullptr);
    map.run_round(&cost);
    heap.run_round(&cost);
    list.run_round(&cost);
  }

  contender<wheel> ours;
  contender<multimap> map;
  contender<lazy_heap> heap;
  contender<sorted_list> list;
};

void report(const series& each) {
  if (each.ns.empty()) return;
  benchmark::RegisterBenchmark(each.name.c_str(),
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.ns) * 1e-9);
                                 state.counters["of_wheel"] = median(each.of_wheel);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  const int rounds = number_option(count, arguments, "rounds", 11);
  const int here = number_option(count, arguments, "here", 0);
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 1;
  (void)rowe::rt::prepare_this_thread({.name = "bench", .cpu = here}); // refused: the bench still runs

  std::vector<std::unique_ptr<contest>> contests;
  for (const entry pending : {1'000u, 100'000u, 1'000'000u})
    contests.push_back(std::make_unique<contest>(pending));
  for (int round = 0; round < rounds; ++round) {
    for (const auto& each : contests) each->run_round();
  }
  benchmark::AddCustomContext("rounds", std::to_string(rounds));
  benchmark::AddCustomContext("kernel", line_of("/proc/sys/kernel/osrelease"));
  for (const auto& each : contests) {
    for (std::size_t i = 0; i < measures; ++i) {
      for (const series* one :
           {&each->ours.all[i], &each->map.all[i], &each->heap.all[i], &each->list.all[i]}) {
        report(*one);
      }
    }
  }
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
