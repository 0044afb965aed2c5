// SPDX-License-Identifier: Apache-2.0
// Puts pieces of text one behind the other into a caller's span, for answers and diagnostics. What does not
// fit is cut, and cut() says so. One thread; never waits, never allocates.
#pragma once
#include <algorithm>
#include <array>
#include <charconv>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <span>
#include <string_view>

#include "json/text/utf8.hpp"

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

  template <std::integral Number>
  text_out& add(Number number) noexcept {
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

  // A name that somebody else chose, of at most `bytes_max` bytes with what is around it. It stands plain
  // only if it is plain. Any other is in quotes, so that no line of a log is taken for another one.
  text_out& add_name(std::string_view name, std::size_t bytes_max) noexcept {
    if (is_plain(name)) return add_shortened(name, bytes_max);
    return add("'").add_quoted(name, bytes_max - 2, '\'').add("'");
  }

  // The same between quotes that the caller writes: the text cannot end them.
  text_out& add_quoted(std::string_view piece, std::size_t bytes_max, char quote) noexcept {
    const auto is_escaped = [quote](char c) { return c == quote || c == '\\'; };
    std::size_t count = 0;
    for (std::size_t bytes = 0; count < piece.size(); ++count)
      if ((bytes += is_escaped(piece[count]) ? 2U : 1U) > bytes_max) break;
    const std::string_view shown = json::utf8_prefix(piece, count);
    for (const char& c : shown) (is_escaped(c) ? add("\\") : *this).add({&c, 1});
    return shown.size() == piece.size() ? *this : add("...");
  }

  std::string_view text() const noexcept { return {buffer_.data(), used_}; }
  bool cut() const noexcept { return cut_; }

 private:
  // Characters of names of ROS and of programs.
  static bool is_plain(std::string_view name) noexcept {
    return std::all_of(name.begin(), name.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             std::string_view{"/_-.~#*+@$%&=<>[]{}"}.find(c) != std::string_view::npos;
    });
  }

  std::span<char> buffer_;
  std::size_t used_ = 0;
  bool cut_ = false;
};

// The same with a buffer of its own.
template <std::size_t Bytes>
class text_of : std::array<char, Bytes>, public text_out {
 public:
  text_of() noexcept : text_out{std::span<char>{static_cast<std::array<char, Bytes>&>(*this)}} {}
  text_of(const text_of&) = delete;
  text_of& operator=(const text_of&) = delete;
};

} // namespace rowe::wire
