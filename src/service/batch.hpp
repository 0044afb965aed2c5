// SPDX-License-Identifier: Apache-2.0
// What one call of the transport is given, and where each piece of it came from. Frames are joined: they lie
// one behind the other in a room of the core's, so that a call of the kernel gets one piece of memory,
// however many messages it is (decision 0018). Only what goes alone stays where it is: a frame that stands in
// its slot, the rest of one, control frames. Service thread only.
#pragma once
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "service/queues.hpp"
#include "wire/mask.hpp"

namespace rowe::service {

// A batch ends with the frame that reaches this, or before one for which there is no room. A little less than
// a segment of TCP can be (65 483 bytes on loopback): a longer batch leaves a tiny segment behind it.
inline constexpr std::size_t batch_bytes_max = 60 * 1024;
inline constexpr std::size_t batch_pieces_max = 256;

struct batch_piece {
  enum class origin : std::uint8_t {
    message, // the front of `from`
    partial, // the rest of the partial frame
    control,
    stop,
  };
  queue* from = nullptr;
  std::uint32_t subscription = no_index;
  std::uint32_t slot = no_index;
  std::uint32_t bytes = 0;
  wire::mask_key key{};
  origin is = origin::message;
  bool unslashed = false; // message, partial: as subscription::unslashed
};

struct batch {
  // Both are lent.
  batch(std::span<std::byte> joined, std::span<batch_piece> places) noexcept : room{joined}, pieces{places} {}

  std::span<const std::byte> whole() const noexcept { return {start, bytes}; }
  bool full() const noexcept { return count == pieces.size() || bytes >= batch_bytes_max; }
  // A lone piece needs no room.
  bool fits(std::size_t more_bytes) const noexcept { return count == 0 || more_bytes <= room.size() - bytes; }

  // What lies somewhere already.
  void add(std::span<const std::byte> piece, const batch_piece& of) noexcept {
    if (count == 0) {
      start = piece.data();
      note(piece.size(), of);
      return;
    }
    std::memcpy(place(piece.size(), of), piece.data(), piece.size());
  }
  // Room for so many bytes, to be written.
  std::byte* place(std::size_t piece_bytes, const batch_piece& of) noexcept {
    assert(piece_bytes <= room.size() - bytes);
    if (start != room.data()) {
      if (count != 0) std::memcpy(room.data(), start, bytes); // it is not alone any more
      start = room.data();
    }
    std::byte* const at = room.data() + bytes;
    note(piece_bytes, of);
    return at;
  }

  std::span<std::byte> room;
  const std::byte* start = nullptr;
  std::size_t bytes = 0;
  std::size_t count = 0;
  std::size_t credit = 0;        // what the peer's allows at the priority that is being gathered
  bool more = false;             // something was left out that another batch may take at once
  bool held = false;             // something was left out until the peer has read more
  std::span<batch_piece> pieces; // `count` of them are there

 private:
  void note(std::size_t piece_bytes, const batch_piece& of) noexcept {
    pieces[count] = of;
    pieces[count].bytes = static_cast<std::uint32_t>(piece_bytes);
    ++count;
    bytes += piece_bytes;
  }
};

} // namespace rowe::service
