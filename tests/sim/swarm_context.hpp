// SPDX-License-Identifier: Apache-2.0
// What the parts of a swarm world share: the core in its harness, the random choices of this step, the
// coverage table, the first error, a trace for people, and who holds which topic and service, as far as it is
// known outside.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "service/core/core_harness.hpp"
#include "swarm_choices.hpp"
#include "swarm_coverage.hpp"
#include "swarm_grammar.hpp"

namespace swarm {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;
using core_harness = harness::core_harness;
using far_end = harness::peer; // of a connection
using rowe::service::counter;

// The first error of a run, under the name of the invariant that it breaks. An invariant can be switched off
// by its name, so that errors of others are seen.
class run_result {
 public:
  explicit run_result(const std::set<std::string>& without) : without_{without} {}
  void fail(std::string_view invariant, const std::string& what) {
    if (broken() || without_.contains(std::string{invariant})) return;
    invariant_ = invariant;
    what_ = what;
  }
  bool broken() const { return !invariant_.empty(); }
  const std::string& invariant() const { return invariant_; }
  const std::string& what() const { return what_; }
  bool watches(std::string_view invariant) const { return !without_.contains(std::string{invariant}); }

 private:
  const std::set<std::string>& without_;
  std::string invariant_;
  std::string what_;
};

// A message that was published on a topic, by its "n".
struct publication {
  std::uint32_t by = 0;     // an untrusted peer's number; 0: this process
  bool may_be_kept = false; // for those who subscribe later: its publisher asked for it
  std::uint64_t gone = 0;   // the step in which its publisher left; 0: it is there
  std::uint64_t heard = 0;  // the step in which it was received first; 0: not yet
  time_point said{};
};

struct context {
  core_harness& on;
  choices& random;
  coverage& seen;
  run_result& result;
  rowe::service::side ours;
  knowledge known;
  bool trace = false; // to the standard output, at once: a run may crash

  std::uint64_t step = 0;
  std::uint64_t cycles = 0; // of the core
  std::uint32_t message_number = 0;
  std::vector<publication> published{1};
  std::uint32_t untrusted = 0;                 // so far
  std::map<std::string, std::uint32_t> held{}; // topics, by untrusted peers: subscriptions and advertisements
  std::map<std::string, std::uint32_t> provided{};    // services, by untrusted peers
  std::map<std::string, std::uint32_t> own{};         // topics of this process's handles
  std::map<std::string, std::uint32_t> own_latched{}; // those of them that are latched
  std::set<std::string> once_latched{};               // by a handle of this process, at any time
  std::map<std::string, std::uint32_t> own_services{};
  std::set<std::pair<std::int64_t, std::int64_t>> resets{}; // asked for so far: number and tick
  bool numbers = false;                                     // the endpoint speaks the codec with numbers, too
  bool foxglove = false; // and every second of those who want it speaks Foxglove's protocol in its place
  bool stop_in_use = false;
  bool running = false;
  bool drives = false;     // there is a driven topic
  bool rights = false;     // peers ask what they may do
  bool takes_rest = false; // the transport, of large frames
  rowe::duration jumped{}; // of time: nothing was done in it

  // The time that the core had for its work.
  rowe::time_point worked_until() const { return on.now - jumped; }

  void say(const std::string& line) const {
    if (!trace) return;
    std::printf("%llu %s\n", static_cast<unsigned long long>(step), line.c_str());
    std::fflush(stdout);
  }
  void fail(std::string_view invariant, const std::string& what) { result.fail(invariant, what); }
  publication& message(std::uint32_t n) { return published[n < published.size() ? n : 0]; }
  std::uint32_t note_publication(std::uint32_t n, std::uint32_t by, bool may_be_kept) {
    if (published.size() <= n) published.resize(n + 1);
    published[n] = {.by = by, .may_be_kept = may_be_kept, .said = on.now};
    return n;
  }

  static bool in(const std::map<std::string, std::uint32_t>& of, const std::string& name) {
    const auto found = of.find(name);
    return found != of.end() && found->second != 0;
  }
  state state_of_topic(const std::string& name) const {
    if (name.starts_with("/rowe/st") && name != "/rowe/stop") return state::topic_own;
    if (name == "/rowe/control/state" && drives) return state::topic_own;
    if (in(own_latched, name)) return state::topic_latched;
    if (in(own, name)) return state::topic_own;
    return in(held, name) ? state::topic_peers : state::topic_absent;
  }
  state state_of_service(const std::string& name) const {
    if (name.starts_with("/rowe/") && name != "/rowe/other") return state::service_endpoints;
    if (name.starts_with("/rosapi/") || name.starts_with("rosapi/")) return state::service_endpoints;
    if (in(own_services, name)) return state::service_own;
    return in(provided, name) ? state::service_peers : state::service_nobodys;
  }
  state state_of_stop() const {
    return !stop_in_use ? state::stop_unused : running ? state::stop_running : state::stop_stopped;
  }
};

inline std::string shortened(std::string_view text, std::size_t most = 300) {
  std::string shown{text.substr(0, most)};
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < ' ' && c != '\n'; }, '.');
  if (text.size() > most) shown += "... (" + std::to_string(text.size()) + " bytes)";
  return shown;
}

// The integer behind a key; -1 where there is none.
inline std::int64_t integer_after(std::string_view text, std::string_view key) {
  const auto at = text.find(key);
  if (at == std::string_view::npos) return -1;
  std::int64_t number = 0;
  std::size_t i = at + key.size();
  const std::size_t begin = i;
  for (; i < text.size() && text[i] >= '0' && text[i] <= '9' && number < (std::int64_t{1} << 58); ++i)
    number = number * 10 + (text[i] - '0');
  return i == begin ? -1 : number;
}

} // namespace swarm
