// SPDX-License-Identifier: Apache-2.0
// A recursive descent over the grammar. Each function passes over what it is named after and is false at the
// first offence, which is then noted.
#include "json_check.hpp"

#include <cstdint>

#include "../console.hpp"

namespace rowe::tools {
namespace {

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

int hexadecimal(char c) noexcept {
  if (is_digit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

class checker {
 public:
  explicit checker(std::string_view text) noexcept : text_{text} {}

  std::optional<json_fault> run() noexcept {
    spaces();
    if (next() != '{') {
      (void)wrong("it does not begin with {");
    } else if (value(1)) {
      spaces();
      if (at_ != text_.size()) (void)wrong("something follows the object");
    }
    return fault_;
  }

 private:
  // The next character; '\0' at the end, which is valid nowhere.
  char next() const noexcept { return at_ < text_.size() ? text_[at_] : '\0'; }

  bool wrong(std::string_view what) noexcept {
    fault_ = json_fault{at_, at_ < text_.size() ? what : "it ends too early"};
    return false;
  }

  bool take(char wanted, std::string_view otherwise) noexcept {
    if (next() != wanted) return wrong(otherwise);
    ++at_;
    return true;
  }

  void spaces() noexcept {
    while (next() == ' ' || next() == '\t' || next() == '\r' || next() == '\n') ++at_;
  }

  bool value(std::size_t depth) noexcept {
    if (depth > json_depth_max + 1) return wrong("it is nested more than 64 deep");
    switch (next()) {
    case '{': return list('}', depth, [&] { return member(depth); });
    case '[': return list(']', depth, [&] { return value(depth + 1); });
    case '"': return string();
    case 't': return word("true");
    case 'f': return word("false");
    case 'n': return word("null");
    default: return number();
    }
  }
  static_assert(json_depth_max == 64, "the sentence above says so");

  // An object or array: what `item` passes over, with commas between.
  template <class Item>
  bool list(char closing, std::size_t depth, Item&& item) noexcept {
    if (depth > json_depth_max) return wrong("it is nested more than 64 deep");
    ++at_;
    spaces();
    if (next() == closing) return take(closing, {});
    for (;;) {
      if (!item()) return false;
      spaces();
      if (next() == closing) return take(closing, {});
      if (!take(',', "a comma or the closing bracket is missing")) return false;
      spaces();
    }
  }

  bool member(std::size_t depth) noexcept {
    if (next() != '"') return wrong("a member's name in double quotes is missing");
    if (!string()) return false;
    spaces();
    if (!take(':', "a colon is missing")) return false;
    spaces();
    return value(depth + 1);
  }

  bool word(std::string_view wanted) noexcept {
    if (!text_.substr(at_).starts_with(wanted)) return wrong("there is no such word");
    at_ += wanted.size();
    return true;
  }

  bool digits() noexcept {
    if (!is_digit(next())) return wrong("a digit is missing");
    while (is_digit(next())) ++at_;
    return true;
  }

  bool number() noexcept {
    if (next() != '-' && !is_digit(next())) return wrong("a value is missing");
    if (next() == '-') ++at_;
    if (next() == '0') {
      ++at_;
      if (is_digit(next())) return wrong("a number begins with 0");
    } else if (!digits()) {
      return false;
    }
    if (next() == '.') {
      ++at_;
      if (!digits()) return false;
    }
    if (next() == 'e' || next() == 'E') {
      ++at_;
      if (next() == '+' || next() == '-') ++at_;
      if (!digits()) return false;
    }
    return true;
  }

  bool string() noexcept {
    ++at_;
    for (;;) {
      const auto byte = static_cast<unsigned char>(next());
      if (at_ == text_.size()) return wrong({});
      if (byte == '"') return take('"', {});
      if (byte < 0x20)
        return wrong("a control character stands in a string: write it as \\n, \\t or \\u00..");
      if (!(byte == '\\' ? escape() : byte < 0x80 ? (++at_, true) : character())) return false;
    }
  }

  bool escape() noexcept {
    ++at_;
    if (next() != 'u') {
      constexpr std::string_view letters = "\"\\/bfnrt";
      if (at_ == text_.size() || letters.find(next()) == letters.npos)
        return wrong("there is no such escape");
      ++at_;
      return true;
    }
    std::uint32_t first = 0;
    std::uint32_t second = 0;
    if (!code_unit(first)) return false;
    if (first >= 0xdc00 && first < 0xe000) return wrong("half a surrogate pair");
    if (first < 0xd800 || first >= 0xdc00) return true;
    if (!text_.substr(at_).starts_with("\\u")) return wrong("half a surrogate pair");
    ++at_;
    if (!code_unit(second)) return false;
    return (second >= 0xdc00 && second < 0xe000) || wrong("half a surrogate pair");
  }

  // "u00e4", of which the `u` is next.
  bool code_unit(std::uint32_t& unit) noexcept {
    ++at_;
    for (int i = 0; i < 4; ++i, ++at_) {
      const int digit = hexadecimal(next());
      if (digit < 0) return wrong("\\u needs four hexadecimal digits");
      unit = unit * 16 + static_cast<std::uint32_t>(digit);
    }
    return true;
  }

  // One character of two to four bytes: the shortest form, no surrogate, nothing above U+10FFFF.
  bool character() noexcept {
    const auto byte = static_cast<unsigned char>(next());
    const std::size_t more = byte >= 0xf0 ? 3 : byte >= 0xe0 ? 2 : 1;
    if (byte < 0xc2 || byte > 0xf4) return wrong("not UTF-8");
    std::uint32_t code = byte & (0x3fU >> more);
    for (std::size_t i = 1; i <= more; ++i) {
      const auto follower =
          at_ + i < text_.size() ? static_cast<unsigned char>(text_[at_ + i]) : static_cast<unsigned char>(0);
      if ((follower & 0xc0) != 0x80) return wrong("not UTF-8");
      code = code << 6 | (follower & 0x3fU);
    }
    const bool overlong = (more == 2 && code < 0x800) || (more == 3 && code < 0x10000);
    if (overlong || (code >= 0xd800 && code < 0xe000) || code > 0x10ffff) return wrong("not UTF-8");
    at_ += more + 1;
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::optional<json_fault> fault_;
};

} // namespace

std::optional<json_fault> object_fault(std::string_view text) noexcept { return checker{text}.run(); }

std::string sentence_of(const json_fault& fault) {
  return joined("is no JSON object: ", fault.what, " (at byte ", fault.at, ")");
}

} // namespace rowe::tools
