// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <system_error>

#include "../rowe/network/remote.hpp"
#include "../rowe/output.hpp"
#include "../rowe/text/json_values.hpp"
#include "compare.hpp"
#include "plot.hpp"
#include "probe.hpp"

namespace rowe::tools::bench {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration connect_time_min = 1s; // connecting takes what it takes, however little --timeout is

std::vector<std::string> child_arguments(const settings& s, const std::vector<std::string>& extra) {
  std::vector<std::string> words{"--port",
                                 "0",
                                 "--until-eof",
                                 "--idle",
                                 std::string{idle_names[s.idle]},
                                 "--size",
                                 std::to_string(s.size)};
  if (s.peer.user) {
    words.emplace_back("--cpu");
    words.push_back(joined(*s.peer.user, ",", s.peer.service.value_or(*s.peer.user)));
  }
  if (s.peer.priority > 0) {
    words.emplace_back("--prio");
    words.push_back(std::to_string(s.peer.priority));
  }
  words.insert(words.end(), extra.begin(), extra.end());
  return words;
}

// Asks the peer who it is. False: it is no peer of ours.
bool introduce(link& l, rt::duration timeout) {
  auto ask = l.hub->client<json_text, json_text>(info_service, {.depth = 1});
  if (!ask) return false;
  const auto answer = ask->call("{}", timeout);
  if (!answer) return false;
  const auto boot_id = answer->get<std::string>("boot_id");
  l.same_clock = boot_id && !boot_id->empty() && *boot_id == this_machine({}).boot_id;
  if (!l.same_clock) {
    const auto line = answer->get<std::string>("line");
    l.peer_machine = line ? printable(*line) : "unknown";
  }
  return true;
}

bool deliver_file(const std::string& name, const std::string& text, const console& to) {
  if (name.empty()) return true;
  if (name == "-") {
    emit(text);
    return true;
  }
  const int reason = tools::write_file(name, text);
  if (reason != 0) to.error("cannot write ", quoted(name), ": ", std::generic_category().message(reason));
  return reason == 0;
}

std::string hertz(double rate) {
  std::array<char, 40> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.6g Hz", rate);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

} // namespace

link connect(const settings& s, const console& to, const std::vector<std::string>& extra, bool needed) {
  link l;
  l.url = s.url;
  if (l.url.empty()) {
    l.started = std::make_unique<child>(child_arguments(s, extra));
    l.url = l.started->url();
    if (l.url.empty()) {
      to.error(l.started->wrong());
      l.failed = exit_code::failed;
      return l;
    }
    to.note("started a peer, process ", l.started->id(), ", at ", l.url);
  }
  auto hub = endpoint::connect(l.url, s.options_of(s.here));
  if (!hub) {
    l.failed = cannot_open(l.url, hub.error(), to);
    return l;
  }
  l.hub.emplace(std::move(hub).value());
  remote there{*l.hub, l.url, to};
  const rt::duration timeout = std::max(s.timeout.value_or(timeout_default), connect_time_min);
  l.failed = there.wait(timeout);
  if (l.failed) return l;
  const bool known = introduce(l, timeout);
  if (!known && needed) {
    std::string peer = "rowe bench peer";
    for (const std::string& word : extra) peer += " " + word;
    to.error(l.url, " does not measure: run `", peer, "` there");
    l.failed = exit_code::failed;
  }
  if (!known) l.peer_machine = "unknown: it is no `rowe bench peer`";
  return l;
}

void add_grants(report& to, const rt::grants& given) {
  if (given.complete()) return;
  std::array<char, 256> buffer;
  to.where.warnings.push_back(joined("not granted to the measuring thread: ", given.text(buffer)));
}

report report_of(const settings& s, std::string what, const link& over, const measured& m,
                 const recording& samples) {
  report r;
  r.mode = s.mode;
  r.measured = std::move(what);
  r.where = this_machine(s.cpus());
  r.peer = over.peer_machine;
  r.settings = {{"rate", hertz(s.rate_or_default())},
                {"size", joined(s.size, " bytes")},
                {"idle", std::string{idle_names[s.idle]}},
                {"here", joined(s.here.text(), s.spins(s.here) ? ", spins" : ", sleeps")},
                {"peer", over.started ? joined(s.peer.text(), s.spins(s.peer) ? ", spins" : ", sleeps")
                                      : joined("at ", over.url)}};
  r.ran = m.ran;
  r.counts = m.counts;
  r.samples = &samples;
  r.usage = m.usage;
  r.problem = m.problem;
  if (samples.times().count() > 0) r.bounds = bounds_of(s, samples.times());
  add_grants(r, m.grants);
  return r;
}

exit_code deliver(const report& r, const settings& s, const console& to) {
  std::optional<earlier> before;
  if (!s.compare.empty()) {
    std::string wrong;
    before = read_earlier(s.compare, wrong);
    if (!before) {
      to.error(wrong);
      return exit_code::usage;
    }
  }
  if (s.json != "-") emit(text_of(r) + (before ? comparison_of(*before, r) : std::string{}));
  bool written = deliver_file(s.json, json_of(r), to);
  if (r.samples != nullptr) {
    written = deliver_file(s.hgrm, hgrm_of(r), to) && written;
    written = (s.svg.empty() || deliver_file(s.svg, svg_of(r, before ? &*before : nullptr), to)) && written;
  }
  const exit_code verdict = verdict_of(r);
  return written || verdict != exit_code::done ? verdict : exit_code::failed;
}

} // namespace rowe::tools::bench
