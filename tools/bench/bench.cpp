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
#include "../rowe/verbs/verbs.hpp"
#include "compare.hpp"
#include "modes.hpp"

namespace rowe::tools::bench {
namespace {

struct mode {
  std::string_view name;
  std::string_view meaning;
  exit_code (*run)(argument_list);
};

constexpr std::array modes{
    mode{"rpc", "the round trip of a call to a robot", rpc},
    mode{"send", "from publishing to the arrival in the subscriber's thread", send},
    mode{"stop", "from asking for a stop to the loop's brake, and the parts of that", stop},
    mode{"loop", "how late a periodic loop wakes up", loop},
    mode{"expiry", "what it costs to expire a message among many that wait", expiry},
    mode{"idle", "what an idle endpoint costs", idle},
    mode{"peer", "the other end, for measuring between two processes or hosts", peer},
};

std::string overview() {
  std::string text =
      "examples:\n"
      "  rowe bench loop -D 60s --cpu 3 --prio 80         is this machine fit for a loop of 1 kHz\n"
      "  rowe bench rpc --max 2ms --p99.9 300us           exit code 5 when a call takes longer\n"
      "\nusage: rowe bench MODE [arguments]    (`rowe bench MODE --help` says which)\n\n"
      "Prints a distribution, never a mean alone, and first of all the machine. The times of the messages\n"
      "are fixed before the run begins, so a stall counts for every message that it delayed.\n\nmodes:\n";
  for (const mode& m : modes)
    text.append("  ").append(m.name).append(9 - m.name.size(), ' ').append(m.meaning) += '\n';
  return text;
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
  const auto* const found = std::ranges::find(modes, name, &mode::name);
  if (found != modes.end()) return found->run(arguments.subspan(1));
  std::array<std::string_view, modes.size()> names;
  std::ranges::transform(modes, names.begin(), &mode::name);
  const std::string_view meant = nearest(name, names);
  return usage_error("bench", joined("there is no mode ", quoted(name),
                                     meant.empty() ? "" : joined("; did you mean ", meant, "?")));
}

} // namespace rowe::tools::bench
