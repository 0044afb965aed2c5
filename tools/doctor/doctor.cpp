// SPDX-License-Identifier: Apache-2.0
// rowe doctor: is this machine fit for real time? Goes through the tables of checks and prints what each one
// found, for people or for programs.
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "../rowe/arguments/command_line.hpp"
#include "../rowe/console.hpp"
#include "../rowe/interrupt.hpp"
#include "../rowe/output.hpp"
#include "../rowe/text/json_values.hpp"
#include "../rowe/verbs/verbs.hpp"
#include "check.hpp"
#include "report.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;
using namespace fitness;

constexpr rt::duration self_test_default = 2s;

struct doctor_options {
  std::string cpus;
  std::optional<rt::duration> duration;
  std::string root;
  std::string certificate;
  bool quick = false;
  bool fix_hints = false;
  bool strict = false;
  bool json = false;
  bool verbose = false;
  bool quiet = false;
};

command table_of(doctor_options& o) {
  return {
      .verb = "doctor",
      .examples = {{{"rowe doctor --cpu 2,3 --fix-hints", "what is in the way of a loop on cpu 2 or 3"},
                    {"rowe doctor --json > before.json", "to compare with later"}}},
      .description =
          "Says whether this machine is fit for a real-time loop: for each check whether it is ok, fails\n"
          "(promises do not hold here), warns (they hold, with more latency than necessary) or is for\n"
          "information, with what was found, what is wanted and why. Changes nothing. What only root can\n"
          "see is reported as not visible.\n",
      .operands = {},
      .options = {
          {"--cpu", "", "LIST",
           "the cores meant for loops, such as 2,3 (default: isolated ones, else the last)", &o.cpus},
          {"--fix-hints", "", "", "with the commands that would change it, to be run as root", &o.fix_hints},
          {"--duration", "", "TIME", "how long the self-test measures wake-ups (default 2s)",
           time_span{&o.duration}},
          {"--quick", "", "", "without the self-test", &o.quick},
          {"--certificate", "", "FILE", "also when this certificate ends (PEM)", &o.certificate},
          {"--strict", "", "", "exit code 5 if a check fails", &o.strict},
          {"--json", "", "", "one JSON object a line, one for each check", &o.json},
          {"--root", "", "DIR", "examine another machine's files, DIR/proc and DIR/sys, and DIR/trials",
           &o.root},
          {"--verbose", "-v", "", "reasons and changes also for checks that are ok", &o.verbose},
          {"--quiet", "-q", "", "only checks that fail or warn", &o.quiet},
      }};
}

// The cores this process may use; where nobody tells, the first one.
cpu_list allowed_cpus(const facts& files) {
  const reading status = files.read("/proc/self/status");
  auto cpus = cpu_list::of_list(entry_of(status.text, "Cpus_allowed_list"));
  return cpus && !cpus->empty() ? *cpus : cpu_list{{0}};
}

cpu_list list_in(const facts& files, std::string_view path) {
  return cpu_list::of_list(files.read(path).text).value_or(cpu_list{});
}

// The cores to examine and to measure on. None: `wrong` says why.
struct choice_of_cpus {
  cpu_list cpus = {};
  std::string wrong = {};
};
choice_of_cpus choose(const facts& files, const std::string& asked) {
  const cpu_list online = list_in(files, "/sys/devices/system/cpu/online");
  if (!asked.empty()) {
    const auto cpus = cpu_list::of_list(asked);
    if (!cpus || cpus->empty()) {
      return {.wrong = joined("--cpu needs a list of cores such as 2,3 or 2-5, not ", quoted(asked))};
    }
    if (!online.empty() && !online.contains_all(*cpus)) {
      return {.wrong = joined("--cpu ", cpus->text(), ": there is no cpu ", cpus->without(online).text(),
                              "; this machine has ", online.text())};
    }
    return {.cpus = *cpus};
  }
  // Isolated cores are meant for loops; the affinity of a shell does not name them. Without any, the last
  // core is the best one: the first has most of the interrupts.
  const cpu_list isolated = list_in(files, "/sys/devices/system/cpu/isolated").both(online);
  return {.cpus = isolated.empty() ? cpu_list{{allowed_cpus(files).back()}} : isolated};
}

std::size_t columns_of_stdout() {
  if (::isatty(STDOUT_FILENO) == 0) return 0;
  winsize window{};
  const bool told = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col != 0;
  return std::clamp<std::size_t>(told ? window.ws_col : 80, 40, 110);
}

} // namespace

exit_code doctor(argument_list arguments) {
  doctor_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  if (chosen.quick && chosen.duration)
    return usage_error("doctor", "--quick and --duration exclude each other");
  const facts files{chosen.root};
  if (!chosen.root.empty() && !files.exists("/proc") && !files.exists("/sys")) {
    return usage_error("doctor", joined("--root ", quoted(chosen.root), " has neither proc nor sys in it"));
  }
  const choice_of_cpus choice = choose(files, chosen.cpus);
  if (choice.cpus.empty()) return usage_error("doctor", choice.wrong);

  const std::unique_ptr<trials> trial = chosen.root.empty() ? machine_trials() : recorded_trials(files);
  const machine on{.files = files,
                   .trial = *trial,
                   .cpus = choice.cpus,
                   .self_test = chosen.quick ? 0s : chosen.duration.value_or(self_test_default),
                   .certificate = chosen.certificate};
  console to{"doctor"};
  to.be_quiet(chosen.quiet);
  if (!chosen.quick && chosen.root.empty()) {
    to.note("measures wake-ups on cpu ", choice.cpus.text(), " for ", seconds_text(on.self_test),
            " (Ctrl-C to stop)");
  }

  report out{{.columns = columns_of_stdout(),
              .json = chosen.json,
              .commands = chosen.fix_hints,
              .reasons = chosen.verbose,
              .only_bad = chosen.quiet}};
  bool read_by_somebody = chosen.json || emit(report::heading(on));
  const auto go_through = [&](const group& some) {
    for (const check& one : some.checks) {
      const std::string text = out.text_of(some, one, examine(one, on));
      if (read_by_somebody) read_by_somebody = emit(text);
    }
  };
  for (const group& some : groups()) go_through(some);
  if (!chosen.certificate.empty()) go_through(certificate_group());
  if (chosen.json) {
    to.note(out.summary());
    to.note(out.verdict());
  } else if (read_by_somebody) {
    emit(joined("\n", out.summary(), "\n", out.verdict(), "\n"));
  }
  return chosen.strict && out.count(level::fail) != 0 ? exit_code::exceeded : exit_code::done;
}

} // namespace rowe::tools
