// SPDX-License-Identifier: Apache-2.0
#include "wire/http/http_fields.hpp"

#include <algorithm>
#include <charconv>

namespace rowe::wire {
namespace {

constexpr bool is_letter_or_digit(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t'; }

constexpr bool is_control(char c) noexcept {
  return (static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f;
}

} // namespace

bool is_token(std::string_view text) noexcept {
  constexpr std::string_view others = "!#$%&'*+-.^_`|~";
  return !text.empty() && std::all_of(text.begin(), text.end(), [others](char c) {
    return is_letter_or_digit(c) || others.find(c) != std::string_view::npos;
  });
}

std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view next_element(std::string_view& list) noexcept {
  const std::size_t comma = list.find(',');
  const std::string_view element = list.substr(0, comma);
  list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
  return trimmed(element);
}

std::optional<std::uint64_t> to_number(std::string_view digits) noexcept {
  std::uint64_t number = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

std::string_view diagnostic_of(line_fault fault) noexcept {
  switch (fault) {
  case line_fault::none: return "";
  case line_fault::no_end: return "the request header does not end where it should";
  case line_fault::bare_line_feed: return "a header line does not end in CR LF: %";
  case line_fault::control_character: return "a header line has control characters: %";
  case line_fault::folded: return "a header line is folded: %";
  case line_fault::no_colon: return "a header line has no colon: %";
  case line_fault::bad_name: return "a header line's name is malformed: %";
  }
  return "";
}

std::optional<std::string_view> http_lines::line() noexcept {
  ++number_;
  const std::size_t end = rest_.find('\n');
  line_ = rest_.substr(0, std::min(end, rest_.size()));
  if (end == std::string_view::npos) return give_up(line_fault::no_end);
  rest_.remove_prefix(end + 1);
  if (line_.empty() || line_.back() != '\r') return give_up(line_fault::bare_line_feed);
  line_.remove_suffix(1);
  if (line_.find('\r') != std::string_view::npos) return give_up(line_fault::bare_line_feed);
  if (std::any_of(line_.begin(), line_.end(), is_control)) return give_up(line_fault::control_character);
  return line_;
}

std::optional<http_field> http_lines::next_field() noexcept {
  const auto text = line();
  if (!text) return std::nullopt;
  if (text->empty()) {
    if (!rest_.empty()) fault_ = line_fault::no_end;
    return std::nullopt;
  }
  if (is_blank(text->front())) return give_up(line_fault::folded);
  const std::size_t colon = text->find(':');
  if (colon == std::string_view::npos) return give_up(line_fault::no_colon);
  const http_field field{.name = text->substr(0, colon), .value = trimmed(text->substr(colon + 1))};
  if (!is_token(field.name)) return give_up(line_fault::bad_name);
  return field;
}

} // namespace rowe::wire
