// SPDX-License-Identifier: Apache-2.0
// Writes what waits in the outbox: each peer that is scheduled gets what its queues have ready, many frames
// in one call of the transport. What is urgent goes first, then messages by their priority, the subscriptions
// of one priority in turn. What may be on its way to a peer is bounded by its credit, which pings measure
// (credit.hpp).
//
// A stop must not wait until a thousand peers are written to. So the peers take turns, and one cycle does a
// stated amount of work.
//
// A message that a socket has the first bytes of is a partial frame. It keeps its slot until its last byte is
// out, and a peer that does not read never takes that. So of each size of slots only some may be partial at
// once; who has to wait for others begins when one of those is done, or is cut for taking too long while
// somebody waits.
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

#include "service/batch.hpp"
#include "service/control_frames.hpp"
#include "service/core_options.hpp"
#include "service/counters.hpp"
#include "service/credit.hpp"
#include "service/cycle_state.hpp"
#include "service/outbox.hpp"
#include "service/peer_table.hpp"
#include "service/stop_frames.hpp"
#include "service/timers.hpp"
#include "service/transport.hpp"
#include "wire/websocket.hpp"

namespace rowe::service {

// How long a frame may be partly written while others wait for its slot, and in addition some for its bytes.
inline constexpr rt::duration partial_time_min = std::chrono::milliseconds{500};

class sender {
 public:
  struct needs {
    const cycle_state& cycle;
    counters& counts;
    timers& due;
    peer_table& peers;
    router& topics;
    message_store& store;
    outbox& out;
    transport& carrier;
    entropy& random;
    bool control_frames; // the peers know them: pings, pongs and close frames
    bool masks;          // frames of a client are masked
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  sender(rt::arena& memory, const limits& bounds, const needs& parts) noexcept;

  void open(peer_index peer) noexcept;
  // What it has in hand is lost.
  void forget(peer_index peer) noexcept;

  // ---- messages

  // Whoever is scheduled, in turn, up to the work of one cycle. What lives no longer than this cycle is
  // offered to all, however much work that is.
  void flush_all() noexcept;
  // Messages to one peer too: only when what is over has been taken out, by timers in this cycle.
  void flush(peer_index peer) noexcept;
  // Somebody has not had a turn since the round began: no more values are taken from handles until all have.
  bool round_open() const noexcept { return turn_left_ != 0; }
  // The transport has room again.
  void writable(peer_index peer) noexcept;
  // The peer is not read any more: its pongs lie behind what we do not read, so only the kernel's limit
  // holds.
  void ignore_credit(peer_index peer) noexcept;

  // ---- frames that pass messages

  void send_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept;
  // A close frame, unless it would stand in the middle of another frame; and everything in front of it.
  void send_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept;
  // An answer about the stop, written at once. Counted when it finds no room.
  void add_stop_reply(peer_index peer, std::span<const char> text) noexcept;
  // The stop's state, in the place of an older one.
  void add_stop_state(peer_index peer, std::span<const char> text) noexcept;

  // ---- liveness

  void take_pong(peer_index peer, std::span<const std::byte> payload) noexcept;
  // Ask as soon as possible whether it is alive.
  void request_ping(peer_index peer) noexcept { outputs_[peer].credit.ask(); }
  // Schedules a ping that is due; counts a peer that answers none in time.
  void check_responsive(peer_index peer) noexcept;
  bool unresponsive(peer_index peer) const noexcept { return outputs_[peer].unresponsive; }
  // Of the pings that are not answered, when the oldest was sent; never: there is none.
  rt::time_point waits_for_pong_since(peer_index peer) const noexcept {
    return outputs_[peer].credit.waits_since();
  }

  // ---- partial frames

  bool has_partial(peer_index peer) const noexcept { return outputs_[peer].partial.slot != no_index; }
  bool any_partial() const noexcept;
  // The timer: whoever waits to begin a frame looks whether it may now.
  void partial_frames_due() noexcept;
  // Behind flush_all(): calls `cut(peer)` for each whose partial frame took too long while others wait.
  template <class Cut>
  void cut_stalled(Cut&& cut) noexcept;

