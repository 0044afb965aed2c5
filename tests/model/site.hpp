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
  const char* function = "";
  unsigned line = 0;
  unsigned column = 0;

#if defined(__clang__)
  // clang 14 has no __builtin_source_location; two accesses on one line need the column.
  static constexpr site here(const char* file = __builtin_FILE(), const char* function = __builtin_FUNCTION(),
                             unsigned line = __builtin_LINE(),
                             unsigned column = __builtin_COLUMN()) noexcept {
    return {file, function, line, column};
  }
#else
  static constexpr site here(std::source_location at = std::source_location::current()) noexcept {
    return {at.file_name(), at.function_name(), at.line(), at.column()};
  }
#endif

  friend bool operator==(const site& a, const site& b) noexcept {
    return a.line == b.line && a.column == b.column &&
           (a.file == b.file || std::string_view{a.file} == std::string_view{b.file});
  }
};

// The bare name of the function, whether the compiler gave "try_push" or the whole signature.
inline std::string_view function_of(const site& s) {
  std::string_view name{s.function};
  name = name.substr(0, name.find('('));
  const std::size_t before = name.find_last_of(": ");
  return before == std::string_view::npos ? name : name.substr(before + 1);
}

// "spsc_ring.hpp:64:36 in try_push"
inline std::string text_of(const site& s) {
  const std::string_view file{s.file};
  return std::string{file.substr(file.rfind('/') + 1)} + ":" + std::to_string(s.line) + ":" +
         std::to_string(s.column) + " in " + std::string{function_of(s)};
}

} // namespace rowe::model
