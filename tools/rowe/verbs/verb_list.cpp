// SPDX-License-Identifier: Apache-2.0
#include "verb_list.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "../console.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/colour.hpp"
#include "../text/page.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

constexpr std::array look_verbs{
    verb{"list", "list a robot's topics, services and actions", list},
    verb{"topics", "list a robot's topics, with their types", topics},
    verb{"services", "list a robot's services", services},
    verb{"actions", "list a robot's actions", actions},
    verb{"info", "say what a topic, a service or a recording is", info},
    verb{"echo", "print the messages of topics", echo},
    verb{"hz", "say how often messages of topics come, and how regularly", hz},
    verb{"bw", "say how many bytes a second topics take", bw},
    verb{"delay", "say how old messages are when they arrive", delay},
    verb{"top", "show peers, topics, rates, losses and the stop, live", top},
    verb{"peers", "list who is connected to an endpoint, and what was lost", peers},
    verb{"types", "print a robot's types as TypeScript, JSON Schema, ROS text or C", types},
    verb{"discover", "list the robots that are announced on the network", discover},
};
constexpr std::array do_verbs{
    verb{"pub", "publish a message, or the lines of stdin", pub},
    verb{"call", "call a service", call},
    verb{"param", "list a robot's parameters, read or set one", param},
    verb{"stop", "stop a robot, and say whether it acknowledged", stop},
    verb{"reset", "reset a stopped robot, so that it may move", reset},
};
constexpr std::array record_verbs{
    verb{"record", "record topics into a file, or repair one", record},
    verb{"replay", "publish what was recorded, at its own pace", replay},
    verb{"plot", "draw fields of a recording, or of a robot, as SVG, PNG or HTML", plot},
};
constexpr std::array serve_verbs{
    verb{"serve", "run a hub, with the page at /; --demo drives a simulated robot", serve},
    verb{"config", "check a rowe.toml, or show the values that hold", config},
    verb{"setup", "make certificate, tokens and settings, to put a robot on a network", setup},
    verb{"token", "add, remove or list who may connect to a robot that was set up", token},
};
constexpr std::array machine_verbs{
    verb{"doctor", "check whether this machine is fit for real time", doctor},
    verb{"bench", "measure latencies on this machine, as distributions", bench::run},
    verb{"completion", "print what makes a shell complete the program's words", completion},
    verb{"man", "print or write the manual pages", man},
    verb{"version", "print the version", version},
};
constexpr std::array groups{
    verb_group{"look at a robot", look_verbs},
    verb_group{"act on it", do_verbs},
    verb_group{"recordings", record_verbs},
    verb_group{"run and set up a robot", serve_verbs},
    verb_group{"this machine and this program", machine_verbs},
};

constexpr std::array exit_codes{
    meant_exit_code{"0", "did it"},
    meant_exit_code{"1", "the thing asked for failed, or its output cannot be written"},
    meant_exit_code{"2", "the arguments make no sense"},
    meant_exit_code{"3", "could not connect; the reason is printed"},
    meant_exit_code{"4", "no answer within --timeout"},
    meant_exit_code{"5", "a stated bound was exceeded, or a check failed with --strict"},
    meant_exit_code{"6", "messages expired or were dropped before they were sent"},
    meant_exit_code{"130", "interrupted before any result"},
};

std::vector<verb> all_verbs() {
  std::vector<verb> all;
  for (const verb_group& group : groups) all.insert(all.end(), group.verbs.begin(), group.verbs.end());
  return all;
}

// What others call it: the tools of ROS, and of recordings.
constexpr std::array<std::array<std::string_view, 2>, 11> other_words{{{"bag", "record"},
                                                                       {"rec", "record"},
                                                                       {"play", "replay"},
                                                                       {"topic", "topics"},
                                                                       {"service", "services"},
                                                                       {"action", "actions"},
                                                                       {"node", "peers"},
                                                                       {"nodes", "peers"},
                                                                       {"interface", "types"},
                                                                       {"msg", "types"},
                                                                       {"publish", "pub"}}};

exit_code unknown(std::string_view word) {
  const console to{""};
  to.error(no_such_verb(word));
  to.error("`rowe help` lists them");
  return exit_code::usage;
}

exit_code help(argument_list arguments) {
  const std::string_view name = arguments.empty() ? "" : arguments[0];
  if (name.empty() || name == "--help" || name == "-h") {
    emit(overview(columns_of_stdout()));
    return exit_code::done;
  }
  const verb* const about = find_verb(name);
  if (about == nullptr) return unknown(name);
  std::string option = "--help";
  std::array<char*, 1> only{option.data()};
  return about->run(only);
}

} // namespace

std::span<const verb_group> verb_groups() noexcept { return groups; }
std::span<const meant_exit_code> exit_code_meanings() noexcept { return exit_codes; }

const verb* find_verb(std::string_view name) noexcept {
  for (const verb_group& group : groups)
    if (const verb* const found = find_verb(group.verbs, name)) return found;
  return nullptr;
}

std::string no_such_verb(std::string_view word) {
  std::vector<verb> all = all_verbs();
  all.push_back({"help", "", nullptr});
  const auto other = std::ranges::find(other_words, word, [](const auto& one) { return one[0]; });
  return joined("there is no verb ", quoted(word),
                other != other_words.end() ? did_you_mean((*other)[1]) : meant_instead(word, all));
}

std::string overview(std::size_t columns) {
  const auto heading = [](std::string_view text) { return colour::heading(text) + "\n"; };
  std::string text = heading("examples:");
  term_list examples;
  examples.add("rowe serve --demo", "a robot to look at: open the URL that is printed");
  examples.add("rowe echo ws://127.0.0.1:8080 /odom", "its messages");
  text += examples.text(columns) + "\n";
  text += wrapped(colour::heading("usage:") + " ", "rowe VERB [arguments]    (`rowe VERB --help` says which)",
                  4, columns);
  std::size_t widest = 0;
  for (const verb& one : all_verbs()) widest = std::max(widest, one.name.size());
  for (const verb_group& group : groups) {
    text += "\n" + heading(joined(group.heading, ":"));
    term_list verbs;
    for (const verb& one : group.verbs)
      verbs.add(joined(one.name, std::string(widest - one.name.size(), ' ')), one.meaning);
    if (group.verbs.data() == groups.back().verbs.data())
      verbs.add(joined("help", std::string(widest - 4, ' ')), "this text, or that of a verb");
    text += verbs.text(columns);
  }
  text += "\n" + heading("exit codes:");
  term_list codes;
  for (const meant_exit_code& one : exit_codes)
    codes.add(joined(std::string(3 - one.code.size(), ' '), one.code), one.meaning);
  return text + codes.text(columns);
}

exit_code run_verb(argument_list arguments) {
  if (arguments.empty()) return help(arguments);
  const std::string_view name = arguments[0];
  const argument_list rest = arguments.subspan(1);
  if (name == "help" || name == "--help" || name == "-h") return help(rest);
  if (name == "--version") return version(rest);
  if (name == "complete") return complete(rest); // for the scripts of `rowe completion`
  const verb* const asked = find_verb(name);
  return asked == nullptr ? unknown(name) : asked->run(rest);
}

} // namespace rowe::tools
