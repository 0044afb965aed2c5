// SPDX-License-Identifier: Apache-2.0
// What `rowe info` prints of a recording.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "survey.hpp"

namespace rowe::tools {

// For people, in lines of at most so many columns (0: any), but for words that are longer.
std::string text_of(const survey& about, std::size_t columns);

// For programs: one JSON object, on one line.
std::string json_of(const survey& about);

// Likewise of a file that could not be read.
std::string json_of_unreadable(std::string_view path, std::string_view why);

} // namespace rowe::tools
