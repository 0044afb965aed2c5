// SPDX-License-Identifier: Apache-2.0
// Why a message was not converted: the code, the member, and the words. Allocates, as it is made only then.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include <rowe/result.hpp>

namespace rowe::rosmsg {

struct failure {
  error reason{errc::misuse};
  std::string path; // "pose.points[2].x"; empty: the message itself
  std::string what; // the rest of "the member "..." "

  // Each returns false, which callers return in turn.
  bool set(const error& code, std::string words) {
    reason = code;
    what = std::move(words);
    return false;
  }
  // On the way out: it was in this member, or element.
  bool in(std::string_view name) {
    const bool joins = path.empty() || path.front() == '[';
    path.insert(0, std::string{name} + (joins ? "" : "."));
    return false;
  }
  bool in(std::size_t element) {
    const bool joins = path.empty() || path.front() == '[';
    path.insert(0, "[" + std::to_string(element) + (joins ? "]" : "]."));
    return false;
  }

  std::string message() const {
    constexpr std::size_t path_bytes_max = 160;
    if (path.empty()) return "the message " + what;
    const bool fits = path.size() <= path_bytes_max;
    return "the member \"" + (fits ? path : path.substr(0, path_bytes_max) + "...") + "\" " + what;
  }
};

} // namespace rowe::rosmsg
