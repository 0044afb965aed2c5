// SPDX-License-Identifier: Apache-2.0
// What rosapi answers of a type (`message_details`): the type, and each type inside of it, once. A type
// inside that has no name is called as its owner and the member, "nav_msgs/Odometry_pose", because clients
// look it up by its name. What ROS does not have is said as it comes nearest: an optional member as one that
// is there, an array of arrays by its innermost element. Nothing waits or allocates.
#pragma once
#include <string_view>

#include <rowe/schema.hpp>

#include "json/writing/writer.hpp"

namespace rowe::wire {

// Types that one answer may have, with those inside.
inline constexpr std::size_t typedefs_max = 64;

// Writes the array of types. `called`: the outermost type's name. False: there are more than typedefs_max,
// and what was written is of no use.
bool write_typedefs(json::writer& into, const schema_description& type, std::string_view called) noexcept;

// The type of this name inside of `type`, or that type itself; null: there is none. It has its own name.
const schema_description* find_type(const schema_description& type, std::string_view called) noexcept;

} // namespace rowe::wire
