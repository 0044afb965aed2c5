// SPDX-License-Identifier: Apache-2.0
// Sixteen bytes of text at once, in a vector register if the machine has one (SSE2 is part of every x86-64,
// NEON of every arm64). Each answer is a mask with one bit for each byte; the first byte has the lowest bit.
#pragma once
#include <cstdint>
#include <cstring>

#include <rowe/rt/attributes.hpp>

#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace rowe::json {

class block {
 public:
  static constexpr int bytes = 16;

#if defined(__SSE2__)
  ROWE_RT explicit block(const char* at) noexcept { std::memcpy(&text_, at, bytes); }
  // Eight bytes from each.
  ROWE_RT block(const char* low, const char* high) noexcept {
    std::int64_t words[2];
    std::memcpy(&words[0], low, 8);
    std::memcpy(&words[1], high, 8);
    text_ = _mm_unpacklo_epi64(_mm_cvtsi64_si128(words[0]), _mm_cvtsi64_si128(words[1]));
  }

  ROWE_RT std::uint32_t equal(char c) const noexcept { return mask(_mm_cmpeq_epi8(text_, _mm_set1_epi8(c))); }
  // Not above `c`, as unsigned.
  ROWE_RT std::uint32_t at_most(char c) const noexcept {
    return mask(_mm_cmpeq_epi8(_mm_min_epu8(text_, _mm_set1_epi8(c)), text_));
  }
  // Equal except for bit 5, in which '[' differs from '{' and ']' from '}'. `c` has that bit.
  ROWE_RT std::uint32_t equal_but_for_bit_5(char c) const noexcept {
    return mask(_mm_cmpeq_epi8(_mm_or_si128(text_, _mm_set1_epi8(0x20)), _mm_set1_epi8(c)));
  }
  // Whether there is a byte that a JSON string must escape (a control character, a quote or a backslash), or
  // a byte that is not ASCII.
  ROWE_RT bool has_special() const noexcept {
    const __m128i control = _mm_cmpeq_epi8(_mm_min_epu8(text_, _mm_set1_epi8(0x1f)), text_);
    const __m128i quote = _mm_cmpeq_epi8(text_, _mm_set1_epi8('"'));
    const __m128i backslash = _mm_cmpeq_epi8(text_, _mm_set1_epi8('\\'));
    return mask(_mm_or_si128(_mm_or_si128(text_, control), _mm_or_si128(quote, backslash))) != 0;
  }
  ROWE_RT std::uint32_t digits() const noexcept {
    const __m128i values = _mm_sub_epi8(text_, _mm_set1_epi8('0'));
    return mask(_mm_cmpeq_epi8(_mm_min_epu8(values, _mm_set1_epi8(9)), values));
  }

 private:
  static std::uint32_t mask(__m128i bytes_of_ones) noexcept {
    return static_cast<std::uint32_t>(_mm_movemask_epi8(bytes_of_ones));
  }
  __m128i text_;
#elif defined(__aarch64__)
  ROWE_RT explicit block(const char* at) noexcept
      : text_{vld1q_u8(reinterpret_cast<const std::uint8_t*>(at))} {}
  ROWE_RT block(const char* low, const char* high) noexcept
      : text_{vcombine_u8(vld1_u8(reinterpret_cast<const std::uint8_t*>(low)),
                          vld1_u8(reinterpret_cast<const std::uint8_t*>(high)))} {}

  ROWE_RT std::uint32_t equal(char c) const noexcept { return mask(vceqq_u8(text_, all(c))); }
  ROWE_RT std::uint32_t at_most(char c) const noexcept { return mask(vcleq_u8(text_, all(c))); }
  ROWE_RT std::uint32_t equal_but_for_bit_5(char c) const noexcept {
    return mask(vceqq_u8(vorrq_u8(text_, vdupq_n_u8(0x20)), all(c)));
  }
  ROWE_RT bool has_special() const noexcept {
    const uint8x16_t control = vcltq_u8(text_, vdupq_n_u8(0x20));
    const uint8x16_t not_ascii = vcgeq_u8(text_, vdupq_n_u8(0x80));
    const uint8x16_t escaped = vorrq_u8(vceqq_u8(text_, all('"')), vceqq_u8(text_, all('\\')));
    return vmaxvq_u8(vorrq_u8(vorrq_u8(control, not_ascii), escaped)) != 0;
  }
  ROWE_RT std::uint32_t digits() const noexcept {
    return mask(vcleq_u8(vsubq_u8(text_, all('0')), vdupq_n_u8(9)));
  }

