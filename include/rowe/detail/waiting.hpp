// SPDX-License-Identifier: Apache-2.0
// Where a handle's thread takes what has arrived for it, and sleeps until something does: a message or call,
// the completion of a call of its own, or room for a message. Every such sleep is on the queue pair's
// `arrival`, which the service thread notifies.
//
// The service thread ends each call at its deadline, and says so by a completion. So whoever waits for one
// allows the service thread a little longer than the deadline, and gives the call up after that.
//
// All of it is for the handle's one thread. Functions called wait_... sleep in the kernel, and so are not for
// real-time loops. take_arrived() neither waits, allocates nor enters the kernel (tests/rt_contract).
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <rowe/call_id.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/posting.hpp>
#include <rowe/detail/queue_pair.hpp>

namespace rowe::detail {

// How much longer than its own deadline a call waits for the service thread's answer. That comes within a
// poll_period (10 ms at most) and a cycle, unless the service thread is kept from its core.
inline constexpr duration word_late_max = std::chrono::milliseconds{25};

// ---- arrivals

// The next message or call that has arrived and has not expired. Expired ones are released and counted.
inline std::optional<std::uint32_t> take_arrived(queue_pair& on, time_point now) noexcept {
  const consumer_end& end = on.user.in;
  for (std::size_t left = end.ring->pending_at_least(); left != 0; --left) {
    const std::uint32_t slot = *end.ring->try_pop();
    if (!expired_at(*end.memory.header(slot), now)) return slot;
    on.expired_here.add();
    end.free_ring->release(slot);
  }
  return std::nullopt;
}

inline bool has_time_to_live(const queue_pair& on, std::uint32_t slot) noexcept {
  return on.user.in.memory.header(slot)->expires_ns != rt::nanoseconds_of(rt::never);
}

// Of a value that has a time to live: whether that is over at `*at`, or, without it, now. Counts it if so.
// Out of line, as is the next: most values have none, and taking those is to stay short.
[[gnu::noinline]] inline bool drops_expired(queue_pair& on, std::uint32_t slot,
                                            const time_point* at) noexcept {
  if (!expired_at(*on.user.in.memory.header(slot), at != nullptr ? *at : rt::monotonic_clock::now()))
    return false;
  on.expired_here.add();
  return true;
}

// `slot`, which has a time to live, or the first one behind it whose is not over. Releases those whose is.
[[gnu::noinline]] inline std::optional<std::uint32_t> first_in_time(queue_pair& on, std::uint32_t slot,
                                                                    const time_point* at) noexcept {
  const consumer_end& end = on.user.in;
  for (std::size_t left = end.ring->pending_at_least();; --left) {
    if (!has_time_to_live(on, slot) || !drops_expired(on, slot, at)) return slot;
    end.free_ring->release(slot);
    if (left == 0) return std::nullopt;
    slot = *end.ring->try_pop();
  }
}

// Waits at most `timeout` (negative: for ever) until `try_next` returns something else than `empty`. Errors:
// those of `try_next`, but timed_out in place of empty.
template <class TryNext>
auto wait_next(const pair_handle& handle, duration timeout, TryNext&& try_next) noexcept {
  auto taken = try_next();
  if (taken || taken.code() != errc::empty) return taken;
  handle->arrival.wait_until(rt::deadline_after(rt::monotonic_clock::now(), timeout), [&] {
    taken = try_next();
    return taken || taken.code() != errc::empty;
  });
  if (!taken && taken.code() == errc::empty) taken = error{errc::timed_out, 0, timeout.count()};
  return taken;
}

// ---- completions

// Waits for the completion of a call of this queue pair until `deadline`, or until the endpoint is closed. If
// none has come then, returns nothing, and the call is given up.
inline std::optional<std::uint32_t> wait_completion(queue_pair& on, call_ref call,
                                                    time_point deadline) noexcept {
  std::optional<std::uint32_t> slot;
  on.arrival.wait_until(deadline, [&] {
    slot = take_completion_of(on, call);
    return slot.has_value() || closed(on);
  });
  if (!slot) slot = take_completion_of(on, call); // what came before it closed
  if (!slot) give_up(on, call);
  return slot;
}

// Waits for the completion of a call that was started at `now` with this time-out, and a little longer.
// Errors: timed_out, closed.
inline result<std::uint32_t> wait_call(const pair_handle& on, call_id call, time_point now,
                                       duration timeout) noexcept {
  on.wake_service();
  const time_point deadline = rt::deadline_after(rt::deadline_after(now, timeout), word_late_max);
  if (const auto slot = wait_completion(*on, {call.index, call.generation}, deadline)) {
    value_header& completion = *on->user.completions.memory.header(*slot);
    if (completion.failed && completion.outcome == errc::timed_out)
      completion.outcome_limit = timeout.count(); // known only here
    return *slot;
  }
  if (closed(*on)) return on->closed_as;
  return error{errc::timed_out, 0, timeout.count()};
}

// Waits until the message or reply that `call` tracks was written, has expired, or cannot be written. Errors:
// closed, and those of the completion.
inline status wait_sent(queue_pair& on, call_ref call) noexcept {
  const auto slot = wait_completion(on, call, rt::never);
  if (!slot) return on.closed_as;
  const value_header& completion = *on.user.completions.memory.header(*slot);
  const status what = completion.failed ? status{error_of(completion)} : status{};
  release_completion(on, *slot);
  return what;
}

// ---- room

// Whether a message to `to` would be taken now.
inline bool has_room(queue_pair& on, peer_ref to) noexcept {
  return takes(on, to) && !(to.generation == 0 && crowded(on)) && on.user.out.free_ring->free_at_least() != 0;
}

// Waits until a message to `to` would be taken, `to` is gone, or the endpoint is closed; at most `timeout`
// (negative: for ever). The service thread notifies of every change once it has seen that somebody waits. It
// notifies when it sees that first, in any case: so no earlier change is missed. Errors: closed, peer_lost,
// timed_out.
inline status wait_room(const pair_handle& handle, peer_ref to, duration timeout) noexcept {
  queue_pair& on = *handle;
  if (++on.user.room_waits == 0) ++on.user.room_waits;
  // release: pairs with the acquires in take_entries() and notify_those_who_wait()
  on.room_asked.store(on.user.room_waits, std::memory_order_release);
  handle.wake_service();
  bool buffer = false;
  on.arrival.wait_until(rt::deadline_after(rt::monotonic_clock::now(), timeout), [&] {
    buffer = has_room(on, to);
    return buffer || gone(on, to) || closed(on);
  });
  on.room_asked.store(0, std::memory_order_release); // release: as above
  if (closed(on)) return on.closed_as;
  if (gone(on, to)) return errc::peer_lost;
  return buffer ? status{} : status{error{errc::timed_out, 0, timeout.count()}};
}

} // namespace rowe::detail
