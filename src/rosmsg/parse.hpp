// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "rosmsg/definition.hpp"

namespace rowe::rosmsg {

// Reads a definition as recordings carry it: the members of the type `name`, and behind each line of `=` a
// line `MSG: package/Type` and the members of that type. Nothing: `why` says what is wrong, and in which
// line. For ordinary threads; allocates; takes steps in proportion to the text.
std::optional<definition> parse(std::string_view name, std::string_view text, ros_version version,
                                std::string& why);

} // namespace rowe::rosmsg
