// SPDX-License-Identifier: Apache-2.0
// Encoded messages, from the moment they are composed until nobody needs them any more. A message lies in one
// slot; many queues may hold its number. Whoever releases the last reference frees the slot. An expired
// message is freed even while it is queued. Every user of a message compares its expiry with the time of the
// cycle. The wheel only frees slots that nobody looks at.
//
// The store does not know who waits for the outcome of a message. A slot may be tracked: then its outcomes
// are recorded, and whoever tracks it takes them later.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/index_list.hpp"
#include "service/base/slot_pool.hpp"
#include "service/base/stand_in.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/codec.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

// What became of a tracked message since the last look.
struct outcome {
  slot_id slot{};
  bool sent = false;    // the whole message was written to one peer
  bool ended = false;   // no delivery of it is left
  bool evicted = false; // it ended because it was evicted
  bool expired = false; // it expired; its slot is free
};

class message_store {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  message_store(rt::arena& memory, core_state& state) noexcept;

  slot_pool& slots() noexcept { return slots_; }
  const slot_pool& slots() const noexcept { return slots_; }
  std::size_t text_bytes_max() const noexcept { return text_bytes_max_; }

  // Composes one message in a slot with one reference. `write_text(json::writer&)` writes it; it is called
  // again if a small slot did not fit. It may return the message's kind; the default is text. None, counted:
  // no slot is free, or none is large enough. When a class has no free slot, `make_room(slot_class)` may free
  // one. A message of the stop may take the reserved slot, and nothing is evicted for it.
  template <class WriteText, class MakeRoom>
  slot_id compose(const message_lifetime& lifetime, WriteText&& write_text, slot_use what,
                  MakeRoom&& make_room) noexcept {
    counter why = counter::no_slot;
    for (const slot_class size : {slot_class::small, slot_class::large}) {
      if (slots_.free_for_all(size) == 0 && what == slot_use::ordinary) make_room(size);
      const slot_id slot = slots_.take(size, what);
      if (!slot) continue;
      json::writer text{slots_.buffer(slot, size)};
      const bool binary = writes_binary(write_text, text);
      if (!text.overflowed() && text.bytes() <= text_bytes_max_) {
        if (text.nonfinite() != 0) state_.counts.add(counter::nonfinite, text.nonfinite());
        finalize(slot, text.bytes(), lifetime, binary);
        return slot;
      }
      release(slot);
      if (size == slot_class::large) why = counter::too_big;
    }
    state_.counts.add(why);
    return {};
  }

  // Composes the envelope of a long message whose body is `body`, which its slot refers to from then on.
  // `write(json::writer&)` returns where in the envelope the body goes. None, counted: no slot is free.
  template <class Write>
  slot_id compose_chunked(text_id body, const message_lifetime& lifetime, rt::time_point published,
                          Write&& write) noexcept {
    const slot_id slot = slots_.take_chunked(body);
    if (!slot) {
      state_.counts.add(counter::no_slot);
      return {};
    }
    json::writer text{slots_.buffer(slot, slot_class::chunked)};
    const std::size_t at = write(text);
    assert(!text.overflowed()); // a slot has room for every envelope
    finalize_chunked(slot, text.bytes(), lifetime);
    slots_.mark_chunks(slot, at, published);
    return slot;
  }

  // Composes a message with a long value in it, whose text the slot refers to from then on. `write_text`
  // writes it with the stand-in, once, and returns the message's kind. Errors, counted: full: no slot is
  // free; too_big: all else in the message is too long, or says what the stand-in says.
  template <class WriteText>
  result<slot_id> compose_around(const long_value& value, WriteText&& write_text) noexcept {
    const slot_id slot = slots_.take_chunked(value.text);
    if (!slot) {
      state_.counts.add(counter::no_slot);
      return errc::full;
    }
    const std::span<char> into = slots_.buffer(slot, slot_class::chunked);
    json::writer text{into};
    const wire::message_kind kind = write_text(text);
    if (!text.overflowed() && leave_place(slot, text.text(), value, kind)) return slot;
    release(slot);
    state_.counts.add(counter::too_big);
    return error{errc::too_big, static_cast<std::int64_t>(text.bytes()),
                 static_cast<std::int64_t>(into.size())};
  }

