// SPDX-License-Identifier: Apache-2.0
// Texts in JSON, as those who make up messages write them.
#pragma once
#include <string>
#include <string_view>

namespace swarm {

inline std::string quoted(std::string_view plain) { return '"' + std::string{plain} + '"'; }

// Each byte as \u00xx.
inline std::string escaped(std::string_view plain) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const char c : plain) {
    text += "\\u00";
    text += digits[static_cast<unsigned char>(c) >> 4];
    text += digits[static_cast<unsigned char>(c) & 15];
  }
  return text;
}

} // namespace swarm
