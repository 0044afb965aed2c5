// SPDX-License-Identifier: Apache-2.0
// rowe bench loop: a loop of rt::periodic that does nothing else, and how late each of its cycles began. A
// cycle that was skipped because the loop was late counts as late, too: by the time since its own deadline.
#include <optional>

#include "modes.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

command loop_table(settings& s) {
  command table{
      .verb = "bench loop",
      .examples = {{{"rowe bench loop -D 10m --cpu 3 --prio 80 --max 100us",
                     "fit for 1 kHz? exit code 5 if not"},
                    {"rowe bench loop --rate 250Hz --svg loop.svg", "a drawing of the distribution"}}},
      .description = "Waits for each deadline of a periodic loop and measures how much later it woke up: the "
                     "floor under\n"
                     "all that a control loop does on this machine. cyclictest measures the same.\n",
      .operands = {},
      .options = run_options(s)};
  table.options.push_back({"--rate", "-r", "HZ", "cycles a second (default 1kHz)", rate{&s.rate, rate_max}});
  table.options.push_back(
      {"--warm-up", "", "TIME", "measured and thrown away before (default 200ms)", time_span{&s.warm_up}});
  for (auto more : {bound_options(s), output_options(s), plot_options(s)})
    table.options.insert(table.options.end(), more.begin(), more.end());
  return table;
}

// Runs `cycles` cycles, those that are skipped counted with the others. `begin` is called at the first.
template <class Begin>
pump_counts cycle(rt::duration period, std::uint64_t cycles, recording& into, const std::atomic<bool>& stop,
                  Begin&& begin) {
  rt::periodic loop{period};
  pump_counts counts;
  rt::time_point deadline = loop.wait().value_or(rt::time_point{}) + period;
  begin(deadline);
  // relaxed: nothing but the flag itself is handed over
  while (counts.intended < cycles && !stop.load(std::memory_order_relaxed)) {
    const auto now = loop.wait();
    if (!now) break;
    for (; deadline <= *now && counts.intended < cycles; deadline += period, ++counts.intended)
      into.record(deadline, *now);
  }
  counts.finished = counts.intended;
  return counts;
}

} // namespace

exit_code loop(argument_list arguments) {
  settings s;
  console to{"bench loop"};
  if (const auto end = read_mode(loop_table(s), arguments, s, to)) return *end;
  s.peer = {}; // there is none
  s.here.service.reset();
  const rt::duration period = period_of(s.rate_or_default());
  recording samples{s.listed_above()};
  recording discarded;
  to.note("measuring for ", seconds_text(s.run_time_or_default()), " (Ctrl-C ends it and prints)");
  const measured m = on_measuring_thread(s, [&](measured& of, const std::atomic<bool>& stop) {
    (void)cycle(period, count_in(s.warm_up_or_default(), period), discarded, stop, [](rt::time_point) {});
    std::optional<witness> watch;
    const rt::time_point start = rt::monotonic_clock::now();
    of.counts =
        cycle(period, count_in(s.run_time_or_default(), period), samples, stop, [&](rt::time_point first) {
          samples.begin(first);
          watch.emplace();
        });
    of.usage = watch->seen();
    of.ran = rt::monotonic_clock::now() - start;
  });
  report r;
  r.mode = s.mode;
  r.measured = "from a cycle's deadline to its begin";
  r.where = this_machine(s.cpus());
  r.settings = {{"period", time_text(period)}, {"thread", s.here.text()}};
  r.ran = m.ran;
  r.counts = m.counts;
  r.samples = &samples;
  r.usage = m.usage;
  r.problem = m.problem;
  if (samples.times().count() > 0) r.bounds = bounds_of(s, samples.times());
  add_grants(r, m.grants);
  return deliver(r, s, to);
}

} // namespace rowe::tools::bench
