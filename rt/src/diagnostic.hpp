// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <charconv>
#include <span>
#include <string_view>

namespace rowe::rt::detail {

// A diagnostic in the making, in a buffer that may be too short: what does not fit is cut. Never allocates.
class diagnostic {
 public:
  explicit diagnostic(std::span<char> buffer) noexcept : buffer_{buffer} {}
  diagnostic& say(std::string_view text) noexcept {
    const std::size_t bytes = std::min(text.size(), buffer_.size() - used_);
    std::copy_n(text.data(), bytes, buffer_.data() + used_);
    used_ += bytes;
    return *this;
  }
  diagnostic& say(long number) noexcept {
    char digits[24];
    const auto end = std::to_chars(digits, digits + sizeof digits, number).ptr;
    return say({digits, static_cast<std::size_t>(end - digits)});
  }
  // Before every part but the first.
  diagnostic& next(std::string_view separator) noexcept { return used_ == 0 ? *this : say(separator); }
  std::string_view view() const noexcept { return {buffer_.data(), used_}; }

 private:
  std::span<char> buffer_;
  std::size_t used_ = 0;
};

} // namespace rowe::rt::detail
