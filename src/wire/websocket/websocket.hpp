// SPDX-License-Identifier: Apache-2.0
// WebSocket frames (RFC 6455), in both roles: what they consist of, how they are written, and a first look at
// complete ones. A frame's header is written in front of a payload that is in memory already, and a client
// masks the payload itself. What a peer sends is read by frame_parser.hpp, which checks all of it. Nothing is
// checked here.
//
// Every function here: pure, any thread, never waits, never allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "wire/websocket/mask.hpp"

namespace rowe::wire {

// What we are on a connection: a server demands masked frames and sends none, a client the reverse (RFC
// 6455 5.1).
enum class role : std::uint8_t { server, client };

enum class opcode : std::uint8_t { continuation = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };

inline constexpr std::size_t control_bytes_max = 125;      // RFC 6455 5.5
inline constexpr std::size_t close_reason_bytes_max = 123; // what a close code leaves of it
inline constexpr std::size_t frame_header_bytes_max = 14;  // 2, eight of length, four of key
inline constexpr std::size_t frame_headroom_bytes = 16;    // what a slot reserves in front of a payload
static_assert(frame_headroom_bytes >= frame_header_bytes_max);

// Codes of RFC 6455 7.4.1 that rowe sends or treats differently.
namespace close_code {
inline constexpr std::uint16_t normal = 1000;
inline constexpr std::uint16_t going_away = 1001;
inline constexpr std::uint16_t protocol_error = 1002;
inline constexpr std::uint16_t unsupported_data = 1003;
inline constexpr std::uint16_t none_given = 1005; // never on the wire: the peer's close frame was empty
inline constexpr std::uint16_t invalid_text = 1007;
inline constexpr std::uint16_t policy = 1008;
inline constexpr std::uint16_t too_big = 1009;
inline constexpr std::uint16_t try_again_later = 1013;
} // namespace close_code

// True for the codes that may stand in a close frame: 1000 to 1003 and 1007 to 1014 (RFC 6455 7.4.1 and the
// IANA registry), 3000 to 4999 (7.4.2).
bool close_code_is_valid(std::uint16_t code) noexcept;

// Bytes of the header in front of a payload, by who we are (a client's frames carry a key).
constexpr std::size_t frame_header_bytes(std::uint64_t payload_bytes, role ours) noexcept {
  const std::size_t length = payload_bytes <= 125 ? 0 : payload_bytes <= 0xffff ? 2 : 8;
  return 2 + length + (ours == role::client ? sizeof(mask_key) : 0);
}

// Writes the header of an unfragmented frame and returns its size, at most frame_header_bytes_max. With a key
// the header says that the payload is masked; the caller masks it.
std::size_t write_frame_header(std::byte* out, opcode what, std::uint64_t payload_bytes,
                               std::optional<mask_key> key = std::nullopt) noexcept;

// Changes the first byte of a frame: its message goes on in the next one.
constexpr std::byte not_final(std::byte first) noexcept { return first & std::byte{0x7f}; }

// The same, ending where `payload` begins; frame_headroom_bytes in front of it must be writable. Returns
// where the frame starts.
std::byte* write_frame_header_before(std::byte* payload, opcode what, std::uint64_t payload_bytes,
                                     std::optional<mask_key> key = std::nullopt) noexcept;

// The beginning of a message, for a first look. If a complete unfragmented frame is at the front of `bytes`,
// its payload is unmasked into `into`, and cut at the end of `into`; else the result is empty.
std::string_view look_at_message(std::span<const std::byte> bytes, std::span<std::byte> into) noexcept;

// The length of the frame at the front of `bytes`; 0 if it is not complete.
std::size_t whole_frame_bytes(std::span<const std::byte> bytes) noexcept;

// The opcode in the first byte of a frame.
constexpr opcode opcode_of(std::byte first) noexcept {
  return static_cast<opcode>(std::to_integer<std::uint8_t>(first) & 0x0fU);
}
constexpr bool is_final(std::byte first) noexcept {
  return (std::to_integer<std::uint8_t>(first) & 0x80U) != 0;
}
constexpr bool is_data(opcode what) noexcept { return (static_cast<std::uint8_t>(what) & 0x08U) == 0; }

// Writes the body of a close frame, code and reason, and returns its size. A long reason is cut between
// characters. `none_given` gives an empty body.
std::size_t close_payload(std::uint16_t code, std::string_view reason,
                          std::span<std::byte, control_bytes_max> out) noexcept;

} // namespace rowe::wire
