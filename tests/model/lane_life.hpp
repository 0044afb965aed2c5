// SPDX-License-Identifier: Apache-2.0
// The life of a lane and the end of an endpoint, as far as threads meet there. The sources are not written
// against the atomics policy, so this is what they do with the words they share, statement by statement;
// lane_life_test.cpp compares: every access here must still stand in the file that its function names. Rings
// and notifications are the real ones.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/detail/lane.hpp>
#include <rowe/rt/home_ring.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "model/atomics.hpp"

namespace rowe::model {

using detail::audience;
using detail::lane_state;
using number_ring = rt::spsc_ring<std::uint32_t, atomics>;
using numbers_home = rt::home_ring<atomics>;

// A path of a lane.
struct path {
  std::array<number_ring::entry, 4> entries;
  number_ring queue{entries};
  number_ring::producer& in{*queue.take_producer()};
  number_ring::consumer& out{*queue.take_consumer()};
};

struct modelled_lane {
  atomics::variable<lane_state> state{lane_state::free};
  atomics::plain<std::uint32_t> answer; // why it was refused
  atomics::plain<std::uint32_t> built;  // all that set-up writes: name, slots, codecs; here the life's number
  atomics::variable<audience> heard_by{audience::nobody};
  rt::notification<atomics, futex> news;
  path to_service;
  path to_handle;
  std::array<numbers_home::entry, 2> home_entries; // where the numbers come back to that went to the handle
  numbers_home home_ring{home_entries, 2};
  numbers_home::producer& home{*home_ring.take_producer()};
  numbers_home::consumer& came_home{*home_ring.take_consumer()};
};

// ---- endpoint_state.cpp

// settle_lanes()
inline void settle(modelled_lane& one) {
  if (one.state.load(std::memory_order_acquire) != lane_state::closing) return;
  one.news.wait_until(rt::never, [&] {
    return one.state.load(std::memory_order_acquire) != lane_state::closing; // pairs with leave_lane()
  });
}

// open_lane(), with find_lane() and build_lane(). Nothing when no lane is free; else why it was refused, or
// 0.
inline std::optional<std::uint32_t> open_lane(modelled_lane& built, bell& service, std::uint32_t life) {
  settle(built);
  if (built.state.load(std::memory_order_acquire) != lane_state::free) return std::nullopt; // find_lane()
  built.built.store(life);
  built.state.store(lane_state::offered, std::memory_order_release);
  service.ring();
  lane_state answered = lane_state::offered;
  built.news.wait_until(rt::never, [&] {
    answered = built.state.load(std::memory_order_acquire);
    return answered != lane_state::offered;
  });
  if (answered == lane_state::active) return 0;
  const std::uint32_t why = built.answer.load();
  built.state.store(lane_state::free, std::memory_order_release);
  return why;
}

// close_lane()
inline void close_lane(modelled_lane& gone, bell& service) {
  gone.state.store(lane_state::closing, std::memory_order_release);
  service.ring();
}

// close(), when the service thread is joined.
inline void close_handles(modelled_lane& one) {
  one.heard_by.store(audience::closed, std::memory_order_release);
  one.news.notify();
}

// ---- lane.hpp, calls.hpp

// publish_into()
inline bool publish(modelled_lane& on, std::uint32_t value) {
  if (on.heard_by.load(std::memory_order_relaxed) != audience::somebody) return false;
  (void)on.built.load();
  return on.to_service.in.try_push(value);
}

// closed()
inline bool closed(const modelled_lane& on) {
  return on.heard_by.load(std::memory_order_acquire) == audience::closed;
}

// subscriber::take(), lane::receive(): wait_next() with a try_next() that looks whether it is over first.
inline std::optional<std::uint32_t> take_or_closed(modelled_lane& on) {
  std::optional<std::uint32_t> taken;
  bool over = false;
  on.news.wait_until(rt::never, [&] {
    over = closed(on);
    taken = on.to_handle.out.try_pop();
    return taken || over;
  });
  return taken;
}

// ---- lane_home.hpp

inline bool all_home(modelled_lane& gone) {
  const std::uint64_t popped = gone.to_handle.in.popped();
  return gone.came_home.given() == popped;
}

// ---- lanes.cpp

// core::take_from_lanes() with attach(), take_from(), detach() and leave_lane(). True when a lane went back.
template <class Take>
bool turn_lane(modelled_lane& lane, std::uint32_t refuse_with, Take take) {
  const auto take_all = [&] {
    (void)lane.built.load();
    while (const auto value = lane.to_service.out.try_pop()) take(*value);
  };
  switch (lane.state.load(std::memory_order_acquire)) {
  case lane_state::free:
  case lane_state::refused: return false;
  case lane_state::offered:
    (void)lane.built.load();
    if (refuse_with != 0) {
      lane.answer.store(refuse_with);
    } else {
      lane.heard_by.store(audience::somebody, std::memory_order_relaxed);
    }
    lane.state.store(refuse_with != 0 ? lane_state::refused : lane_state::active, std::memory_order_release);
    lane.news.notify();
    return false;
  case lane_state::active: take_all(); return false;
  case lane_state::closing:
    take_all();
    lane.heard_by.store(audience::nobody, std::memory_order_relaxed);
    break;
  case lane_state::held:
    if (!all_home(lane)) return false;
    break;
  }
  const lane_state as = all_home(lane) ? lane_state::free : lane_state::held;
  lane.state.store(as, std::memory_order_release);
  lane.news.notify();
  return as == lane_state::free;
}

// announce(), update_wanted(), receiver(): what a lane's life has written is looked at in lanes that are
// attached, and in no others: set-up may be building those. `attached` is the service thread's own.
inline void look_at_each(std::span<modelled_lane> lanes, std::span<const bool> attached) {
  for (std::size_t i = 0; i != lanes.size(); ++i) {
    if (!attached[i]) continue;
    require(lanes[i].built.load() != 0, "an attached lane is built");
  }
}

// ---- service_loop.cpp

struct modelled_loop {
  atomics::variable<std::int64_t> drain_until_ns{INT64_MAX};
  bell wakes;

  // run(): cycles until it was told to stop. `idle` waits. A cycle begins with transport::poll(), which takes
  // what ended the wait, and whatever was rung since.
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
    wakes.ring();
  }
};

} // namespace rowe::model
