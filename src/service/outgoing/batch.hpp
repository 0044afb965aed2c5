// SPDX-License-Identifier: Apache-2.0
// A batch: the bytes for one call of the transport, and where each piece came from. Frames are copied one
// behind the other into a buffer of the sender. So one system call gets one piece of memory, however many
// messages are in it (decision 0018). A batch of one piece is not copied: the piece is a frame in its slot,
// the rest of a frame, or control frames. Service thread only.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include <rowe/rt/clock.hpp>

#include "service/base/message_queue.hpp"
#include "service/base/service_limits.hpp"
#include "wire/codec/request.hpp"
#include "wire/websocket/mask.hpp"

namespace rowe::service {

struct batch_piece {
  enum class origin : std::uint8_t {
    message, // from the queue `from`
    partial, // the rest of the partial frame
    control,
    stop,
  };
  queue* from = nullptr;
  subscription_id subscription{};
  slot_id slot{};
  std::uint32_t bytes = 0;
  wire::mask_key key{};
  origin is = origin::message;
  bool own_head = false; // message, partial: it is sent with a head of its own, not the slot's shared text
  std::uint16_t fragment = 0; // message, partial: bytes of the payload in this frame of a long message
  std::int64_t ttl_ns = wire::unlimited; // message: what is left of its time to live, if the peer gets it
};

struct batch {
  // Both spans must outlive the batch.
  batch(std::span<std::byte> lent, std::span<batch_piece> places) noexcept : buffer{lent}, pieces{places} {}

  std::span<const std::byte> whole() const noexcept { return {start, bytes}; }
  bool full() const noexcept { return count == pieces.size() || bytes >= batch_bytes_max; }
  // A batch of one piece needs no buffer.
  bool fits(std::size_t more_bytes) const noexcept {
    return count == 0 || more_bytes <= buffer.size() - bytes;
  }

  // Adds a piece that lies in memory already.
  void add(std::span<const std::byte> piece, const batch_piece& of) noexcept {
    if (count == 0) {
      start = piece.data();
      note(piece.size(), of);
      return;
    }
    std::memcpy(place(piece.size(), of), piece.data(), piece.size());
  }
  // The space behind what was added. What is written to it from its beginning on can be added by place().
  std::span<std::byte> room() noexcept {
    begin_copies();
    return buffer.subspan(bytes);
  }
  // Adds a piece. The caller writes it to the address that this returns.
  std::byte* place(std::size_t piece_bytes, const batch_piece& of) noexcept {
    assert(piece_bytes <= buffer.size() - bytes);
    begin_copies();
    std::byte* const at = buffer.data() + bytes;
    note(piece_bytes, of);
    return at;
  }

  std::span<std::byte> buffer;
  const std::byte* start = nullptr;
  std::size_t bytes = 0;
  std::size_t count = 0;
  std::size_t credit = 0;        // the peer's credit at the priority that is being gathered
  bool more = false;             // something was left out that another batch may take at once
  unsigned in_fragments = 0;     // how many of a long message, of those in a turn, it has or waits for
  bool out_of_credit = false;    // something was left out until the peer has read more
  rt::time_point clock_read{};   // for times to live: when the first of them was asked for
  std::span<batch_piece> pieces; // the first `count` are used

 private:
  void begin_copies() noexcept {
    if (start == buffer.data()) return;
    if (count != 0) std::memcpy(buffer.data(), start, bytes); // a second piece follows
    start = buffer.data();
  }
  void note(std::size_t piece_bytes, const batch_piece& of) noexcept {
    pieces[count] = of;
    pieces[count].bytes = static_cast<std::uint32_t>(piece_bytes);
    ++count;
    bytes += piece_bytes;
  }
};

} // namespace rowe::service
