// SPDX-License-Identifier: Apache-2.0
// What was plotted as one HTML file that loads nothing: dygraphs draws the lines, and one can zoom into them.
#pragma once
#include <string>

#include "series.hpp"

namespace rowe::tools {

// So many columns are looked at, of four samples each: 20 000 of each field.
inline constexpr std::size_t html_columns = 5000;

// `dark`: on a dark ground; else as the reader's screen prefers.
std::string html_of(const plotted_data& data, const std::string& title, bool dark);

} // namespace rowe::tools
