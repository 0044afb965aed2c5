// SPDX-License-Identifier: Apache-2.0
// What the service thread shows to the other threads of the process: counters, how many peers there are, and
// events.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/detail/lane.hpp>
#include <rowe/event.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "service/counters.hpp"

namespace rowe::service {

class board {
  using events = rt::spsc_ring<event>;

 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<events::entry>(events::places_for(bounds.events_max));
  }
  board(rt::arena& memory, const limits& bounds) noexcept
      : events_{memory.carve<events::entry>(events::places_for(bounds.events_max))},
        writer_{events_.take_producer()},
        reader_{events_.take_consumer()} {}

  // Service thread.
  void post(const event& what) noexcept {
    if (!writer_->try_push(what)) counts.add(counter::events_lost);
  }
  void set_peers(std::uint32_t count) noexcept {
    // release: pairs with acquire in peers()
    peers_.store(count, std::memory_order_release);
    peers_changed.notify();
  }

  // One other thread at a time.
  std::optional<event> try_event() noexcept { return reader_->try_pop(); }

  // Any thread.
  std::uint32_t peers() const noexcept {
    return peers_.load(std::memory_order_acquire); // acquire: pairs with release in set_peers()
  }

  counters counts;
  rt::notification<> peers_changed;

 private:
  events events_;
  events::producer* writer_;
  events::consumer* reader_;
  rt::std_atomics::variable<std::uint32_t> peers_{0};
};

// A counter with the part of it that user threads count in their lanes. Any thread.
inline std::uint64_t read_count(const board& shown, std::span<const detail::lane> lanes,
                                counter which) noexcept {
  std::uint64_t sum = shown.counts.read(which);
  if (which != counter::full && which != counter::no_peer && which != counter::too_big) return sum;
  for (const detail::lane& lane : lanes) {
    // acquire: pairs with the release in detach(), which has added a free lane's counts to the board's
    if (lane.state.load(std::memory_order_acquire) == detail::lane_state::free) continue;
    sum += which == counter::full      ? lane.refused_full.get()
           : which == counter::no_peer ? lane.no_peer.get()
                                       : lane.refused_too_big.get();
  }
  return sum;
}

} // namespace rowe::service