  void release(slot_id slot) noexcept {
    if (slots_.release(slot)) {
      state_.due.disarm(slot);
      if (slots_.tracked(slot)) [[unlikely]]
        note(slot).ended = true;
    } else if (slots_.pinned(slot) && slots_.references(slot) == 1) [[unlikely]] {
      note(slot).ended = true;
    }
  }
  // Its timer is due: frees it if it has expired.
  void expire(slot_id slot) noexcept;
  // Whether a message is still to be sent.
  bool is_due(slot_ref which) const noexcept {
    return slots_.alive(which) && slots_.expires(which.index) >= state_.cycle.now;
  }
  // Most messages are written in the cycle that composes them, and never need the wheel. At the end of a
  // cycle this puts the others on it.
  void arm_unwritten() noexcept {
    if (unarmed_count_ != 0) arm_all_unwritten();
  }
  // Whether a message was composed that expires with this cycle. True once.
  bool take_expires_this_cycle() noexcept { return std::exchange(expires_this_cycle_, false); }

  // ---- tracking

  // Outcomes of the slot are recorded from now on. With `pins`, the caller's reference stays until the
  // message was sent once. It is no delivery: when all deliveries have ended, the message can be queued
  // again.
  void track(slot_id slot, bool pins) noexcept;
  // Ends the tracking. Frees the slot unless a frame of it is partly written; returns whether it did.
  bool cancel(slot_ref which) noexcept;
  // Releases the reference that was held for a message which was never sent: the message ends.
  void drop_pinned(slot_id slot) noexcept;
  // The whole message was written to one peer: this delivery is over, and its reference is released.
  void delivered(slot_id slot) noexcept {
    if (slots_.tracked(slot)) [[unlikely]]
      note_tracked_sent(slot);
    release(slot);
  }
  // As delivered(), but the caller releases the reference itself.
  void note_sent(slot_id slot) noexcept {
    if (slots_.tracked(slot)) [[unlikely]]
      note_tracked_sent(slot);
  }
  // The message is about to lose its last delivery by eviction.
  void note_evicted(slot_id slot) noexcept {
    if (slots_.tracked(slot)) note(slot).evicted = true;
  }
  bool has_outcomes() const noexcept { return !outcomes_.empty(); }
  // Takes the next outcome, oldest first; false: there is none.
  bool take_outcome(outcome& into) noexcept;

  // True when free slots are counted right, and only tracked slots are pinned.
  bool check() const noexcept;

 private:
  // What was recorded of a slot.
  struct tracking {
    slot_id next{};
    bool listed = false;
    bool sent = false;
    bool ended = false;
    bool evicted = false;
    bool expired = false;
  };

  void arm_all_unwritten() noexcept;
  template <class WriteText>
  static bool writes_binary(WriteText&& write_text, json::writer& into) noexcept {
    if constexpr (std::is_void_v<std::invoke_result_t<WriteText&, json::writer&>>) {
      write_text(into);
      return false;
    } else {
      return write_text(into) == wire::message_kind::binary;
    }
  }
  void watch_expiry(slot_id slot, rt::time_point expires) noexcept;
  void finalize_chunked(slot_id slot, std::size_t bytes, const message_lifetime& lifetime) noexcept;
  bool leave_place(slot_id slot, std::string_view text, const long_value& value,
                   wire::message_kind kind) noexcept;
  void finalize(slot_id slot, std::size_t bytes, const message_lifetime& lifetime, bool binary) noexcept;
  tracking& note(slot_id slot) noexcept {
    tracking& one = tracked_[slot];
    if (!std::exchange(one.listed, true)) outcomes_.push_back(tracked_, {slot});
    return one;
  }
  void note_tracked_sent(slot_id slot) noexcept;

  core_state& state_;
  const std::size_t text_bytes_max_;
  slot_pool slots_;
  std::span<slot_id> unarmed_; // slots of this cycle that expire and are not on the wheel yet
  std::uint32_t unarmed_count_ = 0;
  rows<slot_id, tracking> tracked_;
  index_queue<slot_id, tracking, &tracking::next> outcomes_;
  bool expires_this_cycle_ = false;
};

} // namespace rowe::service
