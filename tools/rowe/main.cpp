// SPDX-License-Identifier: Apache-2.0
// rowe VERB [arguments]: finds the verb.
#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "arguments/command_line.hpp"
#include "console.hpp"
#include "output.hpp"
#include "verbs/verbs.hpp"

namespace rowe::tools {
namespace {

struct verb {
  std::string_view name;
  std::string_view meaning;
  exit_code (*run)(argument_list);
};

constexpr std::array verbs{
    verb{"serve", "run a hub, with the page at /; --demo drives a simulated robot", serve},
    verb{"config", "check a rowe.toml, or show the values that hold", config},
    verb{"pub", "publish a message, or the lines of stdin", pub},
    verb{"echo", "print the messages of topics", echo},
    verb{"call", "call a service", call},
    verb{"stop", "stop a robot, and say whether it acknowledged", stop},
    verb{"reset", "reset a stopped robot, so that it may move", reset},
    verb{"param", "list a robot's parameters, read or set one", param},
    verb{"types", "print a robot's types as TypeScript, JSON Schema, ROS text or C", types},
    verb{"peers", "list who is connected to an endpoint, and what was lost", peers},
    verb{"record", "record topics into a file, or repair one", record},
    verb{"info", "say what is in a recording", info},
    verb{"replay", "publish what was recorded, at its own pace", replay},
    verb{"setup", "make certificate, tokens and settings, to put a robot on a network", setup},
    verb{"token", "add, remove or list who may connect to a robot that was set up", token},
    verb{"discover", "list the robots that are announced on the network", discover},
    verb{"doctor", "check whether this machine is fit for real time", doctor},
    verb{"bench", "measure latencies on this machine, as distributions", bench::run},
    verb{"version", "print the version", version},
};

constexpr std::string_view exit_codes = R"(
exit codes:
    0  did it
    1  the thing asked for failed, or its output cannot be written
    2  the arguments make no sense
    3  could not connect; the reason is printed
    4  no answer within --timeout
    5  a stated bound was exceeded, or a check failed with --strict
    6  messages expired or were dropped before they were sent
  130  interrupted before any result
)";

std::string overview() {
  std::string text =
      "examples:\n"
      "  rowe serve --demo                      a robot to look at: open the URL that is printed\n"
      "  rowe echo ws://127.0.0.1:8080 /odom    its messages\n"
      "\nusage: rowe VERB [arguments]    (`rowe VERB --help` says which)\n\nverbs:\n";
  for (const verb& v : verbs)
    text.append("  ").append(v.name).append(9 - v.name.size(), ' ').append(v.meaning) += '\n';
  text.append("  help     this text, or that of a verb\n");
  return text.append(exit_codes);
}

exit_code unknown(std::string_view word) {
  std::vector<std::string_view> names{"help"};
  for (const verb& v : verbs) names.push_back(v.name);
  const std::string_view meant = nearest(word, names);
  const console to{"help"};
  to.error("there is no verb ", quoted(word), meant.empty() ? "" : joined("; did you mean ", meant, "?"));
  to.error("`rowe help` lists them");
  return exit_code::usage;
}

const verb* find(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(verbs, name, &verb::name);
  return found == verbs.end() ? nullptr : found;
}

exit_code help(argument_list arguments) {
  const std::string_view name = arguments.empty() ? "" : arguments[0];
  if (name.empty() || name == "--help" || name == "-h") {
    emit(overview());
    return exit_code::done;
  }
  const verb* const about = find(name);
  if (about == nullptr) return unknown(name);
  std::string option = "--help";
  std::array<char*, 1> only{option.data()};
  return about->run(only);
}

exit_code run(argument_list arguments) {
  if (arguments.empty()) return help(arguments);
  const std::string_view name = arguments[0];
  const argument_list rest = arguments.subspan(1);
  if (name == "help" || name == "--help" || name == "-h") return help(rest);
  if (name == "--version") return version(rest);
  const verb* const asked = find(name);
  return asked == nullptr ? unknown(name) : asked->run(rest);
}

} // namespace
} // namespace rowe::tools

int main(int count, char** words) { return rowe::tools::run_program(count, words, rowe::tools::run); }
