// SPDX-License-Identifier: Apache-2.0
// The life of a queue pair and the end of an endpoint, as far as threads meet there. What is shared is the
// real thing: rowe/detail/pair_lifecycle.hpp, rings and notifications. Around it this does what the sources
// do that each function names, in their order; of what those are not written against the atomics policy for,
// pair_life_test.cpp compares the text.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/detail/pair_lifecycle.hpp>
#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "model/atomics.hpp"

namespace rowe::model {

using detail::audience;
using detail::pair_phase;
using number_ring = rt::spsc_ring<std::uint32_t, atomics>;
using number_free_ring = rt::free_ring<atomics>;

// A queue of a queue pair.
struct modelled_queue {
  std::array<number_ring::entry, 4> entries;
  number_ring queue{entries};
  number_ring::producer& in{*queue.take_producer()};
  number_ring::consumer& out{*queue.take_consumer()};
};

struct modelled_pair {
  detail::pair_lifecycle<atomics, futex> lifecycle;
  atomics::plain<std::uint32_t> built; // all that set-up writes: name, slots, codecs; here the life's number
  detail::audience_word<atomics> audience;
  rt::notification<atomics, futex> arrival;
  modelled_queue to_service;
  modelled_queue to_handle;
  std::array<number_free_ring::entry, 2> free_entries; // for the slots that went to the handle
  number_free_ring free_ring{free_entries, 2};
  number_free_ring::producer& free_ring_in{*free_ring.take_producer()};
  number_free_ring::consumer& free_ring_out{*free_ring.take_consumer()};
};

// ---- endpoint_state.cpp

// open_pair(), with release_pairs(), find_pair() and build_pair(). Errors: too_many_handles, and what it was
// refused with.
inline status open_pair(modelled_pair& built, event_fd& service, std::uint32_t life) {
  built.lifecycle.wait_while_closing(built.arrival, rt::never);
  if (!built.lifecycle.is_free()) return errc::too_many_handles;
  built.built.store(life);
  built.lifecycle.offer();
  service.signal();
  return built.lifecycle.wait_answer(built.arrival);
}

// close_pair()
inline void close_pair(modelled_pair& gone, event_fd& service) {
  gone.lifecycle.close();
  service.signal();
}

// close(), when the service thread is joined.
inline void close_handles(modelled_pair& one) {
  one.audience.close();
  one.arrival.notify();
}

// ---- queue_pair.hpp, waiting.hpp

// publish_into()
inline bool publish(modelled_pair& on, std::uint32_t value) {
  if (on.audience.advice() != audience::somebody) return false;
  (void)on.built.load();
  return on.to_service.in.try_push(value);
}

// subscriber::take(), lane::receive(): wait_next() with a try_next() that looks whether it is over first.
inline std::optional<std::uint32_t> take_or_closed(modelled_pair& on) {
  std::optional<std::uint32_t> taken;
  bool over = false;
  on.arrival.wait_until(rt::never, [&] {
    over = on.audience.closed();
    taken = on.to_handle.out.try_pop();
    return taken || over;
  });
  return taken;
}

// ---- pair_release.hpp

inline bool all_slots_released(modelled_pair& gone) {
  const std::uint64_t popped = gone.to_handle.in.popped();
  return gone.free_ring_out.released() == popped;
}

// ---- handle_registry.cpp

// handle_registry::scan() with attach() and detach(), and what handles submit. True when a queue pair went
// back.
template <class Take>
bool turn_pair(modelled_pair& pair, const status& answer, Take take) {
  const auto take_all = [&] {
    (void)pair.built.load();
    while (const auto value = pair.to_service.out.try_pop()) take(*value);
  };
  switch (pair.lifecycle.look()) {
  case pair_phase::free:
  case pair_phase::refused: return false;
  case pair_phase::offered:
    (void)pair.built.load();
    if (!answer) {
      pair.lifecycle.refuse(answer.error(), pair.arrival);
    } else {
      pair.audience.set(audience::somebody);
      pair.lifecycle.accept(pair.arrival);
    }
    return false;
  case pair_phase::active: take_all(); return false;
  case pair_phase::closing:
    take_all();
    pair.audience.set(audience::nobody);
    if (all_slots_released(pair)) break;
    pair.lifecycle.hold(pair.arrival);
    return false;
  case pair_phase::held:
    if (!all_slots_released(pair)) return false;
    break;
  }
  pair.lifecycle.release(pair.arrival);
  return true;
}

// handle_registry::announce_all(), audiences::update(), receiver::first_but(): what a queue pair's life has
// written is looked at in queue pairs that are attached, and in no others: set-up may be building those.
// `attached` is the service thread's own.
inline void look_at_each(std::span<modelled_pair> pairs, std::span<const bool> attached) {
  for (std::size_t i = 0; i != pairs.size(); ++i) {
    if (!attached[i]) continue;
    require(pairs[i].built.load() != 0, "an attached pair is built");
  }
}

// ---- service_loop.cpp

struct modelled_loop {
  atomics::variable<std::int64_t> drain_until_ns{INT64_MAX};
  event_fd wakes;

  // run(): cycles until it was told to stop. `idle` waits. A cycle begins with transport::poll(), which takes
  // what ended the wait, and whatever was signalled since.
  template <class Cycle>
  void run(Cycle cycle) {
    for (bool stops = false;;) {
      wakes.poll();
      cycle();
      if (stops) return;
      stops = drain_until_ns.load(std::memory_order_acquire) != INT64_MAX;
      if (!stops) wakes.wait();
    }
  }
  // stop()
  void stop() {
    drain_until_ns.store(0, std::memory_order_release);
    wakes.signal();
  }
};

} // namespace rowe::model
