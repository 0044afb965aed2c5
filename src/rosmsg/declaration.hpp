// SPDX-License-Identifier: Apache-2.0
// One line of a definition: a member or a constant. Pure; any thread; allocates.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "rosmsg/definition.hpp"

namespace rowe::rosmsg {

struct declaration {
  enum class sort : std::uint8_t { nothing, constant, member };
  sort is = sort::nothing;
  member read; // without its key and the place of its type
};

// Without white space on either side.
std::string_view stripped(std::string_view text) noexcept;
// Letters of ASCII, digits and underscores, no digit first, and not too long.
bool is_identifier(std::string_view word) noexcept;
// "geometry_msgs/Point" of "geometry_msgs/msg/Point"; any other name as it is.
std::string plain_name(std::string_view written);

// Reads a line; nothing, or what is wrong with it, as the rest of "line 3: ...".
std::optional<std::string> read_line(std::string_view line, ros_version version, declaration& into);

// The JSON of the text of a default value of this member. Nothing: there is none.
std::optional<std::string> json_of_default(std::string_view text, const member& of);

} // namespace rowe::rosmsg
