// SPDX-License-Identifier: Apache-2.0
// A picture as SVG: it needs no other file. Its texts are texts, in the font that who shows it has.
#pragma once
#include <string>

#include "colours.hpp"
#include "picture.hpp"

namespace rowe::tools {

// `dark`: for a dark ground only; else it follows what the reader's screen prefers.
std::string svg_of(const picture& shown, const palettes& colours, bool dark);

} // namespace rowe::tools
