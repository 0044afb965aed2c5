// SPDX-License-Identifier: Apache-2.0
// The words for a value in JSON that does not fit its member.
#pragma once
#include <string>

#include "rosmsg/definition.hpp"

namespace rowe::rosmsg {

// What the member, or one element of it, is read from: "a whole number from 0 to 255".
std::string wanted_one(const member& m);
// What it is read from as a whole, if it is an array: "an array of at most 3 elements".
std::string wanted_array(const member& m);
// The value that begins at `at`, shortened and on one line.
std::string found_at(const char* at, const char* end);

} // namespace rowe::rosmsg
