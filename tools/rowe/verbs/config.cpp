// SPDX-License-Identifier: Apache-2.0
// rowe config: whether a configuration makes sense, and which values hold.
#include <algorithm>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../arguments/configuration.hpp"
#include "../console.hpp"
#include "../output.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

struct config_words {
  std::string what;
  std::string file;
};

command table_of(config_words& words, configuration_options& chosen) {
  return {
      .verb = "config",
      .examples = {{{"rowe config check rowe.toml", "whether `rowe serve --config rowe.toml` would take it"},
                    {"rowe config show rowe.toml", "each value that holds, and where it comes from"}}},
      .description =
          "`check` reports all mistakes with file and line, and then exits with 2. `show` prints the\n"
          "values as a file of TOML, and takes the options of `rowe serve`. Both read the environment, as\n"
          "`rowe serve` does. docs/config.md has the keys.\n",
      .operands = {{.name = "check|show", .meaning = "what to do", .into = &words.what},
                   {.name = "FILE",
                    .meaning = "a file of TOML (of show: default $ROWE_CONFIG, or none)",
                    .into = &words.file,
                    .optional = true}},
      .options = chosen.table(),
  };
}

std::string text_of(const settings& shown) {
  constexpr std::size_t place_of_comments = 40;
  std::string text;
  for (const setting& one : shown.list()) {
    if (one.first_of_section) text.append(text.empty() ? "" : "\n").append(joined("[", one.section, "]\n"));
    const std::string line = joined(one.name, " = ", one.value);
    text.append(line).append(std::max(place_of_comments, line.size() + 2) - line.size(), ' ');
    text.append("# ").append(printable(one.origin)).append("\n");
  }
  return text;
}

} // namespace

exit_code config(argument_list arguments) {
  config_words words;
  configuration_options given;
  if (const auto end = read(table_of(words, given), arguments)) return *end;
  const bool checks = words.what == "check";
  if (!checks && words.what != "show")
    return usage_error("config", joined("it is `check` or `show`, not ", quoted(words.what)));
  if (checks && words.file.empty()) return usage_error("config", "`check` needs a FILE");
  if (!words.file.empty()) given.use_file(words.file);
  const auto chosen = given.read_all("config");
  if (!chosen) return exit_code::usage;
  const std::string text = checks ? joined(words.file, ": no mistakes\n") : text_of(*chosen);
  emit(text);
  return exit_code::done;
}

} // namespace rowe::tools
