// SPDX-License-Identifier: Apache-2.0
#include "json/writing/writer.hpp"

#include <algorithm>

#include "json/text/block.hpp"
#include "json/text/digits.hpp"
#include "json/text/utf8.hpp"

namespace rowe::json {
namespace {

// The end of the bytes that need no escape.
const char* plain_run(const char* at, const char* end) noexcept {
  for (; end - at >= 8; at += 8) {
    const std::uint64_t special = special_bytes(load_eight(at));
    if (special != 0) return at + first_byte(special);
  }
  if (at == end) return end;
  const std::uint64_t special = special_bytes(load_fewer(at, static_cast<std::size_t>(end - at)));
  return special != 0 ? at + first_byte(special) : end;
}

// The escape of `c`, a control character, a quote or a backslash.
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
  std::memcpy(scratch.data(), "\\u00", 4);
  scratch[4] = hex_digits[static_cast<std::uint8_t>(c) >> 4];
  scratch[5] = hex_digits[static_cast<std::uint8_t>(c) & 15];
  return {scratch.data(), scratch.size()};
}

// Copies `from` unless something in it must be escaped; then false. May write a word more. The last word
// overlaps the one before.
bool copy_plain(char* to, const char* from, std::size_t bytes) noexcept {
  if (bytes > block::bytes) {
    constexpr std::size_t step = block::bytes;
    for (std::size_t i = 0; i < bytes; i += step) {
      const std::size_t at = std::min(i, bytes - step);
      if (block{from + at}.has_special()) return false;
      std::memcpy(to + at, from + at, step);
    }
    return true;
  }
  if (bytes >= 8) {
    const std::size_t last = bytes - 8;
    if (block{from, from + last}.has_special()) return false;
    std::memcpy(to, from, 8);
    std::memcpy(to + last, from + last, 8);
    return true;
  }
  if (bytes == 0) return true;
  const std::uint64_t word = load_fewer(from, bytes);
  std::memcpy(to, &word, sizeof word);
  return special_bytes(word) == 0;
}

} // namespace

void writer::quoted_at_length(std::string_view utf8) noexcept {
  if (has_ample_room(utf8.size())) [[likely]] {
    char* const to = begin_quoted();
    if (copy_plain(to, utf8.data(), utf8.size())) [[likely]]
      return end_quoted(to + utf8.size());
  }
  place_comma();
  put('"');
  escaped(utf8.data(), utf8.data() + utf8.size());
  put('"');
}

void writer::escaped(const char* at, const char* end) noexcept {
  while (at != end && !overflowed_) {
    const char* const special = plain_run(at, end);
    append({at, static_cast<std::size_t>(special - at)});
    at = special;
    if (at == end) return;
    if (static_cast<std::uint8_t>(*at) < 0x80) {
      char scratch[6];
      append(escape(*at++, scratch));
      continue;
    }
    const utf8_piece piece = next_utf8(at, end);
    append(piece.valid ? std::string_view{at, piece.bytes} : std::string_view{replacement_character});
    at += piece.bytes;
  }
}

// Writes digits in place if there is enough space, else in a buffer, and copies them. So the last byte of the
// span can be used, and none behind it is touched. False if there is no text for the number.
template <class Write>
bool writer::number_with(Write write) noexcept {
  if (static_cast<std::size_t>(end_ - at_) > number_buffer_bytes) [[likely]] {
    *at_ = ',';
    char* const end = write(at_ + comma_);
    if (end == nullptr) return false;
    at_ = end;
    comma_ = true;
    return true;
  }
  char scratch[number_buffer_bytes];
  const char* const end = write(scratch);
  if (end == nullptr) return false;
  raw({scratch, static_cast<std::size_t>(end - scratch)});
  return true;
}

void writer::number(double x) noexcept {
  if (!number_with([x](char* at) { return write_double(at, x); })) not_finite();
}

void writer::number(float x) noexcept {
  if (!number_with([x](char* at) { return write_float(at, x); })) not_finite();
}

void writer::not_finite() noexcept {
  ++nonfinite_;
  null();
}

void writer::number_signed(std::int64_t x) noexcept {
  number_with([x](char* at) { return write_signed(at, x); });
}

void writer::number_unsigned(std::uint64_t x) noexcept {
  number_with([x](char* at) { return write_unsigned(at, x); });
}

} // namespace rowe::json
