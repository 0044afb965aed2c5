// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/partial_frames.hpp"

#include <cassert>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/check_sum.hpp"

namespace rowe::service {

partial_frames::partial_frames(rt::arena& memory, const partial_frames_needs& parts) noexcept
    : partial_frames_needs{parts},
      slots_{message_store_.slots()},
      frames_{memory.carve<partial_frame>(state_.bounds().connections_max)},
      aside_{memory.carve<aside_row>(aside_count(state_.bounds()))},
      free_aside_{aside_} {}

bool partial_frames::any() const noexcept {
  for (const partial_frame& frame : frames_) {
    if (frame) return true;
  }
  return false;
}

void partial_frames::begin(peer_index peer, const partial_frame& frame) noexcept {
  slots_.begin(frame.slot);
  partial_frame& now = frames_[peer];
  aside_id set_aside{};
  if (now) [[unlikely]] {
    assert(now.goes == partial_frame::way::texts && !now.mid_frame() && !frame.in_frames());
    set_aside = free_aside_.take(); // may_set_aside() said that there is one
    aside_[set_aside].frame = now;
  }
  now = frame;
  now.since = now.begun = state_.cycle.now;
  if (!set_aside) return;
  now.goes = partial_frame::way::between;
  now.number = set_aside.value;
}

bool partial_frames::advance(peer_index peer, std::size_t bytes, bool ends_frame) noexcept {
  partial_frame& frame = frames_[peer];
  frame.written += static_cast<std::uint32_t>(bytes);
  if (!ends_frame || !frame.in_frames()) return ends_frame;
  const std::size_t before = frame.done / long_fragment_bytes;
  frame.done += std::exchange(frame.fragment, 0);
  frame.written = 0;
  ++frame.number;
  if (before != frame.done / long_fragment_bytes) frame.since = state_.cycle.now; // as much time for the next
  return frame.done == frame.payload;
}

void partial_frames::end(peer_index peer) noexcept {
  const partial_frame ended = std::exchange(frames_[peer], {});
  const slot_id slot = ended.slot;
  if (ended.goes == partial_frame::way::between) [[unlikely]] {
    frames_[peer] = aside_[{ended.number}].frame;
    free_aside_.give_back({ended.number});
  }
  slots_.end(slot);
  message_store_.release(slot);
  if (waits_) look_again_from(peer.value + 1);
}

bool partial_frames::may_begin_or_wait(peer_index peer, slot_id slot) noexcept {
  if (slots_.partial(slot) != 0) return true;
  const slot_id own = frames_[peer].slot;
  if (own && !frames_[peer].diverts() && slots_.class_of(own) == slots_.class_of(slot) &&
      slots_.partial(own) == 1)
    return true; // in its place
  outbox_.of(peer).waits_to_begin = waits_ = true;
  if (!state_.due.armed(timer::partial_frames))
    state_.due.arm(timer::partial_frames, state_.cycle.now + partial_time_min);
  return false;
}

bool partial_frames::is_worth_handing_over(peer_index peer) const noexcept {
  const auto is_worth = [this](const partial_frame& one) {
    const slot_class of = one ? slots_.class_of(one.slot) : slot_class::small;
    return of == slot_class::large && (slots_.count_partial(of) >= 2 || !slots_.may_begin(of));
  };
  return is_worth(frames_[peer]) || is_worth(aside_of(frames_[peer]));
}

rt::time_point partial_frames::due_of(const partial_frame& frame) noexcept {
  const bool in_fragments = frame.in_frames() && !ROWE_MUTANT(long_stall);
  const auto bytes =
      static_cast<std::int64_t>(in_fragments ? long_fragment_bytes : slots_.message_bytes(frame.slot));
  const rt::duration for_bytes = rt::duration{std::chrono::seconds{bytes}} / partial_bytes_per_second;
  return frame.since + partial_time_min + for_bytes;
}

// Never, if nobody waits for its slot.
rt::time_point partial_frames::due_for_others(const partial_frame& frame) noexcept {
  return !frame || slots_.may_begin(slots_.class_of(frame.slot))
             ? rt::never
             : std::max(due_of(frame), state_.cycle.awake_since + partial_time_min);
}

const partial_frame* partial_frames::long_of(peer_index peer) const noexcept {
  const partial_frame& now = frames_[peer];
  if (!state_.peers[peer].open() || !now) return nullptr;
  if (now.in_frames()) return &now;
  return aside_of(now) ? &aside_of(now) : nullptr;
}

slot_id partial_frames::first_long() const noexcept {
  const partial_frame* first = nullptr;
  for (const peer_index peer : frames_.ids()) {
    const partial_frame* const its = long_of(peer);
    if (its != nullptr && (first == nullptr || its->begun < first->begun)) first = its;
  }
  return first != nullptr ? first->slot : slot_id{};
}

bool partial_frames::is_slow(peer_index peer, slot_id spared) const noexcept {
  const partial_frame* const its = long_of(peer);
  return its != nullptr && its->slot != spared && !slots_.may_begin(slots_.class_of(its->slot)) &&
         is_slow_reader(its->done, state_.cycle.waited_since(its->begun));
}

// Begins with one peer, so the peer that held up the others comes last.
void partial_frames::look_again_from(std::uint32_t first) noexcept {
  waits_ = false; // until one finds that it may not
  for (std::uint32_t i = 0; i < state_.peers.size(); ++i) {
    const peer_index peer{(first + i) % state_.peers.size()};
    if (std::exchange(outbox_.of(peer).waits_to_begin, false)) outbox_.schedule(peer);
  }
}

bool partial_frames::check() const noexcept {
  std::uint64_t partial = 0;
  std::uint64_t counted = 0;
  std::uint32_t set_aside = 0;
  for (const peer_index i : frames_.ids()) {
    const partial_frame& now = frames_[i];
    const partial_frame& aside = aside_of(now);
    for (const partial_frame* frame : {&now, &aside}) {
      if (*frame) partial += weight(frame->slot);
    }
    set_aside += aside ? 1U : 0U;
    if (aside && (aside.goes != partial_frame::way::texts || aside.mid_frame())) return false;
  }
  if (set_aside != free_aside_.in_use()) return false;
  for (const slot_id slot : slots_.ids()) counted += weight(slot) * slots_.partial(slot);
  return partial == counted;
}

} // namespace rowe::service
