// SPDX-License-Identifier: Apache-2.0
// What a measurement needs around it: a thread that is pinned and has its priority, someone who waits for it
// and for Ctrl-C, a peer, and a connection to that.
#pragma once
#include <atomic>
#include <cerrno>
#include <memory>
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/rt/thread.hpp>

#include "../rowe/console.hpp"
#include "../rowe/interrupt.hpp"
#include "child.hpp"
#include "pump.hpp"
#include "report.hpp"
#include "settings.hpp"
#include "witness.hpp"

namespace rowe::tools::bench {

inline constexpr rt::duration timeout_default = std::chrono::seconds{1};

// What the measuring thread leaves behind.
struct measured {
  pump_counts counts;
  thread_usage usage;
  rt::duration ran{};
  rt::grants grants;
  std::string problem;
};

// Runs `body(measured&, stop)` on a thread placed as `s.here` says, and waits for its end; on Ctrl-C sets
// `stop`. The process's memory is locked first, as far as that is permitted.
template <class Body>
measured on_measuring_thread(const settings& s, Body body) {
  measured m;
  std::atomic<bool> stop{false};
  std::atomic<bool> done{false};
  (void)rt::lock_process_memory(); // where it is refused, page faults show
  rt::thread thread{s.here.user_thread("bench"), [&] {
                      body(m, std::as_const(stop));
                      done.store(true, std::memory_order_release); // release: pairs with the acquire below
                    }};
  m.grants = thread.grants();
  if (thread.error() != 0) {
    m.problem = joined("the measuring thread cannot be started (errno ", thread.error(), ")");
    return m;
  }
  while (!done.load(std::memory_order_acquire)) { // acquire: pairs with the release above
    interrupt::sleep_until(rt::monotonic_clock::now() + interrupt::slice);
    // relaxed: nothing but the flag itself is handed over
    if (interrupt::seen()) stop.store(true, std::memory_order_relaxed);
  }
  thread.join();
  m.grants = thread.grants();
  return m;
}

// Measures the messages of `target`: the warm-up, which is thrown away, then the run; target.begin() between
// the two, where there is one.
template <measurable Target>
measured measure_messages(const settings& s, Target& target, recording& into) {
  const rt::duration period = period_of(s.rate_or_default());
  const std::uint64_t warm = count_in(s.warm_up_or_default(), period);
  const std::uint64_t count = count_in(s.run_time_or_default(), period);
  const rt::duration timeout = s.timeout.value_or(timeout_default);
  marks warm_ended(warm);
  marks ended(count);
  recording discarded;
  return on_measuring_thread(s, [&](measured& m, const std::atomic<bool>& stop) {
    rt::kernel_clock clock;
    (void)pump({clock.now() + period, period, warm}, 0, target, discarded, warm_ended, timeout, stop, clock);
    if constexpr (requires { target.begin(); }) target.begin();
    witness watch;
    const rt::time_point start = clock.now() + period;
    into.begin(start);
    m.counts = pump({start, period, count}, warm, target, into, ended, timeout, stop, clock);
    m.usage = watch.seen();
    m.ran = clock.now() - start;
  });
}

// The other end: a child, or what is at the URL; and our endpoint that is connected to it.
struct link {
  std::unique_ptr<child> started;
  std::string url;
  std::optional<endpoint> hub;
  bool same_clock = true;          // it runs on this boot of this machine
  std::string peer_machine;        // its line, where it is another one
  std::optional<exit_code> failed; // there is no link: how to end; why was printed
};

// `extra`: further arguments of the child. Without URL it is started; where there is one, it is asked who it
// is, and `needed` says that it must be a `rowe bench peer`.
link connect(const settings& s, const console& to, const std::vector<std::string>& extra, bool needed);

// What all modes that send messages say of themselves, and what became of what was asked for.
report report_of(const settings& s, std::string what, const link& over, const measured& m,
                 const recording& samples);
// What was refused, as a warning beside those of the machine.
void add_grants(report& to, const rt::grants& given);

// Prints the report and writes the files that were asked for.
exit_code deliver(const report& r, const settings& s, const console& to);

} // namespace rowe::tools::bench
