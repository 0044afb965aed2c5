// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "../console.hpp"
#include "../output.hpp"
#include "verbs.hpp"

namespace rowe::tools {

exit_code version(argument_list arguments) {
  bool json = false;
  const command table{
      .verb = "version",
      .examples = {{{"rowe version", "rowe 0.1.0"}, {"rowe version --json", "the same for programs"}}},
      .description = "Prints the version of the program, and with --json also what compiled it.\n",
      .operands = {},
      .options = {{"--json", "", "", "one JSON object", &json}}};
  if (const auto end = read(table, arguments)) return *end;
  const std::string text = json ? R"({"version":")" ROWE_VERSION R"(","compiler":")" ROWE_COMPILER R"("})"
                                  "\n"
                                : "rowe " ROWE_VERSION "\n";
  emit(text);
  return exit_code::done;
}

} // namespace rowe::tools
