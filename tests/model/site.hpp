// SPDX-License-Identifier: Apache-2.0
// Where in the source an access stands. The atomics policy passes only the memory order, so the explorer
// takes the place through default arguments; that is how accesses are told apart when their orders are
// weakened one by one.
#pragma once
#include <source_location>
#include <string>
#include <string_view>

namespace rowe::model {

struct site {
  const char* file = "";
  unsigned line = 0;
  unsigned column = 0;

#if defined(__clang__)
  // clang 14 has no __builtin_source_location; two accesses on one line need the column.
  static constexpr site here(const char* file = __builtin_FILE(), unsigned line = __builtin_LINE(),
                             unsigned column = __builtin_COLUMN()) noexcept {
    return {file, line, column};
  }
#else
  static constexpr site here(std::source_location at = std::source_location::current()) noexcept {
    return {at.file_name(), at.line(), at.column()};
  }
#endif

  friend bool operator==(const site& a, const site& b) noexcept {
    return a.line == b.line && a.column == b.column &&
           (a.file == b.file || std::string_view{a.file} == std::string_view{b.file});
  }
};

// "window.hpp:57:12"
inline std::string text_of(const site& s) {
  const std::string_view file{s.file};
  return std::string{file.substr(file.rfind('/') + 1)} + ":" + std::to_string(s.line) + ":" +
         std::to_string(s.column);
}

} // namespace rowe::model
