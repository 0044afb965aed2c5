// SPDX-License-Identifier: Apache-2.0
// rowe bench idle: what the service thread of an endpoint costs while nothing happens: CPU time, and how
// often it gives its CPU up to sleep, which is how often it wakes. For each idle policy, without a peer, with
// one that is merely connected, and with one that listens to a topic on which nothing is published (then the
// thread has to look whether something was).
#include <dirent.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <optional>
#include <set>
#include <string>

#include <rowe/endpoint.hpp>

#include "../rowe/interrupt.hpp"
#include "../rowe/network/remote.hpp"
#include "modes.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration settle_time = 200ms; // what belongs to connecting is over then
constexpr std::string_view quiet_topic = "/bench/quiet";

command idle_table(settings& s) {
  command table{
      .verb = "bench idle",
      .examples = {{{"rowe bench idle -D 60s", "ten seconds for each policy and number of peers"},
                    {"rowe bench idle --json before.json", "to compare with later"}}},
      .description =
          "Opens an endpoint that has nothing to do, and measures the CPU time and the wake-ups of its "
          "service\n"
          "thread: for each idle policy without a peer, with one that is quiet, and with one that listens.\n",
      .operands = {},
      .options = run_options(s)};
  for (option& one : table.options)
    if (one.name == "--duration") one.meaning = "for all cases together (default 10s)";
  const auto more = output_options(s);
  table.options.insert(table.options.end(), more.begin(), more.end());
  return table;
}

std::set<pid_t> threads_of_this_process() {
  std::set<pid_t> ids;
  DIR* const folder = ::opendir("/proc/self/task");
  if (folder == nullptr) return ids;
  while (const dirent* const entry = ::readdir(folder)) {
    const int id = std::atoi(entry->d_name);
    if (id > 0) ids.insert(id);
  }
  ::closedir(folder);
  return ids;
}

struct thread_cost {
  rt::duration cpu{};
  std::uint64_t sleeps = 0;
};

thread_cost cost_of(pid_t thread) {
  thread_cost cost;
  // How Linux names the CPU clock of a thread (pthread_getcpuclockid computes the same from a pthread_t).
  constexpr unsigned of_one_thread = 4, as_scheduled = 2;
  const auto clock =
      static_cast<clockid_t>(~static_cast<unsigned>(thread) << 3 | of_one_thread | as_scheduled);
  timespec used{};
  if (::clock_gettime(clock, &used) == 0)
    cost.cpu = std::chrono::seconds{used.tv_sec} + std::chrono::nanoseconds{used.tv_nsec};
  std::ifstream status{joined("/proc/self/task/", thread, "/status")};
  for (std::string word; status >> word;)
    if (word == "voluntary_ctxt_switches:") status >> cost.sleeps;
  return cost;
}

enum class company { nobody, quiet, listening };

struct idle_case {
  rowe::idle policy;
  company with;
  std::string key, meaning; // "poll_quiet_peer", "poll, one quiet peer"
};

std::vector<idle_case> all_cases() {
  std::vector<idle_case> all;
  for (std::size_t i = 0; i < idle_names.size(); ++i) {
    const auto add = [&](company with, std::string_view key, std::string_view meaning) {
      all.push_back({static_cast<rowe::idle>(i), with, joined(idle_names[i], "_", key),
                     joined(idle_names[i], ", ", meaning)});
    };
    add(company::nobody, "no_peer", "no peer");
    add(company::quiet, "quiet_peer", "one quiet peer");
    add(company::listening, "listening_peer", "one peer that listens");
  }
  return all;
}

// The endpoint that is measured, and who is there.
class scene {
 public:
  scene(const settings& s, const idle_case& c) { set(s, c); }
  const std::string& wrong() const noexcept { return wrong_; }
  pid_t service_thread() const noexcept { return thread_; }

