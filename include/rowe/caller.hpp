// SPDX-License-Identifier: Apache-2.0
// Callers: from endpoint::client<Q, A>(), for one thread, to call one service. call() waits; start() and
// try_finish() are for loops.
#pragma once
#include <cstdint>
#include <string_view>
#include <utility>

#include <rowe/call_id.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/payload.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/waiting.hpp>
#include <rowe/json_text.hpp>
#include <rowe/message_view.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// Calls a service with structs that have schemas: Q goes out, A comes back. If both are json_text, it calls
// with text that is JSON: a request is one object, and so is a reply, unless a rosbridge peer provides the
// service and answers with another value. Move-only; one thread at a time. Every call of an empty handle says
// errc::misuse.
//
// How a call may fail, whether it was waited for or not: timed_out; peer_lost (the peer left before it
// answered); no_service (nobody provides the service); refused (by the provider: refusal() has its
// diagnostic); missing_member, duplicate_member, wrong_type, out_of_range, too_long (the reply does not match
// A's schema); too_big (the reply does not fit its slot); malformed, not_an_object (the request, a text);
// closed.
template <class Q, class A>
class caller {
  static_assert(detail::is_text<Q> == detail::is_text<A>, "either both are structs, or both are json_text");

 public:
  // A struct, by reference; for json_text a rowe::body: a message or a text.
  using given = typename detail::payload<Q>::given;
  // A struct; for json_text a message_view.
  using reply_type = typename detail::payload<A>::reply;

  // How a call ended that was started without waiting for it.
  struct answer {
    call_id id;
    result<reply_type> reply;
  };

  caller() noexcept = default;
  explicit caller(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // Calls and waits for the reply at most `timeout` (negative: for ever). Errors: above, and those of
  // start(). Not for real-time loops: sleeps in the kernel.
  result<reply_type> call(given request, duration timeout) noexcept {
    const time_point now = rt::monotonic_clock::now();
    if (pair_) detail::reclaim_rows(*pair_);
    const auto started = start(request, timeout, now);
    if (!started) return started.error();
    const auto slot = detail::wait_call(pair_, *started, now, timeout);
    if (!slot) return slot.error();
    return opened(*slot);
  }

  // Calls without waiting; try_finish() takes the completion. `timeout` counts from `now`. Errors: full,
  // too_many_calls (both: the option `depth`), closed; of json_text also too_big (longer than the option
  // `text_bytes_max`, or a message that overflowed). Never waits, never allocates, no system call.
  ROWE_RT result<call_id> start(given request, duration timeout, time_point now) noexcept {
    if (!pair_) return errc::misuse;
    const detail::value_header header = detail::call_header(now, timeout);
    if constexpr (detail::is_text<Q>) {
      return detail::named(detail::start_call(*pair_, header, request));
    } else {
      return detail::named(detail::start_call(*pair_, header, &request, sizeof(Q)));
    }
  }

  // The next call that has ended, in the order in which they ended. Errors: empty (none has), closed. Each
  // call ends once. Never waits, never allocates, no system call; at most `depth` steps.
  ROWE_RT result<answer> try_finish() noexcept {
    const auto slot = detail::next_completion(pair_);
    if (!slot) return slot.error();
    const call_id id = detail::id_of_completion(*pair_, *slot);
    return answer{id, opened(*slot)};
  }

  // Gives the call up: try_finish() will not return it. It counts as in flight until it has ended, and
  // cancel(), try_finish() or a call that waits has dropped its completion. The service does not learn of it.
  // Does nothing for a call that has ended. Never waits, never allocates; at most as many steps as calls may
  // be in flight.
  ROWE_RT void cancel(call_id call) noexcept {
    if (pair_) detail::cancel(*pair_, {call.index, call.generation});
  }

  // The diagnostic of the last call that failed. For refused and no_service it is the provider's or the
  // server's own; for a reply that could not be decoded, it says which member, what was wanted and what was
  // found. Cut at 192 bytes. Valid until the next one.
  ROWE_RT std::string_view refusal() const noexcept { return refusal_.view(); }

 private:
  // The slot of a struct is released at once; the slot of a text is released with its view.
  result<reply_type> opened(std::uint32_t slot) noexcept {
    detail::consumer_end& completions = pair_->user.completions;
    if (completions.memory.header(slot)->failed) return detail::fail_with(*pair_, slot, refusal_);
    if constexpr (detail::is_text<A>) {
      return message_view{*pair_, completions, slot};
    } else {
      const A value = detail::payload<A>::read(completions.memory, slot);
      detail::release_completion(*pair_, slot);
      return value;
    }
  }

  detail::pair_handle pair_;
  detail::diagnostic refusal_;
};

} // namespace rowe
