// SPDX-License-Identifier: Apache-2.0
#include "json/reading/base64.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "json/reading/reader.hpp"
#include "json/text/bytes.hpp"

namespace rowe::json {
namespace {

constexpr std::array<char, 65> alphabet{"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"};
constexpr char padding = '=';
constexpr std::uint32_t none = 0xff00'0000; // beyond the bits of four digits

std::uint32_t byte_of(char c) noexcept { return static_cast<std::uint8_t>(c); }

// A digit's value by its character, at the place that it has among four.
constexpr auto values_at(unsigned shift) noexcept {
  std::array<std::uint32_t, 256> all{};
  all.fill(none);
  for (std::size_t i = 0; i < 64; ++i)
    all[static_cast<std::uint8_t>(alphabet[i])] = static_cast<std::uint32_t>(i) << shift;
  return all;
}
constexpr std::array digit_values{values_at(18), values_at(12), values_at(6), values_at(0)};

// The 24 bits of four digits; more bits: one of them is no digit.
std::uint32_t bits_of(const char* four) noexcept {
  return digit_values[0][byte_of(four[0])] | digit_values[1][byte_of(four[1])] |
         digit_values[2][byte_of(four[2])] | digit_values[3][byte_of(four[3])];
}

char* store_bits(char* into, std::uint32_t bits, std::size_t bytes) noexcept {
  for (std::size_t i = 0; i < bytes; ++i) *into++ = static_cast<char>(bits >> (16 - 8 * i));
  return into;
}

// Four digits at a time; text.size() is a multiple of four. Null: one of them is none.
char* read_digits(std::string_view text, char* into) noexcept {
  const char* at = text.data();
  std::uint32_t all = 0;
  for (const char* const end = at + text.size(); at != end; at += 4) {
    const std::uint32_t bits = bits_of(at);
    all |= bits;
    into = store_bits(into, bits, 3);
  }
  return all < none ? into : nullptr;
}

// Calls `take(piece)` with the text without escapes, in pieces; stops when that is false.
template <class Take>
bool each_piece(std::string_view escaped, const Take& take) noexcept {
  std::array<char, 64> scratch;
  while (!escaped.empty()) {
    const std::size_t before = escaped.size();
    const std::string_view piece = unescape_some(escaped, scratch);
    if (escaped.size() == before || !take(piece)) return false; // a text that was not validated may not go on
  }
  return true;
}

} // namespace

char* write_base64(char* at, const char* bytes, std::size_t count) noexcept {
  const auto write = [&at](std::uint32_t bits) {
    at[0] = alphabet[bits >> 18];
    at[1] = alphabet[bits >> 12 & 63];
    at[2] = alphabet[bits >> 6 & 63];
    at[3] = alphabet[bits & 63];
    at += 4;
  };
  // Six bytes of eight that may be read, and one store for their digits.
  for (; count >= 8; count -= 6, bytes += 6, at += 8) {
    const std::uint64_t bits = __builtin_bswap64(load_eight(bytes));
    std::uint64_t text = 0;
    for (unsigned i = 0; i < 8; ++i)
      text |= std::uint64_t{static_cast<std::uint8_t>(alphabet[bits >> (58 - 6 * i) & 63])} << 8 * i;
    std::memcpy(at, &text, sizeof text);
  }
  for (; count >= 3; count -= 3, bytes += 3)
    write(byte_of(bytes[0]) << 16 | byte_of(bytes[1]) << 8 | byte_of(bytes[2]));
  if (count == 0) return at;
  write(byte_of(bytes[0]) << 16 | (count == 2 ? byte_of(bytes[1]) << 8 : 0));
  at[-1] = padding;
  if (count == 1) at[-2] = padding;
  return at;
}

base64_text::base64_text(std::string_view escaped) noexcept
    : escaped_{escaped}, plain_{escaped.find('\\') == std::string_view::npos} {
  const auto take = [this](std::string_view piece) {
    length_ += piece.size();
    const std::size_t last = piece.find_last_not_of(padding);
    padding_ = last == std::string_view::npos ? padding_ + piece.size() : piece.size() - last - 1;
    return true;
  };
  plain_ ? (void)take(escaped) : (void)each_piece(escaped, take);
}

std::optional<std::size_t> base64_text::bytes() const noexcept {
  if (length_ % 4 != 0 || padding_ > 2) return std::nullopt;
  return length_ / 4 * 3 - padding_;
}

bool base64_text::read(char* into) const noexcept {
  const std::size_t count = length_ - padding_;
  std::array<char, 4> last{'A', 'A', 'A', 'A'}; // the digits behind the last four
  if (plain_) {
    const std::size_t whole = count / 4 * 4;
    into = read_digits(escaped_.substr(0, whole), into);
    escaped_.copy(last.data(), count - whole, whole);
  } else {
    std::size_t held = 0;
    std::size_t left = count;
    const bool read = each_piece(escaped_, [&](std::string_view piece) {
      for (const char c : piece.substr(0, std::min(left, piece.size()))) {
        last[held++] = c;
        --left;
        if (held != last.size()) continue;
        into = read_digits({last.data(), held}, into);
        last.fill('A');
        held = 0;
        if (into == nullptr) return false;
      }
      return true;
    });
    if (!read) return false;
  }
  if (into == nullptr) return false;
  const std::uint32_t bits = bits_of(last.data());
  store_bits(into, bits, count % 4 * 3 / 4);
  return bits < none;
}

} // namespace rowe::json
