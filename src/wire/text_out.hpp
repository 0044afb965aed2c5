// SPDX-License-Identifier: Apache-2.0
// Puts pieces of text one behind the other into a caller's span, for answers and diagnostics. What does not
// fit is cut, and cut() says so. One thread; never waits, never allocates.
#pragma once
#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <span>
#include <string_view>

#include "json/utf8.hpp"

namespace rowe::wire {

class text_out {
 public:
  explicit text_out(std::span<char> buffer) noexcept : buffer_{buffer} {}

  text_out& add(std::string_view piece) noexcept {
    const std::size_t count = std::min(piece.size(), buffer_.size() - used_);
    if (count > 0) std::memcpy(buffer_.data() + used_, piece.data(), count);
    used_ += count;
    cut_ = cut_ || count < piece.size();
    return *this;
  }

  text_out& add(std::int64_t number) noexcept {
    char digits[20];
    const auto end = std::to_chars(digits, digits + sizeof digits, number).ptr;
    return add({digits, static_cast<std::size_t>(end - digits)});
  }

  // At most `bytes_max` bytes of `piece`, never half a UTF-8 character, and an ellipsis where something is
  // missing.
  text_out& add_shortened(std::string_view piece, std::size_t bytes_max) noexcept {
    if (piece.size() <= bytes_max) return add(piece);
    return add(json::utf8_prefix(piece, bytes_max)).add("...");
  }

  std::string_view text() const noexcept { return {buffer_.data(), used_}; }
  bool cut() const noexcept { return cut_; }

 private:
  std::span<char> buffer_;
  std::size_t used_ = 0;
  bool cut_ = false;
};

} // namespace rowe::wire
