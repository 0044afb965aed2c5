// SPDX-License-Identifier: Apache-2.0
// Takes the text of an HTTP/1.1 header apart, strictly by RFC 9112: every line ends in CR LF, a name is a
// token with its colon right behind it, nothing is folded, there are no control characters. Anything else is
// a fault, reported with its line, and never repaired: requests can be smuggled past two parsers that repair
// differently. The handshake filter uses it, and so do clients for the answers that they get. Pure, never
// waits, never allocates.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include "wire/text/ascii.hpp"

namespace rowe::wire {

// Whether the text is a token (RFC 9110 5.6.2), as names, methods and subprotocols must be.
bool is_token(std::string_view text) noexcept;

// The text without the spaces and tabs around it.
std::string_view trimmed(std::string_view text) noexcept;

// The next element of a comma-separated list, trimmed; removes it from `list`. Elements may be empty.
std::string_view next_element(std::string_view& list) noexcept;

// A decimal number without sign, as ports and lengths are written.
std::optional<std::uint64_t> to_number(std::string_view digits) noexcept;

enum class line_fault : std::uint8_t {
  none,
  no_end,         // the text ends before the empty line, or goes on behind it
  bare_line_feed, // or a carriage return that ends no line
  control_character,
  folded, // begins with white space
  no_colon,
  bad_name, // not a token, or white space before the colon
};
std::string_view diagnostic_of(line_fault fault) noexcept;

struct http_field {
  std::string_view name;
  std::string_view value; // trimmed
};

// Walks a header: first the request line, then the fields until there are no more.
class http_lines {
 public:
  explicit http_lines(std::string_view header) noexcept : rest_{header} {}

  // The request line without its end.
  std::optional<std::string_view> request_line() noexcept { return line(); }
  // Nothing at the empty line, or on a fault.
  std::optional<http_field> next_field() noexcept;

  line_fault fault() const noexcept { return fault_; }
  unsigned last_line_number() const noexcept { return number_; } // that of the request is 1

 private:
  std::optional<std::string_view> line() noexcept;
  std::nullopt_t give_up(line_fault fault) noexcept {
    fault_ = fault;
    return std::nullopt;
  }

  std::string_view rest_;
  std::string_view line_;
  unsigned number_ = 0;
  line_fault fault_ = line_fault::none;
};

} // namespace rowe::wire
