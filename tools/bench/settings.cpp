// SPDX-License-Identifier: Apache-2.0
#include "settings.hpp"

#include <sched.h>

#include <algorithm>

#include "../rowe/arguments/values.hpp"
#include "schedule.hpp"

namespace rowe::tools::bench {
namespace {

std::vector<int> allowed_cpus() {
  cpu_set_t allowed;
  std::vector<int> cpus;
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) cpus.push_back(cpu);
  return cpus;
}

// Where nothing is said, the two ends are as far apart as they can be, and each has two CPUs where there are
// four.
void place(settings& s) {
  const std::vector<int> cpus = allowed_cpus();
  if (cpus.size() < 2) return;
  const bool two_each = cpus.size() >= 4;
  if (s.cpu.empty()) {
    s.here.user = cpus.back();
    s.here.service = cpus[cpus.size() - (two_each ? 2 : 1)];
  }
  if (s.peer_cpu.empty()) {
    s.peer.user = cpus.front();
    s.peer.service = cpus[two_each ? 1 : 0];
  }
}

} // namespace

std::string placement::text() const {
  std::string text = user ? joined("cpu ", *user) : std::string{"any cpu"};
  if (own_cpus()) text += joined(" and ", *service);
  return text + (priority > 0 ? joined(", SCHED_FIFO ", priority) : ", ordinary scheduling");
}

rt::duration settings::listed_above() const noexcept {
  if (max) return *max;
  rt::duration largest{0};
  for (const numbered_time& p : percentiles) largest = std::max(largest, p.time);
  return largest > rt::duration{0} ? largest : rt::for_ever;
}

std::vector<int> settings::cpus() const {
  std::vector<int> all;
  for (const auto& one : {here.user, here.service, peer.user, peer.service})
    if (one && std::find(all.begin(), all.end(), *one) == all.end()) all.push_back(*one);
  return all;
}

endpoint_options settings::options_of(const placement& end) const {
  endpoint_options o;
  o.idle_policy = idle_policy();
  o.service_cpu = end.service.value_or(-1);
  o.service_priority = std::max(end.priority - 1, 0); // on a CPU that they share, the loop goes first
  o.page = false;
  o.limits.messages_per_second_max = 0; // what is measured is what can be done
  // All lanes of either end, with room to spare.
  constexpr std::size_t small_lanes = std::size_t{4} << 20;
  constexpr std::size_t large_paths = 8;
  const std::size_t needed =
      small_lanes + large_paths * in_flight_max * (static_cast<std::size_t>(size) + 1024);
  o.limits = limits;
  o.limits.handle_bytes = std::max(o.limits.handle_bytes, needed);
  return o;
}

std::vector<option> run_options(settings& s) {
  return {{"--duration", "-D", "TIME", "how long to measure (default 10s)", time_span{&s.run_time}},
          {"--cpu", "", "N[,M]", "the CPU of the measuring thread, and of its service thread", &s.cpu},
          {"--prio", "", "N", "their SCHED_FIFO priority, N and N-1; 0: ordinary (default)",
           integer{&s.priority, 0, 99}},
          {"--quiet", "-q", "", "print errors only on stderr", &s.quiet}};
}

std::vector<option> message_options(settings& s) {
  return {{"--rate", "-r", "HZ", "messages a second (default 1kHz)", rate{&s.rate, rate_max}},
          {"--size", "", "BYTES", "of a message (default 128)", integer{&s.size, size_min, size_max}},
          {"--idle", "", "poll|spin|wake|phase", "how the service threads wait (default poll)",
           choice{&s.idle, idle_names}},
          {"--peer-cpu", "", "N[,M]", "the CPUs of the peer that is started; without URL only", &s.peer_cpu},
          {"--warm-up", "", "TIME", "measured and thrown away before (default 200ms)", time_span{&s.warm_up}},
          {"--timeout", "", "TIME", "how long to wait for an answer (default 1s)", time_span{&s.timeout}}};
}

std::vector<option> bound_options(settings& s) {
  return {{"--max", "", "TIME", "a larger sample is a failure (exit code 5), and listed with its time",
           time_span{&s.max}},
          {"--p", "", "TIME", "a larger percentile is one: --p99 80us, --p99.99 200us",
           numbered_times{&s.percentiles, 100}}};
}

std::vector<option> output_options(settings& s) {
  return {{"--json", "", "FILE|-", "the result as one JSON object", &s.json},
          {"--compare", "", "FILE", "compare with an earlier result of --json", &s.compare}};
}

std::vector<option> plot_options(settings& s) {
  return {{"--hgrm", "", "FILE", "the percentiles as HdrHistogram's plotters read them", &s.hgrm},
          {"--svg", "", "FILE", "percentiles and histogram as a drawing", &s.svg}};
}

std::string placement_of(std::string_view text, std::string_view name, placement& into) {
  const auto comma = text.find(',');
  const auto user = integer_of(text.substr(0, comma));
  const auto service = comma == text.npos ? user : integer_of(text.substr(comma + 1));
  const std::vector<int> allowed = allowed_cpus();
  for (const auto& one : {user, service}) {
    if (!one) return joined(name, " needs one CPU or two, such as 2 or 2,3, not ", quoted(text));
    if (std::find(allowed.begin(), allowed.end(), *one) == allowed.end())
      return joined(name, ": there is no CPU ", *one, ", or this process may not use it");
  }
  into.user = static_cast<int>(*user);
  into.service = static_cast<int>(*service);
  return {};
}

std::string complete(settings& s) {
  s.here.priority = s.peer.priority = static_cast<int>(s.priority);
  place(s);
  if (!s.cpu.empty()) {
    if (std::string wrong = placement_of(s.cpu, "--cpu", s.here); !wrong.empty()) return wrong;
  }
  if (!s.peer_cpu.empty()) {
    if (!s.url.empty()) return "--peer-cpu is for the peer that is started where no URL is given";
    if (std::string wrong = placement_of(s.peer_cpu, "--peer-cpu", s.peer); !wrong.empty()) return wrong;
  }
  if (!s.url.empty()) s.peer = {};
  if (count_in(s.run_time_or_default(), period_of(s.rate_or_default())) > samples_max)
    return joined("that is more than ", samples_max, " samples: measure for less time, or less often");
  return {};
}

} // namespace rowe::tools::bench
