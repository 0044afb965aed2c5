// SPDX-License-Identifier: Apache-2.0
// What comes of long messages: those that are longer than message_bytes_max. A piece is checked as it comes
// and put into chunks, so no step takes long, however long the message is. When the last piece is there, the
// message is read as a short one: its longest member is replaced by a stand-in, which fits into a small text,
// and the decoder of its peer's protocol sees only that.
//
// All peers together may fill a quarter of the chunks with messages that are not complete. A peer has at most
// one such message, and one whose text comes in messages of their own (fragment_ingress.hpp). If there is no
// room for another one, the peer that has used most room lately loses its own, if it has used more than twice
// as much as the newcomer, and for half a second what it has now. Use is chunks times time; half of it is
// forgotten every 8 s, and it stays with the peer's place when the peer leaves. So whoever sends slowly, or
// comes again and again, keeps out only those that have used as much. Who loses a message, or cannot begin
// one, gets a report when it is over.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/indexed_pool.hpp"
#include "service/incoming/long_arrival.hpp"
#include "service/state/core_state.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "json/reading/scanner.hpp"

namespace rowe::service {

class long_ingress {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  long_ingress(rt::arena& memory, core_state& state) noexcept;

  // In what a message comes.
  enum class way : std::uint8_t { frames, messages };

  // Takes a piece of a message in frames.
  void take(peer_index peer, const wire::frame_step& step) noexcept;
  // Takes the next of a text that comes in messages.
  void take(peer_index peer, std::string_view text) noexcept;
  // Its last piece was taken. `front`: how it begins, as far as that was stored elsewhere. The envelope is
  // valid until the next call, or as long as the front is.
  long_arrival end(peer_index peer, way by, bool binary, std::span<const std::byte> front) noexcept;
  // The same for a text that is not long, but no JSON: what is in front of its fault. It was validated last.
  long_arrival malformed(std::string_view text, const error& why) noexcept;
  // Of the text that comes in messages: its bytes so far, whether these are whole JSON, and whether they were
  // dropped, because others needed the room.
  struct so_far {
    std::size_t bytes = 0;
    bool closed = false;
    bool lost = false;
  };
  so_far text_of(peer_index peer) const noexcept;
  // Copies all of it.
  void copy_text(peer_index peer, std::span<std::byte> into) const noexcept;
  // It is not wanted any more.
  void drop_text(peer_index peer) noexcept;
  // The peer has left, or begins anew.
  void forget(peer_index peer) noexcept;
  // Whether a message of the peer, which is not complete yet, began by then.
  bool began_by(peer_index peer, rt::time_point then) const noexcept;

  bool check() const noexcept;

 private:
  using receipt_id = id<struct receipt_tag>;
  // A message of a peer.
  struct incoming {
    receipt_id receipt{};
    std::uint32_t bytes = 0; // as far as it is known
    bool dropped = false;    // what still comes of it is ignored
  };
  // Of a peer.
  struct sender_row {
    std::array<incoming, 2> in{}; // by their way
    std::uint64_t chunk_ms = 0;   // what it has used, until
    rt::time_point used_until{};
  };
  // A message that is not complete.
  struct receipt {
    peer_index peer{};
    way by = way::frames;
    text_id text{}; // none: the row is free
    std::uint32_t chunks = 0;
    rt::time_point began{};
    bool binary = false;
    bool unsupported = false;
    std::uint8_t head_bytes = 0; // of a binary message in front of its body
    std::uint8_t head_have = 0;
    std::array<std::byte, 20> head{};
    json::scanner scanner{};
    receipt_id next_free{};
  };

  incoming& in(peer_index peer, way by) const noexcept {
    return senders_[peer].in[static_cast<std::size_t>(by)];
  }
  void take(peer_index peer, way by, std::span<const std::byte> piece, std::uint64_t known_bytes,
            bool binary) noexcept;
  receipt* begin(peer_index peer, way by, std::size_t bytes, bool binary) noexcept;
  bool make_room(peer_index newcomer, std::uint32_t chunks, bool needs_row) noexcept;
  void drop(receipt_id which) noexcept;
  void close(receipt_id which) noexcept;
  std::span<const std::byte> take_head(receipt& of, std::span<const std::byte> payload) noexcept;
  std::uint64_t ms_since(rt::time_point then) const noexcept;
  std::uint64_t cost_of(const receipt& one) const noexcept;
  std::uint64_t used_by(const receipt& one) const noexcept;
  std::uint64_t used_by(peer_index peer) const noexcept;
  void settle(sender_row& of) noexcept;
  long_arrival put_together(receipt& of) noexcept;
  template <class Copy>
  std::span<const std::byte> list(std::span<const json::placed_member> members, const Copy& copy) noexcept;

  core_state& state_;
  rows<peer_index, sender_row> senders_;
  rows<receipt_id, receipt> receipts_;
  indexed_pool<receipt_id, receipt, &receipt::next_free> free_;
  std::span<std::byte> envelope_;
};

} // namespace rowe::service
