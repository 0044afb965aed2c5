// SPDX-License-Identifier: Apache-2.0
// Encoded messages, from the moment they are composed until nobody needs them any more. A message lies in one
// slot, however many queues have its number; who gives the last reference back frees it. When its time is
// over it is freed whoever still has it queued. The clock decides that, at the point of use; the wheel only
// gives back the slots that nobody came to send.
//
// Nothing here knows who waits to hear what becomes of a message. A slot may be tracked: then outcomes are
// noted, and whoever tracks it takes them later.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/counters.hpp"
#include "service/cycle_state.hpp"
#include "service/index_list.hpp"
#include "service/timers.hpp"
#include "service/wire_slots.hpp"
#include "json/writer.hpp"

namespace rowe::service {

// What became of a tracked message since the last look.
struct outcome {
  std::uint32_t slot = no_index;
  bool sent = false;    // one peer was given all of it
  bool ended = false;   // no delivery of it is left
  bool evicted = false; // ended, to make room for others
  bool expired = false; // its time was over; its slot is free
};

class message_store {
 public:
  struct needs {
    cycle_state& cycle;
    counters& counts;
    timers& due;
    std::size_t text_bytes_max; // of one message
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  message_store(rt::arena& memory, const limits& bounds, const needs& parts) noexcept;

  wire_slots& slots() noexcept { return slots_; }
  const wire_slots& slots() const noexcept { return slots_; }
  std::size_t text_bytes_max() const noexcept { return text_bytes_max_; }

  // The whole text of one message, which `write_text(json::writer&)` writes, perhaps twice, in a slot with
  // one reference; no_index, counted, when there is no slot or none is large enough. Tried in a small slot
  // first. Where all of a class are taken, `make_room(slot_class)` may free one. What the stop needs may take
  // the last slot, and nobody makes room for it.
  template <class WriteText, class MakeRoom>
  std::uint32_t compose(rt::time_point expires, WriteText&& write_text, slot_use what,
                        MakeRoom&& make_room) noexcept {
    counter why = counter::no_slot;
    for (const slot_class size : {slot_class::small, slot_class::large}) {
      if (slots_.free_for_all(size) == 0 && what == slot_use::ordinary) make_room(size);
      const auto slot = slots_.take(slots_.bytes_of(size), what);
      if (!slot) continue;
      json::writer text{slots_.room(*slot)};
      write_text(text);
      if (!text.overflowed() && text.bytes() <= text_bytes_max_) {
        if (text.nonfinite() != 0) counts_.add(counter::nonfinite, text.nonfinite());
        finalize(*slot, text.bytes(), expires);
        return *slot;
      }
      release(*slot);
      if (size == slot_class::large) why = counter::too_big;
    }
    counts_.add(why);
    return no_index;
  }

  void release(std::uint32_t slot) noexcept {
    if (slots_.release(slot)) {
      due_.disarm(slot_id{slot});
      if (slots_.tracked(slot)) [[unlikely]]
        note(slot).ended = true;
    } else if (slots_.kept(slot) && slots_.references(slot) == 1) [[unlikely]] {
      note(slot).ended = true;
    }
  }
  // Its time may be over.
  void expire(std::uint32_t slot) noexcept;
  // Whether a message is to be sent still.
  bool is_due(slot_ref which) const noexcept {
    return slots_.alive(which) && slots_.expires(which.index) >= cycle_.now;
  }
  // Most messages are written in the cycle that makes them and never need the wheel. The others come to it
  // here, at the end of a cycle.
  void arm_unwritten() noexcept {
    if (unarmed_count_ != 0) arm_all_unwritten();
  }
  // Whether something was composed in this cycle that lives no longer; once.
  bool take_lives_no_longer() noexcept { return std::exchange(lives_no_longer_, false); }

  // ---- tracking

  // Outcomes of the slot are noted from now on. With `keeps` the caller's reference stays, which is no
  // delivery, until the message was sent once: it can be queued again where all its deliveries ended.
  void track(std::uint32_t slot, bool keeps) noexcept;
  // Nobody wants to know any more. Frees the slot unless a frame of it is partly written; says whether it
  // did.
  bool cancel(slot_ref which) noexcept;
  // Of a kept one that was not sent: it ends.
  void let_go(std::uint32_t slot) noexcept;
  // One peer was given all of it: its delivery, a reference, is over.
  void delivered(std::uint32_t slot) noexcept {
    if (slots_.tracked(slot)) [[unlikely]]
      note_tracked_sent(slot);
    release(slot);
  }
  // The same where the reference is given back apart.
  void note_sent(std::uint32_t slot) noexcept {
    if (slots_.tracked(slot)) [[unlikely]]
      note_tracked_sent(slot);
  }
  // It is about to lose its last delivery, to make room.
  void note_evicted(std::uint32_t slot) noexcept {
    if (slots_.tracked(slot)) note(slot).evicted = true;
  }
  bool has_outcomes() const noexcept { return !outcomes_.empty(); }
  // The next one, in the order in which they came about; false when there is none.
  bool take_outcome(outcome& into) noexcept;

  // True when free slots are counted right, and only tracked ones are kept.
  bool check() const noexcept;

 private:
  // What was noted of a slot.
  struct tracking {
    slot_id next{};
    bool listed = false;
    bool sent = false;
    bool ended = false;
    bool evicted = false;
    bool expired = false;
  };

  void arm_all_unwritten() noexcept;
  void finalize(std::uint32_t slot, std::size_t bytes, rt::time_point expires) noexcept;
  tracking& note(std::uint32_t slot) noexcept {
    tracking& one = tracked_[slot_id{slot}];
    if (!std::exchange(one.listed, true)) outcomes_.push_back(tracked_, {slot});
    return one;
  }
  void note_tracked_sent(std::uint32_t slot) noexcept;

  const std::size_t text_bytes_max_;
  cycle_state& cycle_;
  counters& counts_;
  timers& due_;
  wire_slots slots_;
  std::span<std::uint32_t> unarmed_; // slots with an end that are not on the wheel yet: in this cycle
  std::uint32_t unarmed_count_ = 0;
  rows<slot_id, tracking> tracked_;
  index_queue<slot_id, tracking, &tracking::next> outcomes_;
  bool lives_no_longer_ = false;
};

} // namespace rowe::service