  bool check() const noexcept;

 private:
  // The message whose first bytes a socket has already: it goes on before anything else.
  struct partial_frame {
    std::uint32_t slot = no_index;
    std::size_t written = 0; // of header and payload together
    wire::mask_key key{};    // client side: the rest is masked with the same key
    bool unslashed = false;  // as subscription::unslashed
    rt::time_point since{};
  };
  // What goes to one peer.
  struct output {
    class credit credit;
    partial_frame partial;
    bool low_rtt = false;      // the transport was told so
    bool unresponsive = false; // it answers no pings, and that was counted
    control_frames control;
    stop_frames stop;
  };

  void add(counter which, std::uint64_t by = 1) noexcept { counts_.add(which, by); }
  bool masks(peer_index peer) const noexcept { return masks_frames_ && peers_[peer].ours == side::client; }
  wire::mask_key next_mask() noexcept;
  void place_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept;
  void count_message_out(peer_index peer) noexcept;

  void flush_urgent(peer_index peer) noexcept;
  void write(peer_index peer, batch& what) noexcept;
  bool gather_urgent(peer_index peer, batch& into) noexcept;
  void gather_messages(peer_index peer, batch& into) noexcept;
  bool gather_partial(peer_index peer, batch& into) noexcept;
  bool gather_queue(peer_index peer, queue& from, std::uint32_t of, batch& into) noexcept;
  bool may_go_on(peer_index peer, batch& into) noexcept;
  bool gather_frame(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept;
  bool gather_unslashed(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept;
  bool gather_ping(peer_index peer, std::size_t in_front) noexcept;
  void commit(peer_index peer, batch& sent, std::size_t taken) noexcept;
  void commit_message(peer_index peer, const batch_piece& piece, std::size_t part) noexcept;

  bool may_begin(peer_index peer, std::uint32_t slot) noexcept;
  void hand_over_rest(peer_index peer) noexcept;
  void end_partial(peer_index peer) noexcept;
  rt::time_point partial_due(const partial_frame& frame) noexcept;
  void look_again_from(std::uint32_t first) noexcept;

  const cycle_state& cycle_;
  counters& counts_;
  timers& due_;
  peer_table& peers_;
  router& topics_;
  message_store& store_;
  outbox& out_;
  wire_slots& slots_;
  transport& carrier_;
  entropy& random_;
  const bool control_frames_;
  const bool masks_frames_;
  rows<peer_index, output> outputs_;
  std::span<std::byte> buffer_;   // a batch of frames,
  std::span<batch_piece> pieces_; // and where they came from
  std::span<std::byte> masks_;    // keys not used yet
  std::size_t masks_used_;
  std::uint32_t turn_left_ = 0; // how many of those scheduled have not had their share of this round
  std::size_t work_ = 0;        // of this cycle
  bool waits_to_begin_ = false; // somebody, for others' partial frames
  bool stalled_due_ = false;    // for so long that one of those may be cut
};

template <class Cut>
void sender::cut_stalled(Cut&& cut) noexcept {
  if (!stalled_due_) return;
  stalled_due_ = false;
  if (!waits_to_begin_) return;
  rt::time_point next = rt::never;
  for (const peer_index peer : peers_.ids()) {
    const partial_frame& frame = outputs_[peer].partial;
    if (!peers_[peer].open() || frame.slot == no_index) continue;
    if (slots_.may_begin(slots_.class_of(frame.slot))) continue; // in nobody's way
    if (const rt::time_point due = partial_due(frame); due > cycle_.now) {
      next = std::min(next, due);
    } else {
      add(counter::stalled_peers);
      cut(peer);
    }
  }
  due_.arm(timer::partial_frames, std::min(next, cycle_.now + partial_time_min));
}

} // namespace rowe::service
