// SPDX-License-Identifier: Apache-2.0
// Default values, as ROS 2 writes them: numbers as in Python, strings in quotes or without, arrays in
// brackets. They become JSON once, and are encoded as if that had been given.
#include <charconv>
#include <cmath>
#include <limits>

#include "rosmsg/declaration.hpp"
#include "json/text/characters.hpp"
#include "json/text/digits.hpp"
#include "json/text/utf8.hpp"
#include "json/writing/writer.hpp"

namespace rowe::rosmsg {
namespace {

class default_reader {
 public:
  default_reader(std::string_view text, const member& of) : rest_{text}, of_{of} {}

  std::optional<std::string> read() {
    if (rest_.size() > default_bytes_max) return std::nullopt;
    const bool good = of_.many == form::one ? scalar("#") : array();
    skip_space();
    if (!good || !(rest_.empty() || rest_.front() == '#')) return std::nullopt;
    return json_;
  }

 private:
  void skip_space() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size())); }
  bool take(char c) {
    if (!rest_.starts_with(c)) return false;
    rest_.remove_prefix(1);
    return true;
  }

  bool array() {
    if (!take('[')) return false;
    json_ += '[';
    skip_space();
    for (bool more = !take(']'); more;) {
      if (!scalar(",]#")) return false;
      skip_space();
      more = take(',');
      if (!more && !take(']')) return false;
      if (more) json_ += ',';
      skip_space();
    }
    json_ += ']';
    return true;
  }

  // What is not in quotes ends before one of `ends`.
  bool scalar(std::string_view ends) {
    if (of_.what == kind::text || of_.what == kind::wide_text) return string(ends);
    const std::size_t end = std::min(rest_.find_first_of(ends), rest_.size());
    const std::string_view word = stripped(rest_.substr(0, end));
    rest_.remove_prefix(end);
    switch (of_.what) {
    case kind::boolean: return boolean(word);
    case kind::float32:
    case kind::float64: return real(word);
    default: return whole(word);
    }
  }

  bool boolean(std::string_view word) {
    const bool is_true = word == "true" || word == "True" || word == "1";
    if (!is_true && word != "false" && word != "False" && word != "0") return false;
    json_ += is_true ? "true" : "false";
    return true;
  }

  bool whole(std::string_view word) {
    const bool negative = word.starts_with('-');
    if (negative || word.starts_with('+')) word.remove_prefix(1);
    const std::string_view prefix = word.substr(0, 2);
    const int base = prefix == "0x" || prefix == "0X"   ? 16
                     : prefix == "0b" || prefix == "0B" ? 2
                     : prefix == "0o" || prefix == "0O" ? 8
                                                        : 10;
    if (base != 10) word.remove_prefix(2);
    std::uint64_t magnitude = 0;
    const auto end = std::from_chars(word.data(), word.data() + word.size(), magnitude, base);
    if (end.ec != std::errc{} || end.ptr != word.data() + word.size()) return false;
    json_ += (negative ? "-" : "") + std::to_string(magnitude);
    return true;
  }

  bool real(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    double x = 0;
    const auto end = std::from_chars(word.data(), word.data() + word.size(), x);
    if (end.ec != std::errc{} || end.ptr != word.data() + word.size()) return false;
    if (std::isinf(x)) {
      json_ += x < 0 ? "-1e999" : "1e999"; // is taken for infinity, in defaults alone
      return true;
    }
    char digits[json::number_buffer_bytes];
    const char* const last = json::write_double(digits, x);
    json_ += last == nullptr ? std::string_view{"null"} : std::string_view{digits, last};
    return true;
  }

  bool string(std::string_view ends) {
    const char quote = rest_.empty() ? '\0' : rest_.front();
    if (quote != '"' && quote != '\'') {
      const std::size_t end = std::min(rest_.find_first_of(ends), rest_.size());
      const std::string_view word = stripped(rest_.substr(0, end));
      rest_.remove_prefix(end);
      return !word.empty() && add(word);
    }
    rest_.remove_prefix(1);
    std::string text;
    while (!rest_.empty() && rest_.front() != quote) {
      if (rest_.front() != '\\') {
        text += rest_.front();
        rest_.remove_prefix(1);
      } else if (!escape(text)) {
        return false;
      }
    }
    return take(quote) && add(text);
  }

  bool escape(std::string& text) {
    if (rest_.size() < 2) return false;
    const char c = rest_[1];
    rest_.remove_prefix(2);
    constexpr std::string_view names = "abfnrtv";
    constexpr std::string_view characters = "\a\b\f\n\r\t\v";
    if (const std::size_t at = names.find(c); at != names.npos) {
      text += characters[at];
      return true;
    }
    const std::size_t digits = c == 'x' ? 2 : c == 'u' ? 4 : c == 'U' ? 8 : 0;
    if (digits == 0) {
      text += c;
      return true;
    }
    std::uint32_t code = 0;
    const char* const last = rest_.data() + std::min(digits, rest_.size());
    const auto end = std::from_chars(rest_.data(), last, code, 16);
    const bool is_character = code <= 0x10ffff && (code < 0xd800 || code > 0xdfff);
    if (end.ptr != rest_.data() + digits || !is_character) return false;
    rest_.remove_prefix(digits);
    char utf8[4];
    text.append(utf8, json::write_utf8(utf8, code));
    return true;
  }

  bool add(std::string_view text) {
    std::string quoted(6 * text.size() + 16, '\0');
    json::writer to{quoted};
    to.string(text);
    json_ += to.text();
    return true;
  }

  std::string_view rest_;
  const member& of_;
  std::string json_;
};

} // namespace

std::optional<std::string> json_of_default(std::string_view text, const member& of) {
  return default_reader{text, of}.read();
}

} // namespace rowe::rosmsg
