// SPDX-License-Identifier: Apache-2.0
// The frames that are sent to a peer before any message: pings, pongs, the close frame, and answers and
// states of the stop. Pings also measure how much may be on its way to the peer (credit.hpp), and show
// whether the peer is alive. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/transport.hpp"
#include "service/outgoing/batch.hpp"
#include "service/outgoing/control_frames.hpp"
#include "service/outgoing/credit.hpp"
#include "service/outgoing/mask_keys.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/partial_frames.hpp"
#include "service/outgoing/stop_frames.hpp"
#include "service/state/core_state.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {

struct urgent_frames_needs {
  core_state& state_;
  outbox& outbox_;
  mask_keys& mask_keys_;
};

class urgent_frames : urgent_frames_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<output>(bounds.connections_max);
  }
  urgent_frames(rt::arena& memory, const urgent_frames_needs& parts) noexcept;

  void open(peer_index peer) noexcept;
  bool masks(peer_index peer) const noexcept {
    return state_.peers[peer].ours == side::client && state_.peers[peer].protocol->can.masks;
  }

  // ---- pending frames

  // False: the peer's protocol has no control frames.
  bool add_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept;
  bool add_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept;
  // Both: false if there is no space. The state replaces an older one.
  bool add_stop_reply(peer_index peer, std::span<const char> text, wire::opcode what) noexcept;
  bool add_stop_state(peer_index peer, std::span<const char> text, wire::opcode what) noexcept;

  // ---- writing

  // Gathers them, after a partial frame and before messages; behind a fragment of a long message only control
  // frames. False: no message may follow.
  bool gather(peer_index peer, bool open, const partial_frame& behind, batch& into) noexcept;
  // Gathers what must be written before any other frame: the rest of one that was begun, with what is behind
  // it.
  void gather_begun(peer_index peer, batch& into) noexcept;
  void commit_control(peer_index peer, std::size_t taken) noexcept {
    outputs_[peer].control.written += taken;
  }
  void commit_stop(peer_index peer, std::size_t taken) noexcept { outputs_[peer].stop.advance(taken); }
  void wrote(peer_index peer, std::size_t bytes) noexcept {
    outputs_[peer].credit.wrote(bytes, state_.cycle.now);
  }
  // The bytes up to which a batch may begin one more frame of this priority.
  std::size_t room(peer_index peer, priority at) const noexcept {
    return state_.peers[peer].unheard ? SIZE_MAX : outputs_[peer].credit.room(at);
  }
  // Whether anything goes before messages now.
  bool goes_first(peer_index peer) const noexcept {
    return any(peer) || outputs_[peer].credit.wants_ping(state_.cycle.now);
  }
  // Whether one more frame may be begun; if not, the batch records what it waits for.
  bool may_go_on(peer_index peer, batch& into) noexcept;

  // ---- liveness

  void take_pong(peer_index peer, std::span<const std::byte> payload) noexcept;
  // Ask as soon as possible whether it is alive.
  void request_ping(peer_index peer) noexcept { outputs_[peer].credit.ask(); }
  // Schedules a due ping; counts a peer that does not answer one in time.
  void check_responsive(peer_index peer) noexcept;
  bool unresponsive(peer_index peer) const noexcept { return outputs_[peer].unresponsive; }
  // When the newest ping was sent that it answered; zero: none was. All that it sends afterwards was sent
  // later than that.
  rt::time_point answered_at(peer_index peer) const noexcept { return outputs_[peer].credit.answered_at(); }
  // When the oldest unanswered ping was sent; never: there is none.
  rt::time_point waits_for_pong_since(peer_index peer) const noexcept {
    return outputs_[peer].credit.waits_since();
  }

  // For check(): whether something must be written, and whether a pong must come.
  bool any(peer_index peer) const noexcept {
    return !outputs_[peer].control.rest().empty() || !outputs_[peer].stop.rest().empty();
  }
  bool waits_for_pong(peer_index peer) const noexcept { return outputs_[peer].credit.ping_under_way(); }

 private:
  // What goes to one peer.
  struct output {
    class credit credit;
    std::size_t send_buffer = 0; // as limit_send_buffer() set it
    bool unresponsive = false;   // it answers no pings, and that was counted
    control_frames control;
    stop_frames stop;
  };

  bool gather_ping(peer_index peer, std::size_t in_front) noexcept;

  rows<peer_index, output> outputs_;
};

} // namespace rowe::service
