// SPDX-License-Identifier: Apache-2.0
// All verbs of the program, from which its help, its manual pages and the completion of shells are made.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "../arguments/command_line.hpp"

namespace rowe::tools {

struct verb_group {
  std::string_view heading;
  std::span<const verb> verbs;
};

// `bench` and `man` among them; `help` is no verb of the list.
std::span<const verb_group> verb_groups() noexcept;
const verb* find_verb(std::string_view name) noexcept; // null: there is none
// "there is no verb 'bag'; did you mean record?"
std::string no_such_verb(std::string_view word);

// Those of `rowe bench`.
namespace bench {
std::span<const verb> modes() noexcept;
}

// What `rowe help` prints. `columns`: of the terminal; 0: none.
std::string overview(std::size_t columns);

struct meant_exit_code {
  std::string_view code;
  std::string_view meaning;
};
std::span<const meant_exit_code> exit_code_meanings() noexcept;

// Finds the verb in the program's arguments, and runs it.
exit_code run_verb(argument_list arguments);

} // namespace rowe::tools
