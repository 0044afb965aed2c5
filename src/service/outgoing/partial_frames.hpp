// SPDX-License-Identifier: Apache-2.0
// Partial frames: messages of which a socket has taken only the first bytes. Such a frame holds its slot
// until its last byte is written, and a peer that does not read never takes that byte. So only some slots of
// each size may be partial at once. A peer that has to wait begins when one of those frames is done, or is
// cut because it takes too long while a peer waits.
//
// A long message goes as several frames, the fragments of RFC 6455 5.4. It counts as partial until its last
// byte is written, but control frames may go between its fragments. To a peer that asked for fragments
// which are texts, a message goes as several texts, and any other message may go between these. If a socket
// takes only a part of such another one, the message in texts is set aside until that is written. Service
// thread only; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/indexed_pool.hpp"
#include "service/base/service_limits.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

// The rest of it is written before anything else.
struct partial_frame {
  enum class way : std::uint8_t {
    whole,     // as one frame
    continued, // a long message, as the frames of one message
    texts,     // as several texts, which are its fragments
    between,   // as one frame, while a message in texts is set aside
  };
  slot_id slot{};            // none
  std::uint32_t written = 0; // of header and payload together
  wire::mask_key key{};      // client side: the rest is masked with the same key
  bool own_head = false;     // the peer's codec writes its own head:
  wire::message_head head{}; // that head
  way goes = way::whole;
  bool others_next = false; // texts: other messages go first in the next batch
  rt::time_point since{};
  rt::time_point begun{}; // in several frames: the first of them
  // Of a message in several frames; `written` is then of its present fragment.
  std::uint32_t payload = 0;  // its bytes: all,
  std::uint32_t done = 0;     // those in the fragments before that,
  std::uint16_t fragment = 0; // and those in that one; 0: none was begun
  chunk_store::place place{}; // of what was read last, in the chunks
  // In texts:
  std::uint32_t stride = 0;    // each begins near a multiple of this, between two characters
  std::uint32_t number = 0;    // of the present one (between: of the row where that is set aside),
  std::uint32_t count = 0;     // and how many there are
  const queue* from = nullptr; // whose other messages wait for their turn; only to be compared

  explicit operator bool() const noexcept { return static_cast<bool>(slot); }
  // The bytes of a frame have been written, but not all.
  bool mid_frame() const noexcept { return written != 0; }
  // It goes in several frames.
  bool in_frames() const noexcept { return payload != 0; }
  // In its middle no other message may be begun.
  bool is_continued() const noexcept { return goes == way::continued; }
  // What is written next is not chosen as usual.
  bool diverts() const noexcept { return goes != way::whole; }
  // In several frames: the one that goes next.
  void begin_fragment(std::uint16_t bytes, const wire::mask_key& with) noexcept {
    fragment = bytes;
    key = with;
  }
};

struct partial_frames_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
};

class partial_frames : partial_frames_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<partial_frame>(bounds.connections_max) +
           rt::arena::bytes_for<aside_row>(aside_count(bounds));
  }
  partial_frames(rt::arena& memory, const partial_frames_needs& parts) noexcept;

  partial_frame& of(peer_index peer) noexcept { return frames_[peer]; }
  const partial_frame& of(peer_index peer) const noexcept { return frames_[peer]; }
  bool any() const noexcept;

  // Whether a peer may begin the frame of a slot after its own partial frame; if not, it waits.
  bool may_begin(peer_index peer, slot_id slot) noexcept {
    return slots_.may_begin(slots_.class_of(slot)) || may_begin_or_wait(peer, slot);
  }
  // Whether so many more slots of the size of this one may be partly written.
  bool has_room_for(slot_id slot, std::uint32_t slots) const noexcept {
    return slots_.may_begin(slots_.class_of(slot), slots);
  }
  // A socket has taken the first bytes. The reference of the message goes with them.
  void begin(peer_index peer, const partial_frame& frame) noexcept;
  // Whether a message in texts can be set aside, so that others may go between its fragments.
  bool may_set_aside() const noexcept { return !free_aside_.empty(); }
  // More bytes of it are written; they end its frame or not. True if the whole message is written.
  bool advance(peer_index peer, std::size_t bytes, bool ends_frame) noexcept;
  // The last byte is written, or the peer has left.
  void end(peer_index peer) noexcept;
  // Whether the transport should store the rest of the frame itself. That costs system calls. It is worth
  // them for a large slot if two large frames are partial, or no more may be.
  bool is_worth_handing_over(peer_index peer) const noexcept;

  // The timer: peers that wait to begin a frame check whether they may.
  void look_again() noexcept {
    stalled_due_ = true;
    look_again_from(0);
  }
  // After they have checked: calls `cut(peer)` for each peer whose frame takes too long while others wait.
  template <class Cut>
  void cut_stalled(Cut&& cut) noexcept {
    if (!stalled_due_) return;
    stalled_due_ = false;
    if (!waits_) return;
    rt::time_point next = state_.cycle.now + partial_time_min;
    const slot_id spared = first_long();
    bool may_be_slow = true; // until one was cut for that: its place comes free later
    for (const peer_index peer : state_.peers.ids()) {
      if (!state_.peers[peer].open() || !frames_[peer]) continue;
      const rt::time_point due =
          std::min(due_for_others(frames_[peer]), due_for_others(aside_of(frames_[peer])));
      const bool slow = may_be_slow && is_slow(peer, spared);
      if (due > state_.cycle.now && !slow) {
        next = std::min(next, due);
      } else {
        may_be_slow = may_be_slow && !slow;
        state_.counts.add(counter::stalled_peers);
        cut(peer);
      }
    }
    state_.due.arm(timer::partial_frames, next);
  }
  // A peer waits to begin, and the timer will let it look again.
  bool wakes_who_waits() const noexcept { return waits_ && state_.due.armed(timer::partial_frames); }

  // Each slot has as many partial frames as it says.
  bool check() const noexcept;

 private:
  using aside_id = id<struct aside_tag>;
  // A message in texts, while a part of another one's frame is written.
  struct aside_row {
    partial_frame frame;
    aside_id next_free{};
  };
  static std::size_t aside_count(const limits& bounds) noexcept {
    return std::min<std::size_t>(bounds.connections_max, messages_aside_max);
  }
  // None, if nothing is set aside behind this one.
  const partial_frame& aside_of(const partial_frame& one) const noexcept {
    static constexpr partial_frame none{};
    return one.goes == partial_frame::way::between ? aside_[{one.number}].frame : none;
  }

  bool may_begin_or_wait(peer_index peer, slot_id slot) noexcept;
  rt::time_point due_of(const partial_frame& frame) noexcept;
  rt::time_point due_for_others(const partial_frame& frame) noexcept;
  // Of a peer the message that it reads in several frames, also if it is set aside; null: there is none.
  const partial_frame* long_of(peer_index peer) const noexcept;
  // The slot of the one that somebody has been reading for the longest time; none: nobody reads one.
  slot_id first_long() const noexcept;
  // Whether a peer reads one slowly, others wait for its slot, and it is not the spared one.
  bool is_slow(peer_index peer, slot_id spared) const noexcept;
  void look_again_from(std::uint32_t first) noexcept;

  slot_pool& slots_;
  rows<peer_index, partial_frame> frames_;
  rows<aside_id, aside_row> aside_;
  indexed_pool<aside_id, aside_row, &aside_row::next_free> free_aside_;
  bool waits_ = false;       // a peer waits to begin a frame
  bool stalled_due_ = false; // it has waited so long that a partial frame may be cut
};

} // namespace rowe::service
