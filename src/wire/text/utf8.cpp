// SPDX-License-Identifier: Apache-2.0
#include "wire/text/utf8.hpp"

#include <cstring>

namespace rowe::wire {
namespace {

constexpr std::uint64_t high_bits = 0x8080'8080'8080'8080;

std::uint64_t load_word(const std::byte* at) noexcept {
  std::uint64_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}

// The first byte of [at, end) that is not ASCII, or end.
const std::byte* skip_ascii(const std::byte* at, const std::byte* end) noexcept {
  for (; end - at >= 32; at += 32) {
    const std::uint64_t any = (load_word(at) | load_word(at + 8)) | (load_word(at + 16) | load_word(at + 24));
    if ((any & high_bits) != 0) break;
  }
  for (; end - at >= 8; at += 8) {
    if ((load_word(at) & high_bits) != 0) break;
  }
  while (at != end && std::to_integer<std::uint8_t>(*at) < 0x80) ++at;
  return at;
}

} // namespace

bool utf8_check::feed(std::span<const std::byte> piece) noexcept {
  const std::byte* at = piece.data();
  const std::byte* const end = at + piece.size();
  while (true) {
    if (missing_ == 0) at = skip_ascii(at, end);
    if (at == end) return true;
    if (!feed_byte(std::to_integer<std::uint8_t>(*at++))) return false;
  }
}

bool utf8_check::feed_byte(std::uint8_t byte) noexcept {
  if (missing_ > 0) {
    if (byte < low_ || byte > high_) return false;
    --missing_;
    low_ = 0x80;
    high_ = 0xbf;
    return true;
  }
  if (byte < 0x80) return true;
  if (byte < 0xc2 || byte > 0xf4)
    return false; // a continuation without a start, overlong, or beyond U+10FFFF
  if (byte < 0xe0) {
    missing_ = 1;
  } else if (byte < 0xf0) {
    missing_ = 2;
    if (byte == 0xe0) low_ = 0xa0;  // below: overlong
    if (byte == 0xed) high_ = 0x9f; // above: surrogates
  } else {
    missing_ = 3;
    if (byte == 0xf0) low_ = 0x90;  // below: overlong
    if (byte == 0xf4) high_ = 0x8f; // above: beyond U+10FFFF
  }
  return true;
}

} // namespace rowe::wire
