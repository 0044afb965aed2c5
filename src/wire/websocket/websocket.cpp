// SPDX-License-Identifier: Apache-2.0
#include "wire/websocket/websocket.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "wire/websocket/frame_header.hpp"
#include "json/text/utf8.hpp"

namespace rowe::wire {

bool close_code_is_valid(std::uint16_t code) noexcept {
  return (code >= 1000 && code <= 1003) || (code >= 1007 && code <= 1014) || (code >= 3000 && code <= 4999);
}

std::size_t write_frame_header(std::byte* out, opcode what, std::uint64_t payload_bytes,
                               std::optional<mask_key> key) noexcept {
  assert(!is_control(what) || payload_bytes <= control_bytes_max);
  const std::uint64_t masked = key ? mask_bit : 0;
  std::size_t size = 2;
  out[0] = static_cast<std::byte>(final_bit | static_cast<std::uint8_t>(what));
  if (payload_bytes <= 125) {
    out[1] = static_cast<std::byte>(masked | payload_bytes);
  } else if (payload_bytes <= 0xffff) {
    out[1] = static_cast<std::byte>(masked | length_16);
    out[2] = static_cast<std::byte>(payload_bytes >> 8);
    out[3] = static_cast<std::byte>(payload_bytes & 0xff);
    size = 4;
  } else {
    out[1] = static_cast<std::byte>(masked | length_64);
    write_big_endian(out + 2, 8, payload_bytes);
    size = 10;
  }
  if (!key) return size;
  std::memcpy(out + size, key->data(), sizeof(mask_key));
  return size + sizeof(mask_key);
}

std::byte* write_frame_header_before(std::byte* payload, opcode what, std::uint64_t payload_bytes,
                                     std::optional<mask_key> key) noexcept {
  std::byte* const start = payload - frame_header_bytes(payload_bytes, key ? role::client : role::server);
  write_frame_header(start, what, payload_bytes, key);
  return start;
}

std::size_t close_payload(std::uint16_t code, std::string_view reason,
                          std::span<std::byte, control_bytes_max> out) noexcept {
  if (code == close_code::none_given) return 0;
  assert(close_code_is_valid(code));
  reason = json::utf8_prefix(reason, close_reason_bytes_max);
  write_big_endian(out.data(), 2, code);
  if (!reason.empty()) std::memcpy(out.data() + 2, reason.data(), reason.size());
  return 2 + reason.size();
}

std::size_t whole_frame_bytes(std::span<const std::byte> bytes) noexcept {
  const auto frame = extent_of(bytes);
  return frame ? frame->header + frame->payload : 0;
}

std::string_view look_at_message(std::span<const std::byte> bytes, std::span<std::byte> into) noexcept {
  constexpr auto whole = [](opcode what) {
    return static_cast<std::byte>(final_bit | static_cast<std::uint8_t>(what));
  };
  const auto frame = extent_of(bytes);
  if (!frame || (bytes[0] != whole(opcode::text) && bytes[0] != whole(opcode::binary))) return {};
  const std::size_t looked = std::min(frame->payload, into.size());
  mask_key key{};
  if ((number_of(bytes[1]) & mask_bit) != 0)
    std::memcpy(key.data(), bytes.data() + frame->header - sizeof(mask_key), sizeof(mask_key));
  (void)mask_copy(into.first(looked), bytes.subspan(frame->header, looked), key);
  return {reinterpret_cast<const char*>(into.data()), looked};
}

} // namespace rowe::wire
