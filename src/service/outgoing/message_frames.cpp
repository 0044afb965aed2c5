// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/message_frames.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstring>
#include <optional>
#include <string_view>

#include "wire/websocket/mask.hpp"
#include "wire/websocket/websocket.hpp"
#include "json/text/utf8.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

constexpr std::size_t utf8_bytes_max = 4; // of a character

// Whether a JSON object, which begins with its brace, has no members.
bool has_no_members(std::span<const char> object) noexcept {
  const std::string_view inside = std::string_view{object.data(), object.size()}.substr(1);
  const std::size_t first = inside.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && inside[first] == '}';
}

} // namespace

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

// ---- messages in several frames

// How many bytes its payload has, with the head of its own or without.
std::size_t message_frames::payload_bytes(const partial_frame& of) const noexcept {
  const bool chunked = slots_.chunked(of.slot);
  const std::size_t text = slots_.text(of.slot).size();
  const std::size_t body = chunked ? state_.chunks.bytes(slots_.chunks(of.slot)) : 0;
  if (!of.own_head) return text + body;
  if (of.head.from != 0) return of.head.size + text - of.head.from + body;
  return of.head.size + (chunked ? body : slots_.body(of.slot).size());
}

partial_frame message_frames::begun(const batch_piece& piece, std::size_t whole_bytes_max) const noexcept {
  partial_frame made{.slot = piece.slot, .own_head = piece.own_head, .from = piece.from};
  if (made.own_head) made.head = head_of(piece);
  const std::size_t bytes = payload_bytes(made);
  const bool chunked = slots_.chunked(made.slot);
  const bool binary = made.own_head ? made.head.as == wire::message_kind::binary : slots_.binary(made.slot);
  if (bytes > whole_bytes_max && !binary) {
    // Each may begin up to three bytes before its multiple, so that it does not begin within a character.
    const std::size_t stride = std::min(whole_bytes_max, text_fragment_bytes_max) - (utf8_bytes_max - 1);
    made.goes = partial_frame::way::texts;
    made.stride = static_cast<std::uint32_t>(stride);
    made.count = static_cast<std::uint32_t>((bytes + stride - 1) / stride);
    made.payload = static_cast<std::uint32_t>(bytes);
  } else if (chunked) {
    made.goes = partial_frame::way::continued;
    made.payload = static_cast<std::uint32_t>(bytes);
  }
  return made;
}

// A fragment is written anew each time that some of it is needed: it depends only on the message and its
// number.
bool message_frames::add_text(bool masked, partial_frame& of, batch& into,
                              const batch_piece& piece) const noexcept {
  const std::size_t end = std::min<std::size_t>((of.number + std::size_t{1}) * of.stride, of.payload);
  std::array<std::byte, text_fragment_bytes_max + 1> buffer;
  const auto plain = std::span{buffer}.first(std::min<std::size_t>(end + 1, of.payload) -
                                             of.done); // and whether a character ends there
  copy_payload(of, of.done, plain);
  std::string_view data{reinterpret_cast<const char*>(plain.data()), plain.size()};
  data = ROWE_MUTANT(fragments_cut) ? data.substr(0, end - of.done) : json::utf8_prefix(data, end - of.done);

  std::array<char, 24> id;
  const slot_ref slot = slots_.ref(of.slot);
  const auto part = std::to_chars(id.data(), id.data() + id.size(), slot.index.value).ptr;
  *part = '.';
  const auto id_end = std::to_chars(part + 1, id.data() + id.size(), slot.generation).ptr;
  const std::span<std::byte> room = into.room();
  if (room.size() <= wire::frame_headroom_bytes) return false;
  const auto payload = room.subspan(wire::frame_headroom_bytes);
  json::writer out{{reinterpret_cast<char*>(payload.data()), payload.size()}};
  state_.seams.protocols.envelope.write_fragment(
      out, {.id = {id.data(), static_cast<std::size_t>(id_end - id.data())},
            .data = data,
            .number = of.number,
            .count = of.count});
  if (out.overflowed()) {
    assert(into.count != 0); // a batch has room for one
    return false;
  }
  const auto key = masked ? std::optional{piece.key} : std::nullopt;
  const std::byte* const begin =
      wire::write_frame_header_before(payload.data(), wire::opcode::text, out.bytes(), key);
  if (masked) (void)wire::mask(payload.first(out.bytes()), piece.key);
  const auto left = static_cast<std::size_t>(payload.data() + out.bytes() - begin) - of.written;
  batch_piece as = piece;
  as.fragment = static_cast<std::uint16_t>(data.size());
  std::memmove(into.place(left, as), begin + of.written, left);
  return true;
}

