// SPDX-License-Identifier: Apache-2.0
#include "json/reading/fault.hpp"

#include <bitset>
#include <cassert>
#include <charconv>
#include <cstring>

#include "json/text/characters.hpp"
#include "json/text/utf8.hpp"

namespace rowe::json {
namespace {

// One pass over the text. Each function moves at_ behind what it has accepted, or leaves it at the first byte
// that is wrong and returns false.
class scan {
 public:
  scan(std::string_view text, std::size_t depth_max) noexcept
      : begin_{text.data()}, at_{begin_}, end_{begin_ + text.size()}, depth_max_{depth_max} {}

  fault run() noexcept {
    if (document()) return {};
    return {too_deep_ ? fault_kind::too_deep : fault_kind::malformed, static_cast<std::size_t>(at_ - begin_)};
  }

 private:
  bool at(char c) const noexcept { return at_ != end_ && *at_ == c; }
  bool take(char c) noexcept {
    if (!at(c)) return false;
    ++at_;
    return true;
  }
  void skip_space() noexcept {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\n' || *at_ == '\r')) ++at_;
  }

  // Scans the value of a document, iteratively. After a value that opens something comes the first thing
  // inside it. After a complete value comes whatever is behind it, out to the outermost level.
  bool document() noexcept {
    skip_space();
    do {
      bool opened = false;
      if (!value(opened)) return false;
      if (!opened && !behind_value()) return false;
    } while (depth_ > 0);
    skip_space();
    return at_ == end_;
  }

  // A scalar, an empty object or array, or the beginning of one that is not empty.
  bool value(bool& opened) noexcept {
    if (at_ == end_) return false;
    switch (*at_) {
    case '{': return open('}', opened);
    case '[': return open(']', opened);
    case '"': return string();
    case 't': return word("true");
    case 'f': return word("false");
    case 'n': return word("null");
    default: return number();
    }
  }

  bool open(char closing, bool& opened) noexcept {
    if (depth_ == depth_max_) {
      too_deep_ = true;
      return false;
    }
    ++at_;
    skip_space();
    if (take(closing)) return true;
    is_object_[depth_++] = closing == '}';
    opened = true;
    return closing == ']' || name();
  }

  // Closes what ends behind a complete value; true at the next value, or when nothing is open any more.
  bool behind_value() noexcept {
    while (depth_ > 0) {
      const bool in_object = is_object_[depth_ - 1];
      skip_space();
      if (take(',')) {
        skip_space();
        return !in_object || name();
      }
      if (!take(in_object ? '}' : ']')) return false;
      --depth_;
    }
    return true;
  }

  // "name" : up to the value.
  bool name() noexcept {
    if (!at('"') || !string()) return false;
    skip_space();
    if (!take(':')) return false;
    skip_space();
    return true;
  }

  bool word(std::string_view expected) noexcept {
    for (const char c : expected) {
      if (!take(c)) return false;
    }
    return true;
  }

  bool string() noexcept {
    ++at_;
    while (at_ != end_) {
      const auto byte = static_cast<std::uint8_t>(*at_);
      if (byte == '"') {
        ++at_;
        return true;
      }
      if (byte == '\\') {
        if (!escape()) return false;
        continue;
      }
      if (byte < 0x20) return false;
      const utf8_piece piece = next_utf8(at_, end_);
      if (!piece.valid) return false;
      at_ += piece.bytes;
    }
    return false;
  }

  bool escape() noexcept {
    const char* const begin = at_++;
    if (at_ == end_) return false;
    if (std::memchr("\"\\/bfnrt", *at_, 8) != nullptr) {
      ++at_;
      return true;
    }
    std::uint32_t unit = 0;
    if (!code_unit(unit)) return false;
    bool paired = unit < 0xd800 || unit > 0xdfff;
    if (unit >= 0xd800 && unit <= 0xdbff && at('\\')) {
      ++at_;
      std::uint32_t low = 0;
      paired = code_unit(low) && low >= 0xdc00 && low <= 0xdfff;
    }
    if (!paired) at_ = begin; // an unpaired surrogate is wrong where it begins
    return paired;
  }

  // What follows the backslash of \uXXXX.
  bool code_unit(std::uint32_t& unit) noexcept {
    if (!take('u')) return false;
    for (int i = 0; i < 4; ++i) {
      const unsigned digit = at_ == end_ ? 16 : hex_value(*at_);
      if (digit > 15) return false;
      unit = unit << 4 | digit;
      ++at_;
    }
    return true;
  }

  bool digits() noexcept {
    const char* const begin = at_;
    while (at_ != end_ && is_digit(*at_)) ++at_;
    return at_ != begin;
  }

  bool number() noexcept {
    const char* const begin = at_;
    take('-');
    if (!take('0') && !digits()) return false;
    if (take('.') && !digits()) return false;
    const bool has_exponent = at('e') || at('E');
    if (has_exponent) {
      ++at_;
      if (!take('+')) take('-');
      if (!digits()) return false;
    }
    const auto bytes = static_cast<std::size_t>(at_ - begin);
    constexpr std::size_t always_in_range = 300; // digits, of which a double has 308 in front of its point
    if ((!has_exponent && bytes <= always_in_range) || nearest_double({begin, bytes})) return true;
    at_ = begin;
    return false;
  }

  const char* const begin_;
  const char* at_;
  const char* const end_;
  const std::size_t depth_max_;
  std::size_t depth_ = 0;
  bool too_deep_ = false;
  std::bitset<fault_depth_limit> is_object_; // of each open level
};

// Is the number 1 or more? Decides by its digits alone: by the power of ten of the first one that is not 0.
bool is_large(std::string_view token) noexcept {
  std::int64_t scale = 0;
  bool behind_point = false;
  bool significant = false;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const char c = token[i];
    if (c == '.') {
      behind_point = true;
    } else if (c == 'e' || c == 'E') {
      std::string_view behind = token.substr(i + 1);
      const bool negative = behind.starts_with('-');
      if (negative || behind.starts_with('+')) behind.remove_prefix(1);
      // No text has enough digits to compensate for a larger exponent, so this one represents all of them.
      constexpr std::int64_t exponent_max = std::int64_t{1} << 48;
      std::int64_t exponent = 0;
      const auto read = std::from_chars(behind.data(), behind.data() + behind.size(), exponent);
      if (read.ec == std::errc::result_out_of_range || exponent > exponent_max) exponent = exponent_max;
      scale += negative ? -exponent : exponent;
      break;
    } else if (is_digit(c)) {
      significant |= c != '0';
      if (significant && !behind_point) ++scale;
      if (!significant && behind_point) --scale;
    }
  }
  return scale > 0;
}

} // namespace

fault find_fault(std::string_view text, std::size_t depth_max) noexcept {
  assert(depth_max <= fault_depth_limit);
  return scan{text, depth_max}.run();
}

std::optional<double> nearest_double(std::string_view token) noexcept {
  double x = 0;
  const char* const end = token.data() + token.size();
  const auto read = std::from_chars(token.data(), end, x);
  if (read.ptr != end) return std::nullopt;
  if (read.ec == std::errc{}) return x;
  // The standard does not say whether the number was too large or too small.
  if (read.ec != std::errc::result_out_of_range || is_large(token)) return std::nullopt;
  return token.front() == '-' ? -0.0 : 0.0;
}

} // namespace rowe::json
