// SPDX-License-Identifier: Apache-2.0
// Where `rowe pub` has its messages from: one text, again and again, or the lines of stdin.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

// The lines of stdin, read without being deaf to Ctrl-C.
class line_reader {
 public:
  explicit line_reader(std::size_t line_bytes_max) noexcept : line_bytes_max_{line_bytes_max} {}

  enum class outcome : std::uint8_t { line, nothing_yet, end, too_long };

  // Waits for a line at most until `deadline`, and not long once a signal came.
  outcome read(std::string& line, rt::time_point deadline);
  // Of the line that was read last, from 1.
  std::uint64_t number() const noexcept { return number_; }

 private:
  bool cut_line(std::string& line);

  std::size_t line_bytes_max_;
  std::string buffer_;
  std::size_t searched_ = 0; // so much of it has no end of a line
  std::uint64_t number_ = 0;
  bool ended_ = false;
};

// The message with `header.stamp` set to this time since 1970, a ROS time {"secs":..,"nsecs":..}; where there
// is no header, it gets one. Nothing: its `header` is no object. `object` must be a valid one.
std::optional<std::string> stamped(std::string_view object, rt::duration since_1970);

} // namespace rowe::tools
