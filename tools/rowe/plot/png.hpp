// SPDX-License-Identifier: Apache-2.0
// A picture as PNG.
#pragma once
#include <optional>
#include <string>

#include "colours.hpp"
#include "picture.hpp"

namespace rowe::tools {

// `font`: as lettering::open() takes it. Nothing: `why` says why not.
std::optional<std::string> png_of(const picture& shown, const palette& colours, const std::string& font,
                                  std::string& why);

} // namespace rowe::tools