 private:
  void set(const settings& s, const idle_case& c) {
    endpoint_options options = s.options_of(s.here);
    options.idle_policy = c.policy;
    const std::set<pid_t> before = threads_of_this_process();
    auto hub = endpoint::listen(0, options);
    if (!hub) return fail(hub.error());
    hub_.emplace(std::move(hub).value());
    for (const pid_t id : threads_of_this_process())
      if (!before.contains(id)) thread_ = id;
    auto out = hub_->advertise<json_text>(quiet_topic);
    if (!out) return fail(out.error());
    out_ = std::move(*out);
    if (c.with != company::nobody) bring_peer(c.with == company::listening);
  }
  void fail(const error& why) { wrong_ = why.message(); }
  void bring_peer(bool listens) {
    auto peer = endpoint::connect(joined("ws://127.0.0.1:", hub_->port(), "/"));
    if (!peer) return fail(peer.error());
    peer_.emplace(std::move(peer).value());
    if (listens) {
      auto in = peer_->subscribe<json_text>(quiet_topic);
      if (!in) return fail(in.error());
      in_ = std::move(*in);
    }
    if (const status there = hub_->wait_peer(5s); !there) fail(there.error());
    for (int i = 0; listens && !out_.wanted() && i < 1000; ++i)
      interrupt::sleep_until(rt::monotonic_clock::now() + 1ms);
  }

  std::optional<endpoint> hub_, peer_;
  publisher<json_text> out_;
  subscriber<json_text> in_;
  pid_t thread_ = 0;
  std::string wrong_;
};

// Adds the figures of one case; false: Ctrl-C, or what is in r.problem.
bool measure(const settings& s, const idle_case& c, rt::duration time, report& r) {
  const scene here{s, c};
  if (!here.wrong().empty()) {
    r.problem = joined(c.meaning, ": ", here.wrong());
    return false;
  }
  interrupt::sleep_until(rt::monotonic_clock::now() + settle_time);
  const rt::time_point begin = rt::monotonic_clock::now();
  const thread_cost before = cost_of(here.service_thread());
  interrupt::sleep_until(begin + time);
  const thread_cost after = cost_of(here.service_thread());
  const std::chrono::duration<double> took = rt::monotonic_clock::now() - begin;
  if (interrupt::seen()) return false;
  const std::chrono::duration<double> cpu = after.cpu - before.cpu;
  r.figures.push_back({c.key + "_cpu_percent", "% of a CPU, " + c.meaning, 100 * cpu.count() / took.count()});
  r.figures.push_back({c.key + "_wakeups_per_s", "wake-ups/s, " + c.meaning,
                       static_cast<double>(after.sleeps - before.sleeps) / took.count()});
  return true;
}

} // namespace

exit_code idle(argument_list arguments) {
  settings s;
  console to{"bench idle"};
  if (const auto end = read_mode(idle_table(s), arguments, s, to)) return *end;
  if (s.here.service) s.here.user.reset(); // nobody measures but the kernel
  s.peer = {};
  const std::vector<idle_case> cases = all_cases();
  const rt::duration each = s.run_time_or_default() / static_cast<std::int64_t>(cases.size());
  to.note("measuring ", cases.size(), " cases for ", seconds_text(each), " each (Ctrl-C ends it and prints)");
  const rt::time_point start = rt::monotonic_clock::now();
  report r;
  r.mode = s.mode;
  r.measured = "the service thread of an endpoint that has nothing to do";
  r.where = this_machine(s.cpus());
  r.settings = {{"poll_period", time_text(endpoint_options{}.poll_period)},
                {"service thread", joined("cpu ", s.here.service ? std::to_string(*s.here.service) : "any",
                                          s.here.priority > 1 ? ", SCHED_FIFO" : ", ordinary scheduling")}};
  for (const idle_case& c : cases)
    if (!measure(s, c, each, r)) break;
  r.ran = rt::monotonic_clock::now() - start;
  return deliver(r, s, to);
}

} // namespace rowe::tools::bench
