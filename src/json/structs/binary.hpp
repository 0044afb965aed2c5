// SPDX-License-Identifier: Apache-2.0
// What the compiler and the interpreter of binary encodings share: texts, and the heads of arrays. For the
// encoder's files only.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "json/structs/encoder_program.hpp"
#include "json/text/utf8.hpp"
#include "json/writing/cbor.hpp"

namespace rowe::json {

// An integer's digits with their head, at most.
inline constexpr std::size_t binary_scalar_bytes_max = 4 + integer_text_bytes_max;
// A text: its head, and U+FFFD for each byte.
constexpr std::size_t binary_text_bytes_max(std::size_t bytes) noexcept {
  return 3 * bytes + cbor::head_bytes_max;
}

inline char* store_length(char* at, std::size_t n) noexcept {
  const auto bytes = static_cast<std::uint32_t>(n);
  std::memcpy(at, &bytes, sizeof bytes);
  return at + sizeof bytes;
}

inline char* write_text_head(encoding into, char* at, std::size_t bytes) noexcept {
  return into == encoding::cbor ? cbor::write_head(at, cbor::major::text, bytes) : store_length(at, bytes);
}

// Calls `take(bytes, valid)` with each piece of the text.
template <class Take>
void for_each_piece(std::string_view text, Take take) noexcept {
  const char* at = text.data();
  for (const char* const end = at + text.size(); at != end;) {
    const utf8_piece piece = next_utf8(at, end);
    take(std::string_view{at, piece.bytes}, piece.valid);
    at += piece.bytes;
  }
}

inline constexpr std::string_view replacement{replacement_character, 3};

// How long the text is with U+FFFD in place of each piece that is no UTF-8.
inline std::size_t utf8_bytes(std::string_view text) noexcept {
  const auto is_ascii = [](char c) { return static_cast<std::uint8_t>(c) < 0x80; };
  if (std::all_of(text.begin(), text.end(), is_ascii)) [[likely]]
    return text.size();
  std::size_t bytes = 0;
  for_each_piece(
      text, [&](std::string_view piece, bool valid) { bytes += valid ? piece.size() : replacement.size(); });
  return bytes;
}

// Writes a text whose utf8_bytes() fit, and its head.
inline char* write_text(encoding into, char* at, std::string_view text, std::size_t bytes) noexcept {
  at = write_text_head(into, at, bytes);
  if (bytes == text.size()) return std::copy(text.begin(), text.end(), at); // else a piece would be longer
  for_each_piece(text, [&](std::string_view piece, bool valid) {
    if (!valid) piece = replacement;
    at = std::copy(piece.begin(), piece.end(), at);
  });
  return at;
}
inline char* write_text(encoding into, char* at, std::string_view text) noexcept {
  return write_text(into, at, text, utf8_bytes(text));
}

// Bytes of a number whose arrays are copied as they lie in memory; 0: of any other.
constexpr std::size_t copied_bytes(operation element) noexcept {
  switch (element) {
  case operation::int8:
  case operation::uint8: return 1;
  case operation::int16:
  case operation::uint16: return 2;
  case operation::int32:
  case operation::uint32:
  case operation::float32: return 4;
  case operation::int64:
  case operation::uint64:
  case operation::float64: return 8;
  default: return 0;
  }
}

// The tag of a typed array, little-endian (RFC 8746); 0: none.
constexpr std::uint8_t tag_of_array(operation element) noexcept {
  switch (element) {
  case operation::uint16: return 69;
  case operation::uint32: return 70;
  case operation::uint64: return 71;
  case operation::int8: return 72;
  case operation::int16: return 77;
  case operation::int32: return 78;
  case operation::int64: return 79;
  case operation::float32: return 85;
  case operation::float64: return 86;
  default: return 0;
  }
}

// The head of an array in CBOR, up to its elements.
inline char* write_array_head(char* at, operation element, std::size_t count) noexcept {
  const std::size_t each = copied_bytes(element);
  if (each == 0) return cbor::write_head(at, cbor::major::array, count);
  if (const std::uint8_t tag = tag_of_array(element); tag != 0)
    at = cbor::write_head(at, cbor::major::tag, tag);
  return cbor::write_head(at, cbor::major::bytes, count * each);
}

} // namespace rowe::json
