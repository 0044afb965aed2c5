// SPDX-License-Identifier: Apache-2.0
#include "writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "bytes.hpp"
#include "digits.hpp"
#include "utf8.hpp"

namespace rowe::json {
namespace {

// The end of the bytes that are written as they are: ASCII but for control characters, quotes and
// backslashes.
const char* plain_run(const char* at, const char* end) noexcept {
  for (; end - at >= 8; at += 8) {
    const std::uint64_t word = load_eight(at);
    const std::uint64_t special =
        bytes_below(word, 0x20) | bytes_equal(word, '"') | bytes_equal(word, '\\') | (word & high_bits);
    if (special != 0) return at + first_byte(special);
  }
  return std::find_if(at, end, [](char c) {
    const auto byte = static_cast<std::uint8_t>(c);
    return byte < 0x20 || byte >= 0x80 || c == '"' || c == '\\';
  });
}

// What stands for `c`, a control character, a quote or a backslash.
std::string_view escape(char c, std::span<char, 6> scratch) noexcept {
  switch (c) {
  case '"': return "\\\"";
  case '\\': return "\\\\";
  case '\b': return "\\b";
  case '\f': return "\\f";
  case '\n': return "\\n";
  case '\r': return "\\r";
  case '\t': return "\\t";
  default: break;
  }
  constexpr std::string_view hex = "0123456789abcdef";
  std::memcpy(scratch.data(), "\\u00", 4);
  scratch[4] = hex[static_cast<std::uint8_t>(c) >> 4];
  scratch[5] = hex[static_cast<std::uint8_t>(c) & 15];
  return {scratch.data(), scratch.size()};
}

} // namespace

void writer::quoted(std::string_view utf8) noexcept {
  put('"');
  const char* at = utf8.data();
  const char* const end = at + utf8.size();
  while (at != end && !overflowed_) {
    const char* const special = plain_run(at, end);
    append({at, static_cast<std::size_t>(special - at)});
    at = special;
    if (at == end) break;
    if (static_cast<std::uint8_t>(*at) < 0x80) {
      char scratch[6];
      append(escape(*at++, scratch));
      continue;
    }
    const utf8_piece piece = next_utf8(at, end);
    append(piece.valid ? std::string_view{at, piece.bytes} : std::string_view{replacement_character});
    invalid_utf8_ += !piece.valid;
    at += piece.bytes;
  }
  put('"');
}

void writer::key(std::string_view name) noexcept {
  place_comma();
  quoted(name);
  put(':');
  comma_ = false;
}

void writer::string(std::string_view utf8) noexcept {
  place_comma();
  quoted(utf8);
  comma_ = true;
}

// Digits are written in place where the room is ample, else beside it and copied, so that the last byte of
// the room can be used and none behind it is touched.
template <class Write>
void writer::number_with(Write write) noexcept {
  if (static_cast<std::size_t>(end_ - at_) > number_room_bytes) {
    *at_ = ',';
    at_ = write(at_ + comma_);
    comma_ = true;
    return;
  }
  char scratch[number_room_bytes];
  raw({scratch, static_cast<std::size_t>(write(scratch) - scratch)});
}

void writer::number(double x) noexcept {
  if (!std::isfinite(x)) {
    ++nonfinite_;
    return null();
  }
  number_with([x](char* at) { return write_double(at, x); });
}

void writer::number(float x) noexcept {
  if (!std::isfinite(x)) {
    ++nonfinite_;
    return null();
  }
  number_with([x](char* at) { return write_float(at, x); });
}

void writer::number_signed(std::int64_t x) noexcept {
  number_with([x](char* at) { return write_signed(at, x); });
}

void writer::number_unsigned(std::uint64_t x) noexcept {
  number_with([x](char* at) { return write_unsigned(at, x); });
}

} // namespace rowe::json
