// SPDX-License-Identifier: Apache-2.0
#include "service/message_frames.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "wire/mask.hpp"
#include "wire/websocket.hpp"

namespace rowe::service {

bool message_frames::add_shared(bool masked, std::size_t skip, batch& into,
                                const batch_piece& of) const noexcept {
  const auto payload = std::as_bytes(slots_.text(of.slot));
  const wire::role ours = masked ? wire::role::client : wire::role::server;
  const std::size_t header = wire::frame_header_bytes(payload.size(), ours);
  const std::size_t bytes = header + payload.size() - skip;
  if (!into.fits(bytes)) return false;
  if (!masked) {
    into.add({payload.data() - header + skip, bytes}, of);
    return true;
  }
  std::byte* at = into.place(bytes, of);
  if (skip < header) {
    std::array<std::byte, wire::frame_header_bytes_max> whole;
    const auto what = slots_.binary(of.slot) ? wire::opcode::binary : wire::opcode::text;
    (void)wire::write_frame_header(whole.data(), what, payload.size(), of.key); // its size is `header`
    std::memcpy(at, whole.data() + skip, header - skip);
    at += header - skip;
    skip = header;
  }
  const auto rest = payload.subspan(skip - header);
  (void)wire::mask_copy({at, rest.size()}, rest, of.key, skip - header);
  return true;
}

wire::message_head message_frames::head_of(const batch_piece& of) const noexcept {
  const subscription& to = subscription_rows_[of.subscription];
  return protocols_.of(to.codec).head_of({.tag = to.tag,
                                          .published_ns = rt::nanoseconds_of(slots_.published(of.slot)),
                                          .unslashed = to.unslashed});
}

bool message_frames::add_headed(bool masked, std::size_t skip, batch& into, const batch_piece& of,
                                const wire::message_head& head) const noexcept {
  const auto rest_of_it = head.from == 0 ? std::as_bytes(slots_.body(of.slot))
                                         : std::as_bytes(slots_.text(of.slot)).subspan(head.from);
  const std::size_t payload_bytes = head.size + rest_of_it.size();
  std::array<std::byte, wire::frame_header_bytes_max> header;
  const auto key = masked ? std::optional{of.key} : std::nullopt;
  const std::size_t header_bytes =
      wire::write_frame_header(header.data(), opcode_of(head.as), payload_bytes, key);
  const std::size_t bytes = header_bytes + payload_bytes - skip;
  if (!into.fits(bytes)) return false;
  std::byte* at = into.place(bytes, of);
  std::size_t masked_so_far = 0;
  const auto add_part = [&](std::span<const std::byte> part, bool is_payload) {
    const std::size_t passed = std::min(skip, part.size());
    skip -= passed;
    const auto rest = part.subspan(passed);
    if (is_payload && masked) {
      (void)wire::mask_copy({at, rest.size()}, rest, of.key, masked_so_far + passed);
    } else if (!rest.empty()) {
      std::memcpy(at, rest.data(), rest.size());
    }
    if (is_payload) masked_so_far += part.size();
    at += rest.size();
  };
  add_part(std::span{header}.first(header_bytes), false);
  add_part(std::span{head.bytes}.first(head.size), true);
  add_part(rest_of_it, true);
  return true;
}

} // namespace rowe::service
