// SPDX-License-Identifier: Apache-2.0
// Files that are in the program as they were when it was built: what an HTML file of `rowe plot` consists of.
#pragma once
#include <string_view>

namespace rowe::tools::page_files {

std::string_view colours() noexcept;  // src/page/colours.css
std::string_view style() noexcept;    // tools/rowe/plot/page/plot.css, with the colours in it
std::string_view script() noexcept;   // tools/rowe/plot/page/plot.js, with what it imports
std::string_view dygraphs() noexcept; // what draws the lines
std::string_view dygraphs_style() noexcept;
std::string_view dygraphs_licence() noexcept;

} // namespace rowe::tools::page_files