bool message_frames::add_fragment(bool masked, partial_frame& of, batch& into,
                                  const batch_piece& piece) const noexcept {
  if (of.goes == partial_frame::way::texts) return add_text(masked, of, into, piece);
  const auto bytes =
      of.fragment != 0
          ? of.fragment
          : static_cast<std::uint16_t>(std::min<std::size_t>(long_fragment_bytes, of.payload - of.done));
  const auto what = of.done != 0             ? wire::opcode::continuation
                    : of.own_head            ? opcode_of(of.head.as)
                    : slots_.binary(of.slot) ? wire::opcode::binary
                                             : wire::opcode::text;
  std::array<std::byte, wire::frame_header_bytes_max> header;
  const std::size_t header_bytes =
      wire::write_frame_header(header.data(), what, bytes, masked ? std::optional{piece.key} : std::nullopt);
  if (of.done + bytes != of.payload) header[0] = wire::not_final(header[0]);
  const std::size_t left = header_bytes + bytes - of.written;
  if (!into.fits(left)) return false;
  batch_piece as = piece;
  as.fragment = bytes;
  std::byte* at = into.place(left, as);
  std::size_t skip = of.written;
  if (skip < header_bytes) {
    std::memcpy(at, header.data() + skip, header_bytes - skip);
    at += header_bytes - skip;
    skip = header_bytes;
  }
  const std::span<std::byte> payload{at, bytes - (skip - header_bytes)};
  copy_payload(of, of.done + skip - header_bytes, payload);
  if (masked) (void)wire::mask(payload, piece.key, skip - header_bytes);
  return true;
}

// Copies the bytes of the payload from `at` on: of the head, of the envelope in front of the body, of the
// body, and of the envelope behind it.
void message_frames::copy_payload(partial_frame& of, std::size_t at,
                                  std::span<std::byte> into) const noexcept {
  const std::span<const char> text = slots_.text(of.slot);
  const bool chunked = slots_.chunked(of.slot);
  const std::size_t body_at = chunked ? slots_.chunks_at(of.slot) : text.size();
  const bool alone = of.own_head && of.head.from == 0;
  const auto head = std::span{of.head.bytes}.first(of.own_head ? of.head.size : 0U);
  const std::span<const char> body_alone = chunked ? std::span<const char>{} : slots_.body(of.slot);
  const auto before = std::as_bytes(alone ? body_alone : text.first(body_at))
                          .subspan(of.own_head && !alone ? of.head.from : 0U);
  const auto behind = std::as_bytes(alone ? std::span<const char>{} : text.subspan(body_at));
  const text_id body = slots_.chunks(of.slot);
  const auto take = [&](std::size_t part_bytes, auto&& copy) {
    if (at < part_bytes && !into.empty()) {
      const auto here = into.first(std::min(part_bytes - at, into.size()));
      copy(here);
      into = into.subspan(here.size());
      at = 0;
    } else {
      at -= std::min(at, part_bytes);
    }
  };
  const auto take_span = [&](std::span<const std::byte> part) {
    take(part.size(), [&](std::span<std::byte> to) { std::memcpy(to.data(), part.data() + at, to.size()); });
  };
  take_span(head);
  take_span(before);
  if (chunked)
    take(state_.chunks.bytes(body), [&](std::span<std::byte> to) {
      (void)state_.chunks.read(body, at, of.place); // the socket may not take all of it: never behind that
      chunk_store::place from = of.place;
      state_.chunks.copy(body, at, ROWE_MUTANT(long_place) ? of.place : from, to);
    });
  take_span(behind);
}

// ---- heads

wire::message_head message_frames::head_of(const batch_piece& of) const noexcept {
  const wire::protocol_set& protocols = state_.seams.protocols;
  if (!of.subscription)
    return protocols.messages.head_of({.empty = has_no_members(slots_.text(of.slot)), .ttl_ns = of.ttl_ns});
  const subscription& to = subscription_rows_[of.subscription];
  const std::int64_t published_ns = rt::nanoseconds_of(slots_.published(of.slot));
  return protocols.of(to.codec).head_of({.tag = to.tag,
                                         .published_ns = published_ns,
                                         .wall_ns = published_ns + state_.options.wall_offset_ns,
                                         .unslashed = to.unslashed,
                                         .ttl_ns = of.ttl_ns});
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
