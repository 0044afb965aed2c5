// SPDX-License-Identifier: Apache-2.0
// What a verb accepts, as a table: its arguments are read by it and its help is written from it, so neither
// can say what the other does not know. A verb fills in a `command` whose entries point to its own variables,
// which hold the defaults, and calls read().
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "../exit_code.hpp"

namespace rowe::tools {

// What follows the verb.
using argument_list = std::span<char* const>;

// Where a value goes, and what it may be. A bool is set by naming the option; a vector gathers repeated ones.
struct integer {
  std::int64_t* into;
  std::int64_t min;
  std::int64_t max;
};
struct choice {
  std::size_t* into; // the index of the chosen name
  std::span<const std::string_view> names;
};
struct time_span { // above 0
  std::optional<rt::duration>* into;
};
struct rate { // in hertz, above 0
  std::optional<double>* into;
  double max;
};
// An option whose name ends in a number of the user's, above 0: "--p" with it is --p50, --p99.9 and so on.
struct numbered_time {
  double number;
  rt::duration time;
};
struct numbered_times { // gathers them
  std::vector<numbered_time>* into;
  double number_max;
};
// Texts that somebody else reads, each as it was given, the empty one too.
struct any_text {
  std::vector<std::string>* into;
};
// The same of a switch: the option alone is "true", and `--page=false` says otherwise.
struct switch_text {
  std::vector<std::string>* into;
};
using target = std::variant<bool*, any_text, switch_text, std::string*, std::vector<std::string>*, integer,
                            choice, time_span, rate, numbered_times>;

struct option {
  std::string_view name;    // "--port", or "-n" where there is only a letter
  std::string_view letter;  // "-q", or empty
  std::string_view value;   // what stands behind it, for the help: "N"; empty for a bool
  std::string_view meaning; // a phrase
  target into;
};

// An argument that is known by its place.
struct operand {
  std::string_view name; // "URL"
  std::string_view meaning;
  std::variant<std::string*, std::vector<std::string>*> into; // a vector takes all that follow, at least one
  const char* variable = nullptr;                             // the environment's name for it: "ROWE_URL"
  // Where the environment has a value, what does not read like this one is the argument behind it already.
  bool (*reads_like_it)(std::string_view) = nullptr;
  bool optional = false;
  const bool* left_out = nullptr;       // an option that does away with it
  const std::string* instead = nullptr; // the value of one that does, too
};

struct example {
  std::string_view line;
  std::string_view meaning;
};

struct command {
  std::string_view verb;
  std::array<example, 2> examples;
  std::string_view description; // some lines, each ended by a newline
  std::vector<operand> operands;
  std::vector<option> options; // --help and --color are always among them
};

// Something that is typed behind the program's name, or behind a verb's.
struct verb {
  std::string_view name;
  std::string_view meaning;
  exit_code (*run)(argument_list);
};

// Reads the arguments into the table's targets. Nothing: they are read. Otherwise the verb ends with this:
// help was asked for and is on stdout (done), or what was wrong is on stderr, with the value and what it may
// be (usage).
std::optional<exit_code> read(const command& table, argument_list arguments);

// The text of --help, for a terminal of so many columns; 0: for none.
std::string help_of(const command& table, std::size_t columns);

// Those that every verb has.
std::span<const option> common_options();

// How an option, and an operand, stand in help: "-o, --output PATH"; "[TOPIC...]".
std::string spelling_of(const option& one);
std::string spelling_of(const operand& one);

// Has the table of a verb looked at, in place of reading arguments by it and doing what they say. Main
// thread.
void look_at_table(exit_code (*run)(argument_list), const std::function<void(const command&)>& look);

// The verb of `all` that a word names; null: there is none.
const verb* find_verb(std::span<const verb> all, std::string_view name) noexcept;
// "; did you mean call?", or nothing.
std::string meant_instead(std::string_view name, std::span<const verb> all);

// "; did you mean /odom?", to be read behind a sentence; nothing where nothing is meant.
std::string did_you_mean(std::string_view meant);

// Says on stderr what is wrong with the arguments of `verb`, and where the help is.
exit_code usage_error(std::string_view verb, std::string_view text);

// The word of `known` that `word` is most likely a slip of; empty when none is near.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known) noexcept;

} // namespace rowe::tools
