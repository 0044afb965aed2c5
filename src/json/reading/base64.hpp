// SPDX-License-Identifier: Apache-2.0
// Bytes as text: base64 of RFC 4648, part 4, with padding. Pure, on any thread; never waits, never allocates.
#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

namespace rowe::json {

// The text of no more bytes is as long as a size can say.
inline constexpr std::size_t base64_bytes_max = SIZE_MAX / 4 * 3 - 2;
// How long the text of so many bytes is, base64_bytes_max at most.
constexpr std::size_t base64_text_bytes(std::size_t bytes) noexcept { return (bytes + 2) / 3 * 4; }

// Writes the text of the bytes, and returns where it ends. There must be space for all of it.
char* write_base64(char* at, const char* bytes, std::size_t count) noexcept;

// The text of a JSON string that is base64, between its quotes; escapes are understood.
class base64_text {
 public:
  explicit base64_text(std::string_view escaped) noexcept;

  // How many bytes it stands for, as its length and its padding say. Nothing: no text is so long, or padded
  // so.
  std::optional<std::size_t> bytes() const noexcept;
  // Writes that many bytes. False: some character is none of base64; then some bytes may have been written.
  bool read(char* into) const noexcept;

 private:
  std::string_view escaped_;
  bool plain_;             // it has no escapes
  std::size_t length_ = 0; // of the text
  std::size_t padding_ = 0;
};

} // namespace rowe::json
