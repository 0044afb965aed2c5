// SPDX-License-Identifier: Apache-2.0
// What may stand where a shell's cursor is, found in the tables of the verbs, and at the robot for names.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../network/remote.hpp"

namespace rowe::tools {

struct candidate {
  std::string word;
  std::string meaning{};
};

enum class asked_names : std::uint8_t { none, topics, services, topics_and_services, parameters };

struct completion_answer {
  std::vector<candidate> words{};
  bool files = false; // the shell's own completion of files, too
  // Names that only a robot knows, and where it is, as far as the words say it; no URL: $ROWE_URL, if that is
  // set.
  asked_names names = asked_names::none;
  remote_place at{};
};

// `words`: those behind the program's name; the last one is where the cursor is, and may be empty. Does not
// ask any robot. Main thread.
completion_answer candidates_for(std::span<const std::string> words);

} // namespace rowe::tools
