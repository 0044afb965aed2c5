// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
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

// Lists the names of an enum for a diagnostic, `"off", "on" or one of 7 others`. `name_of(i)` is each of
// them. Never waits, never allocates.
template <class NameOf>
void add_names(words& to, std::size_t count, std::size_t name_bytes_max, const NameOf& name_of) noexcept {
  constexpr std::size_t bytes_max = 96; // a status of 256 bytes has room for what was found
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string_view name = name_of(i);
    bytes += std::min(name.size(), name_bytes_max) + 4;
    if (bytes > bytes_max) {
      to.add(" or one of ").add(count - i).add(" others");
      return;
    }
    to.add(i == 0 ? "\"" : i + 1 == count ? " or \"" : ", \"");
    to.add_shortened(name, name_bytes_max).add("\"");
  }
}

} // namespace rowe::json
