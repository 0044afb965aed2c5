// SPDX-License-Identifier: Apache-2.0
// rowe bench MODE [arguments]: finds the mode.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>

#include "../rowe/arguments/limit_options.hpp"
#include "../rowe/console.hpp"
#include "../rowe/network/remote.hpp"
#include "../rowe/output.hpp"
#include "../rowe/status_line.hpp"
#include "../rowe/text/colour.hpp"
#include "../rowe/text/page.hpp"
#include "../rowe/verbs/verb_list.hpp"
#include "../rowe/verbs/verbs.hpp"
#include "compare.hpp"
#include "modes.hpp"

namespace rowe::tools::bench {
namespace {

constexpr std::array all_modes{
    verb{"rpc", "the round trip of a call to a robot", rpc},
    verb{"send", "from publishing to the arrival in the subscriber's thread", send},
    verb{"stop", "from asking for a stop to the loop's brake, and the parts of that", stop},
    verb{"loop", "how late a periodic loop wakes up", loop},
    verb{"expiry", "what it costs to expire a message among many that wait", expiry},
    verb{"idle", "what an idle endpoint costs", idle},
    verb{"peer", "the other end, for measuring between two processes or hosts", peer},
};

std::string overview() {
  const std::size_t columns = columns_of_stdout();
  const auto heading = [](std::string_view text) { return colour::heading(text) + "\n"; };
  std::string text = heading("examples:");
  term_list examples;
  examples.add("rowe bench loop -D 60s --cpu 3 --prio 80", "is this machine fit for a loop of 1 kHz");
  examples.add("rowe bench rpc --max 2ms --p99.9 300us", "exit code 5 when a call takes longer");
  text += examples.text(columns) + "\n";
  text += wrapped(colour::heading("usage:") + " ",
                  "rowe bench MODE [arguments]    (`rowe bench MODE --help` says which)", 4, columns);
  text +=
      "\n" + wrapped("",
                     "Prints a distribution, never a mean alone, and first of all the machine. The times of "
                     "the messages are fixed before the run begins, so a stall counts for every message "
                     "that it delayed.",
                     0, columns == 0 ? 100 : columns);
  text += "\n" + heading("modes:");
  term_list modes;
  for (const verb& one : all_modes) modes.add(std::string{one.name}, one.meaning);
  return text + modes.text(columns);
}

// As far as can be told without touching it.
bool may_be_written(const std::string& file) {
  if (file.empty() || file == "-" || access(file.c_str(), W_OK) == 0) return true;
  const auto slash = file.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : file.substr(0, slash + 1);
  return errno == ENOENT && access(folder.c_str(), W_OK | X_OK) == 0;
}

} // namespace

std::optional<exit_code> read_mode(const command& table, argument_list arguments, settings& s, console& to) {
  if (const auto end = read(table, arguments)) return end;
  s.mode = table.verb.substr(table.verb.find(' ') + 1);
  to.be_quiet(s.quiet);
  const auto bounds = limits_for(table.verb);
  if (!bounds) return exit_code::usage;
  s.limits = *bounds;
  std::string wrong;
  if (!s.url.empty()) {
    const spelled_url url = read_url(s.url);
    if (url.url.empty()) return usage_error(table.verb, url.wrong);
    s.url = url.url;
  }
  if (wrong = complete(s); !wrong.empty()) return usage_error(table.verb, wrong);
  // Before the run, not after it.
  if (!s.compare.empty()) {
    const auto before = read_earlier(s.compare, wrong);
    if (!before) return usage_error(table.verb, wrong);
    if (before->mode != s.mode)
      return usage_error(table.verb, joined(quoted(s.compare), " is a result of `rowe bench ",
                                            printable(before->mode), "`"));
  }
  for (const std::string* file : {&s.json, &s.hgrm, &s.svg}) {
    if (!may_be_written(*file)) {
      to.error("cannot write ", quoted(*file));
      return exit_code::failed;
    }
  }
  return std::nullopt;
}

exit_code run(argument_list arguments) {
  const std::string_view name = arguments.empty() ? "" : arguments[0];
  if (name == "--help" || name == "-h") {
    emit(overview());
    return exit_code::done;
  }
  if (name.empty()) return usage_error("bench", "a mode is missing");
  if (const verb* const found = find_verb(all_modes, name)) return found->run(arguments.subspan(1));
  return usage_error("bench", joined("there is no mode ", quoted(name), meant_instead(name, all_modes)));
}

std::span<const verb> modes() noexcept { return all_modes; }

} // namespace rowe::tools::bench