 private:
  static uint8x16_t all(char c) noexcept { return vdupq_n_u8(static_cast<std::uint8_t>(c)); }
  // Each byte keeps the bit of its position in its half; then each half is summed up.
  static std::uint32_t mask(uint8x16_t bytes_of_ones) noexcept {
    const uint8x8_t places = vcreate_u8(0x8040'2010'0804'0201);
    const uint8x16_t bits = vandq_u8(bytes_of_ones, vcombine_u8(places, places));
    return vaddv_u8(vget_low_u8(bits)) | std::uint32_t{vaddv_u8(vget_high_u8(bits))} << 8;
  }
  uint8x16_t text_;
#else
  ROWE_RT explicit block(const char* at) noexcept { std::memcpy(text_, at, bytes); }
  ROWE_RT block(const char* low, const char* high) noexcept {
    std::memcpy(text_, low, 8);
    std::memcpy(text_ + 8, high, 8);
  }

  ROWE_RT std::uint32_t equal(char c) const noexcept {
    return mask([c](char byte) { return byte == c; });
  }
  ROWE_RT std::uint32_t at_most(char c) const noexcept {
    return mask([c](char byte) { return static_cast<std::uint8_t>(byte) <= static_cast<std::uint8_t>(c); });
  }
  ROWE_RT std::uint32_t equal_but_for_bit_5(char c) const noexcept {
    return mask([c](char byte) { return (byte | 0x20) == c; });
  }
  ROWE_RT bool has_special() const noexcept {
    return mask([](char byte) {
             return static_cast<std::uint8_t>(byte) < 0x20 || static_cast<std::uint8_t>(byte) >= 0x80 ||
                    byte == '"' || byte == '\\';
           }) != 0;
  }
  ROWE_RT std::uint32_t digits() const noexcept {
    return mask([](char byte) { return byte >= '0' && byte <= '9'; });
  }

 private:
  template <class Predicate>
  std::uint32_t mask(Predicate holds) const noexcept {
    std::uint32_t bits = 0;
    for (int i = 0; i < bytes; ++i) bits |= static_cast<std::uint32_t>(holds(text_[i])) << i;
    return bits;
  }
  char text_[bytes];
#endif
};

// Two blocks in a row. A walk over longer text takes them in one step.
class block_pair {
 public:
  static constexpr int bytes = 2 * block::bytes;

  ROWE_RT explicit block_pair(const char* at) noexcept : low_{at}, high_{at + block::bytes} {}

  ROWE_RT std::uint32_t equal(char c) const noexcept { return both(low_.equal(c), high_.equal(c)); }
  ROWE_RT std::uint32_t equal_but_for_bit_5(char c) const noexcept {
    return both(low_.equal_but_for_bit_5(c), high_.equal_but_for_bit_5(c));
  }
  ROWE_RT std::uint32_t digits() const noexcept { return both(low_.digits(), high_.digits()); }

 private:
  static constexpr std::uint32_t both(std::uint32_t low, std::uint32_t high) noexcept {
    return low | high << block::bytes;
  }
  block low_, high_;
};

// Bit i of the answer: is the number of ones among bits 0 to i of `mask` odd? For a mask of quotes it says
// whether the byte is inside a string, with the opening quote.
ROWE_RT constexpr std::uint32_t odd_so_far(std::uint32_t mask) noexcept {
  mask ^= mask << 1;
  mask ^= mask << 2;
  mask ^= mask << 4;
  mask ^= mask << 8;
  return mask ^ mask << 16;
}

} // namespace rowe::json
