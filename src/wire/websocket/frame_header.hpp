// SPDX-License-Identifier: Apache-2.0
// The bits and lengths of a frame's header (RFC 6455 5.2). Only websocket.cpp, which writes frames, and
// frame_parser.cpp, which reads them, need these; what others may know of a frame is in websocket.hpp.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "wire/websocket/mask.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::wire {

inline constexpr std::uint8_t final_bit = 0x80;
inline constexpr std::uint8_t reserved_bits = 0x70;
inline constexpr std::uint8_t opcode_bits = 0x0f;
inline constexpr std::uint8_t control_bit = 0x08; // of an opcode
inline constexpr std::uint8_t mask_bit = 0x80;
inline constexpr std::uint8_t length_bits = 0x7f;
inline constexpr std::uint8_t length_16 = 126; // two bytes of length follow
inline constexpr std::uint8_t length_64 = 127; // eight

constexpr std::uint8_t number_of(std::byte b) noexcept { return std::to_integer<std::uint8_t>(b); }

constexpr bool is_control(opcode what) noexcept {
  return (static_cast<std::uint8_t>(what) & control_bit) != 0;
}

inline std::uint64_t read_big_endian(const std::byte* at, std::size_t count) noexcept {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < count; ++i) number = number << 8 | number_of(at[i]);
  return number;
}

inline void write_big_endian(std::byte* at, std::size_t count, std::uint64_t number) noexcept {
  for (std::size_t i = count; i-- > 0; number >>= 8) at[i] = static_cast<std::byte>(number & 0xff);
}

// Bytes of the length that follows a header's second byte.
constexpr std::size_t length_bytes(std::byte second) noexcept {
  const std::uint8_t length = number_of(second) & length_bits;
  return length == length_16 ? 2 : length == length_64 ? 8 : 0;
}

// Bytes of a header, by its second byte.
constexpr std::size_t header_bytes(std::byte second) noexcept {
  return 2 + length_bytes(second) + ((number_of(second) & mask_bit) != 0 ? sizeof(mask_key) : 0);
}

struct frame_extent {
  std::size_t header; // bytes
  std::size_t payload;
};
// The extent of the frame at the front of `bytes`; nothing if the frame is not complete.
inline std::optional<frame_extent> extent_of(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < 2) return std::nullopt;
  const std::size_t header = header_bytes(bytes[1]);
  const std::size_t count = length_bytes(bytes[1]);
  if (bytes.size() < header) return std::nullopt;
  const std::uint64_t length =
      count == 0 ? number_of(bytes[1]) & length_bits : read_big_endian(bytes.data() + 2, count);
  if (length > bytes.size() - header) return std::nullopt;
  return frame_extent{header, static_cast<std::size_t>(length)};
}

} // namespace rowe::wire
