// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <charconv>
#include <concepts>
#include <cstddef>
#include <span>
#include <string_view>

#include "json/text/utf8.hpp"

namespace rowe::json {

// Puts pieces one behind the other; what does not fit is cut between characters.
class words {
 public:
  explicit words(std::span<char> buffer) noexcept : buffer_{buffer} {}

  words& add(std::string_view piece) noexcept {
    const std::size_t left = cut_ ? 0 : buffer_.size() - used_;
    used_ += utf8_prefix(piece, left).copy(buffer_.data() + used_, left);
    cut_ = cut_ || piece.size() > left;
    return *this;
  }
  template <std::integral Number>
  words& add(Number number) noexcept {
    char digits[20];
    const char* const last = std::to_chars(digits, digits + sizeof digits, number).ptr;
    return add({digits, static_cast<std::size_t>(last - digits)});
  }
  words& add_shortened(std::string_view piece, std::size_t bytes_max) noexcept {
    if (piece.size() <= bytes_max) return add(piece);
    return add(utf8_prefix(piece, bytes_max)).add("...");
  }
  std::string_view text() const noexcept { return {buffer_.data(), used_}; }

 private:
  std::span<char> buffer_;
  std::size_t used_ = 0;
  bool cut_ = false;
};

} // namespace rowe::json
