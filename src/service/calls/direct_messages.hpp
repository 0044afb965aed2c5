// SPDX-License-Identifier: Apache-2.0
// Direct messages, to one peer or to everyone, and the requests of calls: how each finds its peers, waits for
// them, and ends. A message is pending while no peer takes it: no peer is there, none has room, or its peers
// left before it was written to them.
//
// A message that finds no room is parked (message_parking.hpp).
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/calls/message_parking.hpp"
#include "service/calls/trackers.hpp"
#include "service/incoming/receiver.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct direct_message {
  std::string_view text;
  call_endpoint sender{}; // who gets its outcome; or nobody
  detail::call_ref own{}; // the handle's own name for it
  detail::peer_ref to{};  // generation 0: everyone
  bool only_now = false;  // not to be queued beyond this cycle
  bool parked = false;    // it was parked in an earlier turn
  rt::time_point expires = rt::never;
  rowe::priority priority = rowe::priority::normal;
};

struct direct_messages_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  local_delivery& local_delivery_;
  receiver& receiver_;
};

class direct_messages : direct_messages_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return trackers::footprint_bytes(bounds) + message_parking::footprint_bytes(bounds);
  }
  direct_messages(rt::arena& memory, const direct_messages_needs& parts) noexcept;

  void forget(peer_index peer) noexcept { parking_.forget(peer); }

  // ---- messages of this process

  // The turns of senders, and what is parked in them.
  message_parking& parking() noexcept { return parking_; }
  // False: the message must be parked until its sender's next turn. The messages of one sender reach a peer
  // in order.
  bool post(const direct_message& m) noexcept;

  // ---- requests and replies

  // Sends the composed request of a call. `to` none: to the first peer that has room. Errors: full; then the
  // caller of this function ends the call.
  status send_request(slot_id slot, peer_index to, detail::call_ref call, bool stops) noexcept;
  // Reports that a reply has been written: to whoever answered, and to the call `of`, if it is its long part.
  void track_reply(slot_id slot, const call_endpoint& sender, detail::call_ref own,
                   detail::call_ref of = {}) noexcept;
  // The call has ended: its request is not sent any more, unless a socket is in the middle of it.
  void cancel(slot_ref which) noexcept;

  // ---- pending messages

  // Gives pending messages to a peer, in order, as far as it has room: it has just connected, or another peer
  // left before they were written to it. The others stay pending. A request goes to the first peer with room.
  void deliver_pending(peer_index peer) noexcept;
  // Gives pending messages to peers that have got room since the last look.
  void place_pending() noexcept {
    if (pending() != 0) place_all_pending();
  }
  // The endpoint closes: all pending messages end.
  void close() noexcept;
  std::uint32_t pending() const noexcept { return trackers_.pending(); }

  // Takes the outcomes since the last look, and reports them to the senders.
  void take_outcomes() noexcept {
    if (message_store_.has_outcomes()) complete_outcomes();
  }

  bool check() const noexcept;

 private:
  void add(counter which, std::uint64_t by = 1) noexcept { state_.counts.add(which, by); }
  bool send(const direct_message& m) noexcept;
  void place_all_pending() noexcept;
  // Expired messages make room. Their outcomes are taken at once, before their slots are used again.
  bool has_room(peer_index to, priority at) noexcept {
    const bool has = outbox_.has_room(to, at);
    take_outcomes();
    return has;
  }
  // Likewise, for a message to everyone. `own`: how many slots it has already.
  bool has_room_to_share(peer_index to, priority at, slot_class of, std::uint32_t own) noexcept {
    return has_room(to, at) && (!outbox_.of(to).backpressured() || trackers_.may_share(of, own));
  }
  bool has_room_for(const direct_message& m, slot_class of) noexcept;
  void begin(slot_id slot, const tracker& as) noexcept;
  bool queue_to(peer_index to, slot_id slot) noexcept;
  void end_queueing(slot_id slot) noexcept;
  void complete_outcomes() noexcept;
  void complete(slot_id slot, bool evicted) noexcept;
  void end(slot_id slot, const status& outcome) noexcept;

  slot_pool& slots_;
  trackers trackers_;
  message_parking parking_;
  std::uint64_t looked_for_room_at_ = 0; // the count of changes when pending messages were tried last
};

} // namespace rowe::service
