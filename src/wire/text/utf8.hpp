// SPDX-License-Identifier: Apache-2.0
// UTF-8 validation (RFC 3629) of a text that comes in pieces. The frame parser feeds it each piece of a
// message as it arrives, on the service thread. So a bad byte ends the connection before the rest of its
// fragment has come (RFC 6455 8.1). Runs of ASCII are skipped eight bytes at a time. Everything else goes
// byte by byte through a state of three numbers: how many bytes the character still needs, and the two bounds
// of the next byte. These bounds exclude overlong forms, surrogates and values above U+10FFFF at their second
// byte.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace rowe::wire {

// One thread; never waits, never allocates; linear in the bytes given.
class utf8_check {
 public:
  // False as soon as the text so far is no beginning of valid UTF-8. Then further answers mean nothing.
  bool feed(std::span<const std::byte> piece) noexcept;

  // True if no character is incomplete, as at the end of a text.
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
