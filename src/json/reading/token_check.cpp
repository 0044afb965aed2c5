// SPDX-License-Identifier: Apache-2.0
#include "json/reading/token_check.hpp"

#include <bit>
#include <bitset>
#include <cassert>
#include <cstring>

#include "json/reading/cursor.hpp"
#include "json/reading/numbers.hpp"
#include "json/text/block.hpp"

namespace rowe::json {
namespace {

const char* skip_digits(const char* at) noexcept {
  for (;; at += block_pair::bytes) {
    const std::uint32_t others = ~block_pair{at}.digits();
    if (others != 0) [[likely]]
      return at + std::countr_zero(others);
  }
}

// The end of the number that begins at `at`; null if it is no number, or one that a double might not hold. A
// byte that ends a number must follow within the text.
const char* number_end(const char* at) noexcept {
  constexpr std::ptrdiff_t digits_max = 200, exponent_digits_max = 2; // below 10^300
  at += *at == '-';
  const char* const whole = at;
  at = skip_digits(at);
  if (at == whole || (*whole == '0' && at != whole + 1) || at - whole > digits_max) return nullptr;
  if (*at == '.') {
    const char* const fraction = ++at;
    at = skip_digits(at);
    if (at == fraction) return nullptr;
  }
  if (*at == 'e' || *at == 'E') {
    ++at;
    at += *at == '-' || *at == '+';
    const char* const exponent = at;
    at = skip_digits(at);
    if (at == exponent || at - exponent > exponent_digits_max) return nullptr;
  }
  return at;
}

bool begins_with(const char* at, std::string_view word) noexcept {
  return std::memcmp(at, word.data(), word.size()) == 0;
}

// The kind of a valid value that begins with `first`.
kind kind_of(char first) noexcept {
  switch (first) {
  case '{': return kind::object;
  case '[': return kind::array;
  case '"': return kind::string;
  case 't':
  case 'f': return kind::boolean;
  case 'n': return kind::null;
  default: return kind::number;
  }
}

class token_check {
 public:
  token_check(std::string_view text, std::span<const std::uint32_t> tokens, std::size_t depth_max,
              std::span<member> indexed, member_index& found) noexcept
      : text_{text.data()},
        at_{tokens.data()},
        end_{tokens.data() + tokens.size()},
        depth_max_{depth_max},
        indexed_{indexed},
        found_{found} {}

  // After a value that opens something comes the first thing inside it. After a complete value comes what is
  // behind it, out to the outermost level.
  bool run() noexcept {
    do {
      bool opened = false;
      if (!value(opened)) return false;
      if (!opened && !behind_value()) return false;
    } while (depth_ > 0);
    return at_ == end_;
  }

 private:
  // The first byte of the next token; 0 if there is none, because no valid token begins with 0.
  char next() const noexcept { return at_ == end_ ? '\0' : text_[*at_]; }

  bool take(char c) noexcept {
    if (next() != c) return false;
    ++at_;
    return true;
  }

  bool value(bool& opened) noexcept {
    switch (next()) {
    case '"': ++at_; return true;
    case '{': return open('}', opened);
    case '[': return open(']', opened);
    case 't': return word("true");
    case 'f': return word("false");
    case 'n': return word("null");
    default: return number();
    }
  }

  bool open(char closing, bool& opened) noexcept {
    if (depth_ == depth_max_) return false;
    ++at_;
    if (take(closing)) return true;
    in_object_ = closing == '}';
    is_object_[depth_++] = in_object_;
    opened = true;
    return !in_object_ || name();
  }

  bool name() noexcept {
    if (depth_ == 1) name_ = at_;
    return take('"') && take(':');
  }

  // Closes what ends behind a complete value; true at the next value, or when nothing is open any more.
  bool behind_value() noexcept {
    while (depth_ > 0) {
      if (depth_ == 1 && in_object_) note();
      if (take(',')) return !in_object_ || name();
      if (!take(in_object_ ? '}' : ']')) return false;
      if (--depth_ > 0) in_object_ = is_object_[depth_ - 1];
    }
    return true;
  }

  // The scalar that begins at the token ends at or before the next one, which must be there.
  bool ends(const char* scalar_end) noexcept {
    const char* const next = text_ + *++at_;
    return scalar_end == next || (scalar_end < next && is_white_space(*scalar_end));
  }
  bool word(std::string_view expected) noexcept {
    if (end_ - at_ < 2) return false;
    const char* const begin = text_ + *at_;
    return begins_with(begin, expected) && ends(begin + expected.size());
  }
  bool number() noexcept {
    if (end_ - at_ < 2) return false;
    const char* const end = number_end(text_ + *at_);
    return end != nullptr && ends(end);
  }

  // ---- members of the whole

  static const char* before_space(const char* end) noexcept {
    while (is_white_space(end[-1])) --end;
    return end;
  }

  // A member of the outermost object ends before the token at at_; its name is the last that was taken there.
  void note() noexcept {
    if (found_.count == indexed_.size() || at_ == end_) {
      found_.all = false;
      return;
    }
    const char* const name = text_ + name_[0] + 1;
    const char* const value = text_ + name_[2];
    const char* const value_end = before_space(text_ + *at_);
    indexed_[found_.count++] = {between(name, before_space(text_ + name_[1]) - 1),
                                {kind_of(*value), between(value, value_end)}};
    found_.behind = value_end;
  }

  const char* const text_;
  const std::uint32_t* at_;
  const std::uint32_t* const end_;
  const std::size_t depth_max_;
  const std::span<member> indexed_;
  member_index& found_;
  std::size_t depth_ = 0;
  bool in_object_ = false;                   // what was opened last
  const std::uint32_t* name_ = nullptr;      // of the outermost object's member
  std::bitset<fault_depth_limit> is_object_; // of each open level
};

bool is_hex(char c) noexcept { return hex_value(c) < 16; }

// \uXXXX at `at`?
bool is_code_unit(const char* at, const char* end) noexcept {
  return end - at >= 6 && at[0] == '\\' && at[1] == 'u' && is_hex(at[2]) && is_hex(at[3]) && is_hex(at[4]) &&
         is_hex(at[5]);
}

} // namespace

bool tokens_are_valid(std::string_view text, std::span<const std::uint32_t> tokens, std::size_t depth_max,
                      std::span<member> indexed, member_index& found) noexcept {
  assert(depth_max <= fault_depth_limit);
  found = {.all = true};
  return token_check{text, tokens, depth_max, indexed, found}.run();
}

bool escapes_are_valid(std::string_view text) noexcept {
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    at = static_cast<const char*>(std::memchr(at, '\\', static_cast<std::size_t>(end - at)));
    if (at == nullptr) return true;
    if (end - at < 2) return false;
    if (at[1] != 'u') {
      if (std::memchr("\"\\/bfnrt", at[1], 8) == nullptr) return false;
      at += 2;
      continue;
    }
    if (!is_code_unit(at, end)) return false;
    const std::uint32_t unit = code_unit(at + 2);
    at += 6;
    if (unit < 0xd800 || unit > 0xdfff) continue;
    if (unit > 0xdbff || !is_code_unit(at, end)) return false;
    const std::uint32_t low = code_unit(at + 2);
    if (low < 0xdc00 || low > 0xdfff) return false;
    at += 6;
  }
}

} // namespace rowe::json
