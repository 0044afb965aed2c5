// SPDX-License-Identifier: Apache-2.0
// A handle's own calls: the table of them, how they begin, and how their completions are taken.
//
// The service thread completes each call once: with a reply, with an error, or at its deadline. A call has a
// row in its handle's table from its start until the slot of its completion is released. `completions` has as
// many slots as the table has rows, so the service thread always finds one, and no completion can be lost.
// The row's generation is odd while the call is open; taking the completion makes it even.
//
// A user that gives up earlier marks the row, and the completion is dropped when it arrives. The service
// thread does not learn of it: the call ends at its deadline at the latest. Each function that takes, awaits
// or gives up a call drops such completions; so do calls that wait and find no row. So the row becomes free
// whatever its handle does next. Starting a call does not look at completions: each start would take half as
// long again.
//
// All of it is for the handle's one thread. No function waits, allocates or enters the kernel, but for the
// wake-up under idle::wake, and each takes steps bounded by the pair's depths. The exercises of the handles
// that are made of these show it (tests/rt_contract). Waiting for a completion is in waiting.hpp.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include <rowe/call_id.hpp>
#include <rowe/connection.hpp>
#include <rowe/detail/mutation_points.hpp>
#include <rowe/detail/posting.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/message.hpp>

namespace rowe::detail {

// ---- the table of calls

inline void release_row(queue_pair& on, std::uint32_t index) noexcept {
  on.user.calls[index].next_free = on.user.free_call;
  on.user.free_call = index;
  --on.user.calls_open;
}

// Takes a row for a call, which is open from now on. Errors: too_many_calls.
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

// Takes back a call that was not posted.
inline void withdraw_call(queue_pair& on, call_ref call) noexcept {
  ++on.user.calls[call.index].generation;
  release_row(on, call.index);
}

inline bool open(const queue_pair& on, call_ref call) noexcept {
  return call.generation % 2 == 1 && call.index < on.user.calls.size() &&
         on.user.calls[call.index].generation == call.generation;
}

// Gives the call up: its completion will be dropped. Does nothing for a call whose completion was taken.
inline void give_up(queue_pair& on, call_ref call) noexcept {
  if (open(on, call)) on.user.calls[call.index].cancelled = true;
}

// ---- starting

// The header of an invocation that is given up after `timeout`.
constexpr value_header call_header(time_point now, duration timeout, connection to = everyone) noexcept {
  return message_header(entry::invocation, ref_of(to), now, rt::deadline_after(now, timeout));
}

// Begins a call, and posts `value`, whose header names the call. Errors: as begin_call() and post().
template <class... Value>
result<call_ref> start_call(queue_pair& on, value_header header, const Value&... value) noexcept {
  if (closed(on)) return on.closed_as;
  const auto call = begin_call(on);
  if (!call) return call;
  header.own = *call;
  if (const status sent = post(on, header, value...); !sent) {
    withdraw_call(on, *call);
    return sent.error();
  }
  return call;
}

// The same, unless `to` is known to be gone, or has its share of the parked messages already. Errors:
// peer_lost, full, and those of start_call().
inline result<call_ref> start_call_to(queue_pair& on, connection to, const body& text,
                                      const value_header& header) noexcept {
  if (!takes(on, ref_of(to))) [[unlikely]]
    return with_depth(on, turned_away(on, ref_of(to)));
  return start_call(on, header, text);
}

// The name of a call for the handle's user.
inline result<call_id> named(const result<call_ref>& call) noexcept {
  if (!call) return call.error();
  return call_id{call->index, call->generation};
}

// ---- completions

// Releases the slot of a completion, and the call's row with it.
inline void release_completion(queue_pair& on, std::uint32_t slot) noexcept {
  const std::uint32_t index = on.user.completions.memory.header(slot)->own.index;
  on.user.completions.free_ring->release(slot);
  release_row(on, index);
}

// Closes the call that this completes. Returns false if the call was given up; then the slot is released.
inline bool accept_completion(queue_pair& on, std::uint32_t slot) noexcept {
  pending_call& row = on.user.calls[on.user.completions.memory.header(slot)->own.index];
  ++row.generation;
  if (!row.cancelled) return true;
  release_completion(on, slot);
  return false;
}

// For a caller that does not take this completion now. Drops it if its call was given up; else parks it until
// take_completion().
inline void park_completion(queue_pair& on, std::uint32_t slot) noexcept {
  const pending_call& row = on.user.calls[on.user.completions.memory.header(slot)->own.index];
  if (row.cancelled) {
    (void)accept_completion(on, slot);
  } else {
    on.user.parked_completions.push(slot);
  }
}

// Releases the rows of calls that were given up and are completed. Parks other completions, in their order.
// Takes at most as many steps as there are rows.
[[gnu::noinline, gnu::cold]] inline void drop_unwanted_completions(queue_pair& on) noexcept {
  queue_pair::user_side& mine = on.user;
  for (std::uint32_t left = mine.parked_completions.count; left != 0; --left)
    park_completion(on, mine.parked_completions.pop());
  for (std::size_t left = mine.completions.ring->pending_at_least(); left != 0; --left)
    park_completion(on, *mine.completions.ring->try_pop());
}

// If no row is free, releases those of calls that were given up. Calls that wait do this before begin_call().
inline void reclaim_rows(queue_pair& on) noexcept {
  if (on.user.free_call == on.user.calls.size() && !ROWE_MUTANT(given_up_rows)) drop_unwanted_completions(on);
}

// Gives the call up for a user, who may call nothing else afterwards. So it also drops the completions that
// have arrived for calls that were given up.
inline void cancel(queue_pair& on, call_ref call) noexcept {
  give_up(on, call);
  drop_unwanted_completions(on);
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

// The completion of this call, if it has arrived. Parks those of others.
inline std::optional<std::uint32_t> take_completion_of(queue_pair& on, call_ref call) noexcept {
  while (const auto slot = on.user.completions.ring->try_pop()) {
    if (on.user.completions.memory.header(*slot)->own == call) {
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
  return over ? on->closed_as : errc::empty;
}

inline call_id id_of_completion(const queue_pair& on, std::uint32_t slot) noexcept {
  const call_ref call = on.user.completions.memory.header(slot)->own;
  return {call.index, call.generation};
}

// Releases a slot of `in` or `completions`; of the latter with the row of its call.
inline void release_slot(queue_pair& on, const consumer_end& end, std::uint32_t slot) noexcept {
  if (&end == &on.user.completions) return release_completion(on, slot);
  end.free_ring->release(slot);
}

// ---- failures

// The longest diagnostic that is passed on with a refusal; a longer one is cut. Slots for replies have at
// least this capacity.
inline constexpr std::size_t diagnostic_bytes_max = 192;

inline error error_of(const value_header& completion) noexcept {
  return {completion.outcome, completion.outcome_value, completion.outcome_limit};
}

// The diagnostic of the last call that failed. Its handle keeps it.
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

// Whether an error of a call comes with a diagnostic: the provider's own, or one that names the member of the
// reply that is not as the schema says.
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

// The error of a call that failed. Stores its diagnostic and releases the slot.
inline error fail_with(queue_pair& on, std::uint32_t slot, diagnostic& refusal) noexcept {
  const value_header& completion = *on.user.completions.memory.header(slot);
  const error why = error_of(completion);
  if (has_diagnostic(why.code)) {
    refusal.assign({reinterpret_cast<const char*>(on.user.completions.memory.value(slot)), completion.bytes});
  }
  release_completion(on, slot);
  return why;
}

} // namespace rowe::detail
