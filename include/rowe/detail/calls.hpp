// SPDX-License-Identifier: Apache-2.0
// The user's side of handles that send messages, call and answer: sending, the table of a handle's own calls,
// taking what arrived, and taking the completions of calls.
//
// The service thread completes each call once: with a reply, with an error, or at its deadline. A call has a
// row in its handle's table from its start until the slot of its completion is released. `completions` has as
// many slots as the table has rows, so the service thread always finds one, and no completion can be lost.
// The row's generation is odd while the call is open; taking the completion makes it even.
//
// A user that gives up earlier marks the row, and the completion is dropped when it arrives. The service
// thread is not told: the call ends at its deadline at the latest. Each function that takes, awaits or gives
// up a call drops such completions; so do calls that wait and find no row. So the row becomes free whatever
// its handle does next. Starting a call does not look at completions: each start would take half as long
// again.
//
// All of it is for the handle's one thread. No function waits, allocates or enters the kernel, and each takes
// steps bounded by the pair's depths, unless it says otherwise. The exercises of the handles that are made of
// these show it (tests/rt_contract).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

#include <rowe/call_id.hpp>
#include <rowe/connection.hpp>
#include <rowe/detail/mutation_points.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/message.hpp>

namespace rowe::detail {

// The longest diagnostic of a refusal that is passed on; a longer one is cut. Slots for replies have at least
// this capacity.
inline constexpr std::size_t diagnostic_bytes_max = 192;

// How much longer than its own deadline a call waits for the service thread's word: that comes within a
// poll_period (10 ms at most) and a cycle, unless the service thread is kept from its core.
inline constexpr duration word_late_max = std::chrono::milliseconds{25};

inline bool closed(const queue_pair& on) noexcept { return on.audience.closed(); }

constexpr peer_ref ref_of(connection c) noexcept { return {c.index, c.generation}; }

// Whether a connection has ended since it was named. No connection never does.
inline bool gone(const queue_pair& on, peer_ref whom) noexcept {
  if (whom.generation == 0) return false;
  if (whom.index >= on.peer_generations.size()) return true; // of another endpoint
  // relaxed: pairs with the stores in shared_state::set_connection(); advice, which the service thread checks
  // again
  return on.peer_generations[whom.index].load(std::memory_order_relaxed) != whom.generation;
}

// Whether messages to a connection are taken. No connection: to everyone, see crowded().
inline bool takes(const queue_pair& on, peer_ref whom) noexcept {
  if (whom.generation == 0) return true;
  if (whom.index >= on.peers_taking.size()) return false; // of another endpoint
  // relaxed: pairs with the stores in shared_state::set_taking(); advice, which the service thread checks
  // again
  return on.peers_taking[whom.index].load(std::memory_order_relaxed) == whom.generation;
}

// When a message with this time to live expires: 0 means in the cycle that takes it, negative never.
constexpr time_point expiry_after(time_point now, duration ttl) noexcept {
  return rt::deadline_after(now, ttl);
}

inline bool expired_at(const value_header& what, time_point now) noexcept {
  return what.expires_ns <= rt::nanoseconds_of(now);
}

// ---- out

// The header of a message: what goes to `to` and is dropped when it was not written at `expires`.
constexpr value_header message_header(entry what, peer_ref to, time_point now, time_point expires) noexcept {
  value_header made;
  made.stamped_ns = rt::nanoseconds_of(now);
  made.expires_ns = rt::nanoseconds_of(expires);
  made.peer = to;
  made.what = what;
  return made;
}

// Pushes a slot that was taken from `out`'s free ring. False only when a second thread uses the handle: the
// ring has places for all slots twice.
inline bool post_slot(queue_pair& on, std::uint32_t slot, value_header header, const void* value,
                      std::size_t bytes) noexcept {
  const producer_end& end = on.user.out;
  header.bytes = static_cast<std::uint32_t>(bytes);
  *end.slots.header(slot) = header;
  if (bytes != 0) std::memcpy(end.slots.value(slot), value, bytes);
  on.published.add();
  if (!end.ring->try_push(slot)) return false;
  announce(on);
  return true;
}

// Whether so much fits into a slot of `out`. Errors: too_big, counted.
inline status check_fits(queue_pair& on, std::size_t bytes) noexcept {
  const std::size_t bytes_max = on.user.out.slots.bytes_max;
  if (bytes <= bytes_max) return {};
  on.refused_too_big.add();
  return error{errc::too_big, static_cast<std::int64_t>(bytes), static_cast<std::int64_t>(bytes_max)};
}
// Of a message that needed more than its own `capacity`.
inline error outgrew(queue_pair& on, std::size_t capacity) noexcept {
  on.refused_too_big.add();
  const auto limit = static_cast<std::int64_t>(capacity);
  return {errc::too_big, limit + 1, limit}; // at least one more
}
inline status check_fits(queue_pair& on, const body& text) noexcept {
  if (text.outgrown() == 0) return check_fits(on, text.text().size());
  return outgrew(on, text.outgrown());
}

// With what `full` is about, where it is that.
inline error with_depth(const queue_pair& on, errc why) noexcept {
  return why == errc::full ? error{why, 0, on.user.out.count} : error{why};
}

// Why a message to this connection is not taken. Errors: closed, peer_lost; full, counted.
[[gnu::noinline, gnu::cold]] inline errc turned_away(queue_pair& on, peer_ref whom) noexcept {
  if (closed(on)) return errc::closed;
  if (gone(on, whom)) return errc::peer_lost;
  on.refused_full.add();
  return errc::full;
}

// post() where it is not closed. Always in line: it stands twice, and a loop would pay for a call.
[[gnu::always_inline]] inline status post_open(queue_pair& on, const value_header& header, const void* value,
                                               std::size_t bytes) noexcept {
  if (const status fits = check_fits(on, bytes); !fits) return fits;
  const auto slot = on.user.out.free_ring->try_take();
  if (!slot) {
    on.refused_full.add();
    return error{errc::full, 0, on.user.out.count};
  }
  if (!post_slot(on, *slot, header, value, bytes)) return errc::misuse;
  return {};
}

// Hands `bytes` at `value` to the service thread. Errors: closed, too_big, full, misuse; full and too_big are
// counted.
inline status post(queue_pair& on, const value_header& header, const void* value,
                   std::size_t bytes) noexcept {
  if (closed(on)) return errc::closed;
  return post_open(on, header, value, bytes);
}

inline status post(queue_pair& on, const value_header& header, const body& text) noexcept {
  if (const status fits = check_fits(on, text); !fits) return fits;
  return post(on, header, text.text().data(), text.text().size());
}

// ---- the queue pair's own calls

inline void release_row(queue_pair& on, std::uint32_t index) noexcept {
  on.user.calls[index].next_free = on.user.free_call;
  on.user.free_call = index;
  --on.user.calls_open;
}

// Releases the slot of a completion, and the call's row with it.
inline void release_completion(queue_pair& on, std::uint32_t slot) noexcept {
  const std::uint32_t index = on.user.completions.slots.header(slot)->own.index;
  on.user.completions.free_ring->release(slot);
  release_row(on, index);
}

// Closes the call that this completes. False when the call was given up; then the slot is released.
inline bool accept_completion(queue_pair& on, std::uint32_t slot) noexcept {
  pending_call& row = on.user.calls[on.user.completions.slots.header(slot)->own.index];
  ++row.generation;
  if (!row.cancelled) return true;
  release_completion(on, slot);
  return false;
}

// For a caller that does not take this completion now: drops it if its call was given up, else parks it until
// take_completion().
inline void park_completion(queue_pair& on, std::uint32_t slot) noexcept {
  const pending_call& row = on.user.calls[on.user.completions.slots.header(slot)->own.index];
  if (row.cancelled) {
    (void)accept_completion(on, slot);
  } else {
    on.user.parked_completions.push(slot);
  }
}

// Releases the rows of calls that were given up and are completed; parks other completions, in their order.
// At most as many steps as there are rows.
[[gnu::noinline, gnu::cold]] inline void drop_unwanted_completions(queue_pair& on) noexcept {
  queue_pair::user_side& mine = on.user;
  for (std::uint32_t left = mine.parked_completions.count; left != 0; --left)
    park_completion(on, mine.parked_completions.pop());
  for (std::size_t left = mine.completions.ring->pending_at_least(); left != 0; --left)
    park_completion(on, *mine.completions.ring->try_pop());
}

// A row for a call, now open. Errors: too_many_calls.
inline result<call_ref> begin_call(queue_pair& on) noexcept {
  queue_pair::user_side& mine = on.user;
  if (mine.free_call == mine.calls.size()) {
    return error{errc::too_many_calls, mine.calls_open, static_cast<std::int64_t>(mine.calls.size())};
  }
  const std::uint32_t index = mine.free_call;
  pending_call& row = mine.calls[index];
  mine.free_call = row.next_free;
  ++row.generation;
  row.cancelled = false;
  ++mine.calls_open;
  return call_ref{index, row.generation};
}

// Before begin_call(), for calls that wait: releases rows of calls that were given up, if none is free.
inline void reclaim_rows(queue_pair& on) noexcept {
  if (on.user.free_call == on.user.calls.size() && !ROWE_MUTANT(given_up_places))
    drop_unwanted_completions(on);
}

// Takes back a call that never left.
inline void withdraw_call(queue_pair& on, call_ref call) noexcept {
  ++on.user.calls[call.index].generation;
  release_row(on, call.index);
}

inline bool open(const queue_pair& on, call_ref call) noexcept {
  return call.generation % 2 == 1 && call.index < on.user.calls.size() &&
         on.user.calls[call.index].generation == call.generation;
}

// Gives the call up: its completion will be dropped. Does nothing for a call that is complete.
inline void give_up(queue_pair& on, call_ref call) noexcept {
  if (open(on, call)) on.user.calls[call.index].cancelled = true;
}
// The same for a user, who may call nothing else afterwards: so it also drops the completions that have
// arrived for calls that were given up.
inline void cancel(queue_pair& on, call_ref call) noexcept {
  give_up(on, call);
  drop_unwanted_completions(on);
}

// Begins a call, posts `value`, which then names it. Errors: as begin_call() and post().
template <class... Value>
result<call_ref> start_call(queue_pair& on, value_header header, const Value&... value) noexcept {
  if (closed(on)) return errc::closed;
  const auto call = begin_call(on);
  if (!call) return call;
  header.own = *call;
  if (const status sent = post(on, header, value...); !sent) {
    withdraw_call(on, *call);
    return sent.error();
  }
  return call;
}

// Whether a message to everyone is refused: such messages have half of the slots that the lane may park.
inline bool crowded(const queue_pair& on) noexcept { return on.audience.advice() == audience::crowded; }

// post_to() where not simply everything is handed over; `empty`: it was. What it is given comes by value: a
// header whose address is passed on would lie in memory for every message.
[[gnu::noinline, gnu::cold]] inline errc post_barred(queue_pair& on, peer_ref to, std::string_view text,
                                                     std::int64_t stamped_ns,
                                                     std::int64_t expires_ns) noexcept {
  if (crowded(on) && to.generation == 0) {
    on.refused_full.add();
    return errc::full;
  }
  value_header header;
  header.stamped_ns = stamped_ns;
  header.expires_ns = expires_ns;
  header.peer = to;
  const status done = post(on, header, text.data(), text.size());
  return done ? errc::empty : done.code();
}

// Posts a message, or begins a call with one, unless its addressee is known to be gone, or to have its share
// of what waits. Errors: peer_lost, full, and those of post() and start_call().
inline status post_to(queue_pair& on, connection to, const body& text, const value_header& header) noexcept {
  if (!takes(on, ref_of(to))) [[unlikely]]
    return with_depth(on, turned_away(on, ref_of(to)));
  if (const status fits = check_fits(on, text); !fits) return fits;
  if (on.audience.look() != audience::somebody) [[unlikely]] {
    const errc done = post_barred(on, ref_of(to), text.text(), header.stamped_ns, header.expires_ns);
    return done == errc::empty ? status{} : status{with_depth(on, done)};
  }
  return post_open(on, header, text.text().data(), text.text().size());
}
inline result<call_ref> start_call_to(queue_pair& on, connection to, const body& text,
                                      const value_header& header) noexcept {
  if (!takes(on, ref_of(to))) [[unlikely]]
    return with_depth(on, turned_away(on, ref_of(to)));
  return start_call(on, header, text);
}

// A call as its handle's user knows it.
inline result<call_id> named(const result<call_ref>& call) noexcept {
  if (!call) return call.error();
  return call_id{call->index, call->generation};
}

inline void release_slot(queue_pair& on, const consumer_end& end, std::uint32_t slot) noexcept {
  if (&end == &on.user.completions) return release_completion(on, slot);
  end.free_ring->release(slot);
}

// The next completion that is wanted, parked ones first.
inline std::optional<std::uint32_t> take_completion(queue_pair& on) noexcept {
  queue_pair::user_side& mine = on.user;
  while (mine.parked_completions.count != 0) {
    const std::uint32_t slot = mine.parked_completions.pop();
    if (accept_completion(on, slot)) return slot;
  }
  for (std::size_t left = mine.completions.ring->pending_at_least(); left != 0; --left) {
    const std::uint32_t slot = *mine.completions.ring->try_pop();
    if (accept_completion(on, slot)) return slot;
  }
  return std::nullopt;
}

// The completion of this call, if it has arrived; parks those of others.
inline std::optional<std::uint32_t> take_completion_of(queue_pair& on, call_ref call) noexcept {
  while (const auto slot = on.user.completions.ring->try_pop()) {
    if (on.user.completions.slots.header(*slot)->own == call) {
      (void)accept_completion(on, *slot); // the one who waits has not given up
      return slot;
    }
    park_completion(on, *slot);
  }
  return std::nullopt;
}

// The slot of the next completion. Errors: empty (none has come), closed, misuse (an empty handle).
inline result<std::uint32_t> next_completion(const pair_handle& on) noexcept {
  if (!on) return errc::misuse;
  const bool over = closed(*on); // before looking: what came before it closed is still there
  if (const auto slot = take_completion(*on)) return *slot;
  return over ? errc::closed : errc::empty;
}

inline call_id id_of_completion(const queue_pair& on, std::uint32_t slot) noexcept {
  const call_ref call = on.user.completions.slots.header(slot)->own;
  return {call.index, call.generation};
}

// The header of an invocation that is given up after `timeout`.
constexpr value_header call_header(time_point now, duration timeout, connection to = everyone) noexcept {
  return message_header(entry::invocation, ref_of(to), now, rt::deadline_after(now, timeout));
}

inline error error_of(const value_header& completion) noexcept {
  return {completion.outcome, completion.outcome_value, completion.outcome_limit};
}

// Waits for the completion of a call of this queue pair until `deadline`, or until the endpoint is closed;
// nothing then, and the call is given up. Not real-time: sleeps in the kernel.
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

// Waits for the completion of a call that was started at `now` with this time-out, and a little longer for
// the service thread's word. Errors: timed_out, closed. Not real-time.
inline result<std::uint32_t> wait_call(const pair_handle& on, call_id call, time_point now,
                                       duration timeout) noexcept {
  on.wake_service();
  const time_point deadline = rt::deadline_after(rt::deadline_after(now, timeout), word_late_max);
  if (const auto slot = wait_completion(*on, {call.index, call.generation}, deadline)) {
    value_header& completion = *on->user.completions.slots.header(*slot);
    if (completion.failed && completion.outcome == errc::timed_out)
      completion.outcome_limit = timeout.count(); // known only here
    return *slot;
  }
  if (closed(*on)) return errc::closed;
  return error{errc::timed_out, 0, timeout.count()};
}

// Waits until what `call` names was written, has expired, or will not be. Not real-time.
inline status wait_sent(queue_pair& on, call_ref call) noexcept {
  const auto slot = wait_completion(on, call, rt::never);
  if (!slot) return errc::closed;
  const value_header& completion = *on.user.completions.slots.header(*slot);
  const status what = completion.failed ? status{error_of(completion)} : status{};
  release_completion(on, *slot);
  return what;
}

// ---- in

// The next message or call that has arrived and has not expired; expired ones are released and counted.
inline std::optional<std::uint32_t> take_arrived(queue_pair& on, time_point now) noexcept {
  const consumer_end& end = on.user.in;
  for (std::size_t left = end.ring->pending_at_least(); left != 0; --left) {
    const std::uint32_t slot = *end.ring->try_pop();
    if (!expired_at(*end.slots.header(slot), now)) return slot;
    on.expired_here.add();
    end.free_ring->release(slot);
  }
  return std::nullopt;
}

// Waits at most `timeout` (negative: for ever) until `try_next` finds something; timed_out in place of empty.
// Not real-time: sleeps in the kernel.
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

// Whether a message to `to` would be taken now.
inline bool has_room(queue_pair& on, peer_ref to) noexcept {
  return takes(on, to) && !(to.generation == 0 && crowded(on)) && on.user.out.free_ring->free_at_least() != 0;
}

// Waits until it would, or `to` is gone, or the endpoint closed; at most `timeout` (negative: for ever).
// Errors: closed, peer_lost, timed_out. Once the service thread has seen that somebody waits, it notifies of
// every change; the first time in any case, so that no earlier change is missed. Not real-time: sleeps in
// the kernel.
inline status wait_room(const pair_handle& handle, peer_ref to, duration timeout) noexcept {
  queue_pair& on = *handle;
  if (++on.user.room_waits == 0) ++on.user.room_waits;
  // release: pairs with the acquires in take_entries() and tell_those_who_ask()
  on.room_asked.store(on.user.room_waits, std::memory_order_release);
  handle.wake_service();
  bool room = false;
  on.arrival.wait_until(rt::deadline_after(rt::monotonic_clock::now(), timeout), [&] {
    room = has_room(on, to);
    return room || gone(on, to) || closed(on);
  });
  on.room_asked.store(0, std::memory_order_release); // release: as above
  if (closed(on)) return errc::closed;
  if (gone(on, to)) return errc::peer_lost;
  return room ? status{} : status{error{errc::timed_out, 0, timeout.count()}};
}

// The diagnostic that a call was refused with, kept by the calling handle.
class diagnostic {
 public:
  void assign(std::string_view from) noexcept {
    bytes_ = from.size() < diagnostic_bytes_max ? from.size() : diagnostic_bytes_max;
    from.copy(text_.data(), bytes_);
  }
  std::string_view view() const noexcept { return {text_.data(), bytes_}; }

 private:
  std::array<char, diagnostic_bytes_max> text_{};
  std::size_t bytes_ = 0;
};

// Whether an error of a call comes with a diagnostic that says more: the provider's own, or which member of
// the reply is not what was wanted.
constexpr bool has_diagnostic(errc code) noexcept {
  switch (code) {
  case errc::refused:
  case errc::no_service:
  case errc::not_an_object:
  case errc::missing_member:
  case errc::duplicate_member:
  case errc::wrong_type:
  case errc::out_of_range:
  case errc::too_long: return true;
  default: return false;
  }
}

// The error of a call that failed. Keeps its diagnostic and releases the slot.
inline error fail_with(queue_pair& on, std::uint32_t slot, diagnostic& refusal) noexcept {
  const value_header& completion = *on.user.completions.slots.header(slot);
  const error why = error_of(completion);
  if (has_diagnostic(why.code)) {
    refusal.assign({reinterpret_cast<const char*>(on.user.completions.slots.value(slot)), completion.bytes});
  }
  release_completion(on, slot);
  return why;
}

} // namespace rowe::detail
