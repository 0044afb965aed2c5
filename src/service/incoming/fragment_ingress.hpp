// SPDX-License-Identifier: Apache-2.0
// Puts messages together that come in fragments which are messages themselves, so others can go between
// them. A peer may have one message in fragments at a time, and its fragments come in their order. What they
// hold is unescaped, and goes into chunks as any long message does (long_ingress.hpp). So a fragment takes no
// long step either: what is left of it is taken in its peer's next turn.
//
// A message of which one fragment is wrong is lost, and what still comes of it is ignored: its sender gets
// one report. So is one of which nothing comes for too long.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/incoming/long_ingress.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

struct fragment_ingress_needs {
  core_state& state_;
  outbox& outbox_;
  refusals& refusals_;
  long_ingress& long_ingress_;
};

class fragment_ingress : fragment_ingress_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  fragment_ingress(rt::arena& memory, const fragment_ingress_needs& parts) noexcept;

  // What is due after some of a fragment was taken.
  enum class due : std::uint8_t {
    next_fragment,
    rest,  // of this one: go_on()
    whole, // the message is complete
  };
  // Takes a fragment, or refuses it.
  due take(connection& c, const wire::request& asked, std::span<const std::byte> message) noexcept;
  // Takes more of a fragment whose rest is due.
  due go_on(connection& c, std::span<const std::byte> message) noexcept;

  // A fragment of the peer comes again: its rest is due, or the message that it completes was parked.
  bool comes_again(peer_index peer) const noexcept { return rows_[peer].is >= phase::taking; }
  // Whether that message has been carried out, as far as it could be.
  bool was_parked(peer_index peer) const noexcept { return rows_[peer].is == phase::parked; }
  // The complete message, if it is no longer than others may be; else empty, and it is a long one. Its text
  // may be written to, and is valid until the next one is asked for.
  std::span<std::byte> text(peer_index peer) noexcept;
  // The complete message was carried out, or is parked and comes again.
  void end(peer_index peer, bool parked) noexcept;

  // The peer wants texts that are longer in fragments from now on.
  void ask(peer_index peer, std::uint32_t bytes) noexcept { outbox_.of(peer).send_in_fragments(bytes); }

  // Called periodically: a message of which nothing came for too long is lost.
  void check_time(connection& c) noexcept {
    if (rows_[{c.id.index}].is == phase::open) [[unlikely]]
      look_at_time(c);
  }
  // The peer has left, or begins anew; also its long message in frames.
  void forget(peer_index peer) noexcept;

  bool check() const noexcept;

 private:
  // `taking` and those behind it: its last fragment comes again.
  enum class phase : std::uint8_t { none, open, lost, taking, parked };
  // Of a peer.
  struct row {
    phase is = phase::none;
    bool exact = true;       // the count is one
    std::uint64_t id = 0;    // a hash of it
    std::uint32_t next = 0;  // number of the fragment that is due
    std::uint32_t count = 0; // of fragments
    std::uint32_t at = 0;    // taking: where in the fragment its rest begins,
    std::uint32_t end = 0;   // and ends
    std::uint32_t timed = 0; // bytes
    rt::time_point since{};  // then
  };

  static constexpr std::size_t part_bytes_max = 4096; // of a fragment, in one step

  std::int64_t count_max() const noexcept;
  bool belongs(connection& c, const wire::request& asked) noexcept;
  bool begins(connection& c, const wire::request& asked) noexcept;
  bool is_complete(peer_index peer) const noexcept;
  void refuse(connection& c, std::string_view id_raw, std::string_view code,
              const wire::text_out& why) noexcept;
  void look_at_time(connection& c) noexcept;
  void lose(peer_index peer) noexcept;

  rows<peer_index, row> rows_;
  bool in_whole_ = false; // a complete message is carried out
};

} // namespace rowe::service
