// SPDX-License-Identifier: Apache-2.0
#include "service/partial_frames.hpp"

#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/check_sum.hpp"
#include "service/service_limits.hpp"

namespace rowe::service {

partial_frames::partial_frames(rt::arena& memory, const needs& parts) noexcept
    : state_{parts.state},
      message_store_{parts.message_store},
      slots_{parts.message_store.slots()},
      outbox_{parts.outbox},
      frames_{memory.carve<partial_frame>(state_.bounds().connections_max)} {}

bool partial_frames::any() const noexcept {
  for (const partial_frame& frame : frames_) {
    if (frame) return true;
  }
  return false;
}

void partial_frames::begin(peer_index peer, const partial_frame& frame) noexcept {
  slots_.begin(frame.slot);
  frames_[peer] = frame;
  frames_[peer].since = state_.cycle.now;
}

bool partial_frames::advance(peer_index peer, std::size_t bytes, bool ends_frame) noexcept {
  partial_frame& frame = frames_[peer];
  frame.written += bytes;
  if (!ends_frame || !frame.is_long()) return ends_frame;
  frame.done += std::exchange(frame.fragment, 0);
  frame.written = 0;
  frame.since = state_.cycle.now; // it has as much time for the next fragment
  return frame.done == frame.payload;
}

void partial_frames::end(peer_index peer) noexcept {
  const slot_id slot = std::exchange(frames_[peer], {}).slot;
  slots_.end(slot);
  message_store_.release(slot);
  if (waits_) look_again_from(peer.value + 1);
}

bool partial_frames::may_begin_or_wait(peer_index peer, slot_id slot) noexcept {
  if (slots_.partial(slot) != 0) return true;
  const slot_id own = frames_[peer].slot;
  if (own && slots_.class_of(own) == slots_.class_of(slot) && slots_.partial(own) == 1)
    return true; // in its place
  outbox_.of(peer).waits_to_begin = waits_ = true;
  if (!state_.due.armed(timer::partial_frames))
    state_.due.arm(timer::partial_frames, state_.cycle.now + partial_time_min);
  return false;
}

bool partial_frames::is_worth_handing_over(peer_index peer) const noexcept {
  const slot_class of = slots_.class_of(frames_[peer].slot);
  return of == slot_class::large && (slots_.count_partial(of) >= 2 || !slots_.may_begin(of));
}

rt::time_point partial_frames::due_of(const partial_frame& frame) noexcept {
  const bool in_fragments = frame.is_long() && !ROWE_MUTANT(long_stall);
  const auto bytes =
      static_cast<std::int64_t>(in_fragments ? long_fragment_bytes : slots_.message_bytes(frame.slot));
  const rt::duration for_bytes = rt::duration{std::chrono::seconds{bytes}} / partial_bytes_per_second;
  return frame.since + partial_time_min + for_bytes;
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
  for (const partial_frame& frame : frames_) {
    if (frame) partial += weight(frame.slot);
  }
  for (const slot_id slot : slots_.ids()) counted += weight(slot) * slots_.partial(slot);
  return partial == counted;
}

} // namespace rowe::service
