// SPDX-License-Identifier: Apache-2.0
// UTF-8 validation (RFC 3629) of a text that comes in pieces. The frame parser feeds it each piece of a
// message as it arrives, on the service thread, so that a bad byte ends the connection before the rest of its
// fragment has come (RFC 6455 8.1). Runs of ASCII are skipped eight bytes at a time; everything else goes
// byte by byte through a state of three numbers: how many bytes the character still needs and between which
// bounds the next one must lie. The bounds are what rules out overlong forms, surrogates and values above
// U+10FFFF at their second byte.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace rowe::wire {

// One thread; never waits, never allocates; linear in the bytes given.
class utf8_check {
 public:
  // False as soon as the text so far cannot be the beginning of valid UTF-8; then the rest means nothing.
  bool feed(std::span<const std::byte> piece) noexcept;

  // True when no character is half there: what the end of a text demands.
  bool complete() const noexcept { return missing_ == 0; }

 private:
  bool feed_byte(std::uint8_t byte) noexcept;

  std::uint8_t missing_ = 0; // continuation bytes that the character still needs
  std::uint8_t low_ = 0x80;  // bounds of the next of them
  std::uint8_t high_ = 0xbf;
};

// A whole text at once.
inline bool is_utf8(std::span<const std::byte> text) noexcept {
  utf8_check check;
  return check.feed(text) && check.complete();
}

} // namespace rowe::wire
