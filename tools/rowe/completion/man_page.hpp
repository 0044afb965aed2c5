// SPDX-License-Identifier: Apache-2.0
// Manual pages, in the macros of man(7), written from the tables of the verbs.
#pragma once
#include <string>

#include "../arguments/command_line.hpp"

namespace rowe::tools {

// rowe(1): the verbs.
std::string man_page();
// rowe-VERB(1).
std::string man_page(const verb& of, const command& table);

} // namespace rowe::tools
