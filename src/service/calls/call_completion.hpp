// SPDX-License-Identifier: Apache-2.0
// Folder calls: the life of a call, and direct messages. Who is called is decided in requests.
// Ends calls, by an answer of this process, an answer of a peer, or an error, and reports to the caller. A
// reply that finds no room is an error of the callee, which may try again; everything else closes the call.
// Only the service thread decides what comes first: reply, refusal, time-out or loss. It never waits or
// allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/calls/call_goals.hpp"
#include "service/calls/direct_messages.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/encoder.hpp"

namespace rowe::service {

// What a handle or a thread of this process answers.
struct local_reply {
  std::string_view text{};                // JSON; used if there is no value
  const json::encoder* encoder = nullptr; // of the value
  const std::byte* value = nullptr;
  rt::time_point expires = rt::never;
  call_endpoint waits{}; // gets a completion when the answer is written; or nobody
  detail::call_ref own{};
};

struct call_completion_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  refusals& refusals_;
  direct_messages& direct_messages_;
  local_delivery& local_delivery_;
};

class call_completion : call_completion_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<call_index>(bounds.calls_max);
  }
  call_completion(rt::arena& memory, const call_completion_needs& parts) noexcept;

  // Begins a call, as call_table::open(). If nobody answers before the deadline, the caller gets an error.
  call_index open(const call_endpoint& caller, std::string_view id_raw, std::string_view service,
                  rt::time_point until) noexcept;
  // Most calls are answered in the cycle that begins them, and never need the wheel. At the end of a cycle
  // this puts the others on it.
  void arm_open() noexcept {
    if (unarmed_count_ != 0) arm_all_open();
  }

  // What only goals of actions have.
  call_goals& goals() noexcept { return goals_; }

  // ---- replies

  // A handle or a thread answers a call that was given to it and has not ended. `waits` gets a completion
  // when the answer is written. Errors: there is nobody to answer; the text is no JSON; the answer has
  // expired; there is no room. After an error `waits` gets none, and after the last one the callee may try
  // again.
  status answer(const call_endpoint& callee, detail::call_ref which, const local_reply& with) noexcept;
  status refuse(const call_endpoint& callee, detail::call_ref which, std::string_view why) noexcept;
  // A peer answers a call or a goal.
  void take_reply(connection& c, const wire::request& said) noexcept;
  // The endpoint itself answers, and does not try again: a reply that finds no room is lost.
  void complete(call_index call, std::string_view text) noexcept {
    end_without_room(call, finish_with(call, text));
  }
  // The same with a text that was composed in a slot, which is released.
  void complete(call_index call, slot_id text) noexcept {
    complete(call, {slots_.text(text).data(), slots_.text(text).size()});
    message_store_.release(text);
  }

  // ---- failures

  // The call fails; the caller gets the code and the diagnostic.
  void fail(call_index call, const error& why, std::string_view diagnostic = {}) noexcept;
  void fail_for_room(call_index call) noexcept; // for its request, or its reply
  void close(call_index call) noexcept;         // nobody gets a report
  // A peer's call fails because its role has no right to what it asks for.
  void deny(call_index call, std::string_view diagnostic) noexcept;
  void time_out(call_index call) noexcept;
  // A peer has left: its own calls need no answer, and the calls that it was to answer fail.
  void forget(connection_id peer) noexcept;
  // The same for a handle.
  void forget_pair(pair_index pair) noexcept;

  bool check() const noexcept;

 private:
  void add(counter which) noexcept { state_.counts.add(which); }
  void complete(const call_endpoint& whom, detail::call_ref own, const status& outcome,
                std::string_view text = {}) noexcept {
    local_delivery_.complete(whom, own, outcome, text);
  }
  // The error for a caller whose callee has left.
  errc gone_as() const noexcept { return state_.cycle.closing ? errc::closed : errc::peer_lost; }
  void arm_all_open() noexcept;
  result<call_index> find_given(const call_endpoint& callee, detail::call_ref which) noexcept;
  result<slot_id> finish(call_index call, const wire::body& value, rt::time_point expires) noexcept;
  result<slot_id> finish_with(call_index call, std::string_view text,
                              rt::time_point expires = rt::never) noexcept;
  void end_without_room(call_index call, const result<slot_id>& finished) noexcept;

  slot_pool& slots_;
  call_goals goals_;
  std::span<call_index> unarmed_; // with a deadline, begun in this cycle
  std::uint32_t unarmed_count_ = 0;
};

} // namespace rowe::service
