// SPDX-License-Identifier: Apache-2.0
// rowe bench expiry: what it costs to find the message that expires next among many that wait, and to put
// another one in its place. Measured on the timer wheel that the service thread uses, with simulated time:
// the wheel is told that it is when the next entry is due, so nothing is waited for and every turn through
// empty slots is paid. One expiry is shorter than the clock's steps, so a sample is the mean of a burst.
#include <random>
#include <string>
#include <vector>

#include <rowe/rt/timer_wheel.hpp>

#include "modes.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

using namespace std::chrono_literals;

constexpr unsigned burst = 64;
constexpr std::int64_t pending_max = 10'000'000;

struct expiry_settings : settings {
  std::int64_t pending = 1000;
};

command expiry_table(expiry_settings& s) {
  command table{.verb = "bench expiry",
                .examples = {{{"rowe bench expiry --pending 100000", "among a hundred thousand"},
                              {"rowe bench expiry -D 1s --cpu 3", "a short look"}}},
                .description = "Keeps N messages waiting, with times to live from 1 ms to 10 s, and measures "
                               "how long it takes that\n"
                               "one expires and another takes its place. A sample is the mean of 64.\n",
                .operands = {},
                .options = run_options(s)};
  table.options.push_back(
      {"--pending", "", "N", "messages that wait (default 1000)", integer{&s.pending, 1, pending_max}});
  for (auto more : {bound_options(s), output_options(s), plot_options(s)})
    table.options.insert(table.options.end(), more.begin(), more.end());
  return table;
}

// A wheel that is always full, and its own time.
class full_wheel {
 public:
  explicit full_wheel(std::uint32_t pending)
      : nodes_(pending), times_to_live_(1U << 16), wheel_{nodes_, now_} {
    std::mt19937_64 random{1}; // the same in every run: what is compared is the machine
    std::uniform_int_distribution<std::int64_t> range{rt::duration{1ms}.count(), rt::duration{10s}.count()};
    for (rt::duration& one : times_to_live_) one = rt::duration{range(random)};
    for (std::uint32_t node = 0; node < pending; ++node) insert(node);
  }
  void expire_one() noexcept {
    for (;;) {
      const std::uint32_t node = wheel_.expire(now_);
      if (node != rt::timer_wheel::none) return insert(node);
      now_ = wheel_.next_wake();
    }
  }
  // Another message waits, and is sent before it expires.
  void move_one() noexcept { insert(static_cast<std::uint32_t>(moved_++ % nodes_.size())); }

 private:
  void insert(std::uint32_t node) noexcept {
    wheel_.insert(node, now_ + times_to_live_[inserted_++ % times_to_live_.size()]);
  }

  std::vector<rt::timer_node> nodes_;
  std::vector<rt::duration> times_to_live_;
  rt::time_point now_{1000s};
  rt::timer_wheel wheel_;
  std::uint64_t inserted_ = 0;
  std::uint64_t moved_ = 0;
};

template <class Step>
rt::duration mean_of_burst(rt::time_point begin, Step&& step) noexcept {
  for (unsigned i = 0; i < burst; ++i) step();
  return (rt::monotonic_clock::now() - begin) / burst;
}

} // namespace

exit_code expiry(argument_list arguments) {
  expiry_settings s;
  console to{"bench expiry"};
  if (const auto end = read_mode(expiry_table(s), arguments, s, to)) return *end;
  s.peer = {}; // there is none
  s.here.service.reset();
  full_wheel wheel{static_cast<std::uint32_t>(s.pending)};
  for (std::int64_t i = 0; i < s.pending; ++i) wheel.expire_one(); // into the steady state
  recording samples{s.listed_above()};
  distribution moved;
  to.note("measuring for ", seconds_text(s.run_time_or_default()), " (Ctrl-C ends it and prints)");
  const measured m = on_measuring_thread(s, [&](measured& of, const std::atomic<bool>& stop) {
    witness watch;
    const rt::time_point start = rt::monotonic_clock::now();
    const rt::time_point end = start + s.run_time_or_default();
    samples.begin(start);
    rt::time_point now = start;
    // relaxed: nothing but the flag itself is handed over
    while (now < end && !stop.load(std::memory_order_relaxed)) {
      samples.record(now, now + mean_of_burst(now, [&] { wheel.expire_one(); }));
      const rt::time_point between = rt::monotonic_clock::now();
      moved.record(mean_of_burst(between, [&] { wheel.move_one(); }));
      now = rt::monotonic_clock::now();
    }
    of.usage = watch.seen();
    of.ran = now - start;
  });
  report r;
  r.mode = s.mode;
  r.measured = "one message expires and another takes its place: mean of 64";
  r.where = this_machine(s.cpus());
  r.settings = {{"pending", std::to_string(s.pending)}, {"ttl", "1 ms to 10 s"}, {"thread", s.here.text()}};
  r.ran = m.ran;
  r.counts.intended = r.counts.finished = samples.times().count();
  r.samples = &samples;
  r.parts = {{"one is removed before its time, another added: mean of 64", "move", &moved}};
  r.usage = m.usage;
  r.problem = m.problem;
  if (samples.times().count() > 0) r.bounds = bounds_of(s, samples.times());
  add_grants(r, m.grants);
  return deliver(r, s, to);
}

} // namespace rowe::tools::bench
