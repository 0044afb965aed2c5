// SPDX-License-Identifier: Apache-2.0
// Lanes: from endpoint::open_lane(), for one thread, to send, receive, invoke and reply with plain messages,
// which are JSON objects of any form. A lane is a queue out and a queue in; others call that a channel, or a
// pair of message queues. There are two kinds of calls. try_send, try_receive, start, try_finish,
// try_reply and try_refuse are for loops and never wait. send, receive, invoke and reply wait, as each says.
//
// Messages are JSON objects without members named op, message_id or in_reply_to at the top. The service
// thread checks that. It ends a wrong invocation with not_an_object or reserved_member, and counts a wrong
// message or reply as `malformed`.
#pragma once
#include <cstdint>
#include <string_view>
#include <utility>

#include <rowe/call_id.hpp>
#include <rowe/connection.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/posting.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/waiting.hpp>
#include <rowe/message.hpp>
#include <rowe/message_view.hpp>
#include <rowe/result.hpp>

namespace rowe {

// How a call ended that was started without waiting for it.
struct call_end {
  call_id id;
  result<message_view> reply; // or the error, as of invoke()
};

// Move-only; one thread at a time. Every call of an empty handle says errc::misuse. Errors that all calls
// share: closed (the endpoint is), misuse.
class lane {
 public:
  lane() noexcept = default;
  explicit lane(detail::pair_handle handle) noexcept : pair_{std::move(handle)} {}

  // ---- sending

  // Queues a message to `to`, or to every peer that takes plain messages. While there is no such peer, the
  // message waits until `ttl` is over: 0 is now or never, negative for ever. The peer learns what is left of
  // it from a member `ttl_ms` of up to 27 bytes, which the message must not have yet. Only counters report
  // whether it was sent or expired. Errors: full (all slots of the option `depth` are taken; or `to` does not
  // read, and its share of them is used up, see docs/limits.md), too_big (`text_bytes_max`, or a message that
  // overflowed), peer_lost (`to` is gone). Never waits, never allocates, no system call.
  ROWE_RT status try_send(body object, duration ttl, time_point now, connection to = everyone) noexcept {
    if (!pair_) return errc::misuse;
    return detail::post_to(*pair_, to, object,
                           detail::message_header(detail::entry::message, detail::ref_of(to), now,
                                                  detail::expiry_after(now, ttl)));
  }
  // The same; reads the time itself.
  ROWE_RT status try_send(body object, duration ttl, connection to = everyone) noexcept {
    return try_send(object, ttl, rt::monotonic_clock::now(), to);
  }

  // Sends a message and waits until it was handed to the kernel, for one peer at least. Errors: as
  // try_send(); too_many_calls (the option `calls`); expired (`ttl` is over before the frame was begun),
  // peer_lost (`to` left before), malformed, not_an_object, reserved_member. Not for real-time loops.
  status send(body object, duration ttl, connection to = everyone) noexcept;

  // Waits until a message to `to`, or to everyone, would not be refused with `full`, at most `timeout`
  // (negative: for ever; 0: does not wait, only looks). Errors: timed_out, peer_lost. Not for real-time
  // loops.
  status wait_room(duration timeout, connection to = everyone) noexcept {
    return pair_ ? detail::wait_room(pair_, detail::ref_of(to), timeout) : status{errc::misuse};
  }

  // ---- receiving

  // Takes the oldest message or call that has not expired (by the option `inbound_ttl`, or by its sender's
  // time to live). Errors: empty. Never waits, never allocates, no system call; at most `inbox_depth` steps.
  ROWE_RT result<message_view> try_receive(time_point now) noexcept {
    if (!pair_) return errc::misuse;
    const bool over = detail::closed(*pair_); // before looking: what came before it closed is still there
    if (const auto slot = detail::take_arrived(*pair_, now)) {
      return message_view{*pair_, pair_->user.in, *slot};
    }
    return over ? pair_->closed_as : errc::empty;
  }
  ROWE_RT result<message_view> try_receive() noexcept { return try_receive(rt::monotonic_clock::now()); }

  // Waits for the next one at most `timeout` (negative: for ever). Errors: timed_out. Not for real-time
  // loops.
  result<message_view> receive(duration timeout) noexcept;

  // ---- invoking

  // Sends an invocation, {"service":NAME, ...} as a rule, and waits for its reply at most `timeout`
  // (negative: for ever). It goes to `to`, or else to whoever provides the service: a handle of this process,
  // the server that a client is connected to, a peer. Errors: full, too_big; too_many_calls (the option
  // `calls`, or the limit `calls_max`); timed_out; peer_lost (it went away before it replied); no_service,
  // no_peer (nobody to ask); refused (the service says no: refusal() has its diagnostic); malformed,
  // not_an_object, reserved_member. Not for real-time loops.
  result<message_view> invoke(body object, duration timeout, connection to = everyone) noexcept;

  // The same without waiting: try_finish() takes the completion. `timeout` counts from `now`. Errors: full,
  // too_big, too_many_calls, peer_lost; the others come with the completion. Never waits, never allocates, no
  // system call.
  ROWE_RT result<call_id> start(body object, duration timeout, time_point now,
                                connection to = everyone) noexcept {
    if (!pair_) return errc::misuse;
    return detail::named(detail::start_call_to(*pair_, to, object, detail::call_header(now, timeout, to)));
  }

  // The next call that has ended, in the order in which they ended. Errors: empty (none has). Each call ends
  // once. Never waits, never allocates, no system call; at most `calls` steps.
  ROWE_RT result<call_end> try_finish() noexcept {
    const auto slot = detail::next_completion(pair_);
    if (!slot) return slot.error();
    const call_id id = detail::id_of_completion(*pair_, *slot);
    return call_end{id, opened(*slot)};
  }

  // Gives the call up: try_finish() will not return it. It counts as in flight until it has ended, and
  // cancel(), try_finish() or a call that waits has dropped its completion. The peer does not learn of it.
  // Does nothing for a call that has ended. Never waits, never allocates; at most as many steps as calls may
  // be in flight.
  ROWE_RT void cancel(call_id call) noexcept {
    if (pair_) detail::cancel(*pair_, {call.index, call.generation});
  }

  // The diagnostic of the last call that failed with refused or no_service; cut at 192 bytes. Valid until the
  // next one.
  ROWE_RT std::string_view refusal() const noexcept { return refusal_.view(); }

  // ---- replying

  // Answers a call that this lane received, with a JSON object. Errors: full, too_big, peer_lost (the caller
  // is gone), expired (the caller does not wait any more), misuse (not a call of this lane). Never waits,
  // never allocates, no system call.
  ROWE_RT status try_reply(const message_view& call, body object, time_point now) noexcept {
    if (const status fine = answerable(call, now); !fine) return fine;
    return detail::post(*pair_, answer_to(call, detail::entry::reply, now, rt::never), object);
  }
  // Answers a call and waits until the reply was handed to the kernel, at most `ttl` (negative: for ever).
  // Errors: as try_reply(), but full also if too many answers wait for the caller, and expired also if `ttl`
  // is over; too_many_calls (the option `calls`), malformed, not_an_object, reserved_member. After full,
  // too_big and too_many_calls it can be answered again. Not for real-time loops.
  status reply(const message_view& call, body object, duration ttl) noexcept;

  // Refuses a call, with a diagnostic (cut at 192 bytes). Errors: as try_reply(). Never waits, never
  // allocates.
  ROWE_RT status try_refuse(const message_view& call, std::string_view diagnostic, time_point now) noexcept {
    if (const status fine = answerable(call, now); !fine) return fine;
    return detail::post(*pair_, answer_to(call, detail::entry::refusal, now, rt::never),
                        diagnostic.substr(0, detail::diagnostic_bytes_max));
  }

  // ---- counters, any thread

  // Messages, invocations and replies that were accepted, refused with full, and refused with too_big; and
  // those that arrived and had expired before they were taken.
  ROWE_RT std::uint64_t sent() const noexcept { return pair_ ? pair_->published.get() : 0; }
  ROWE_RT std::uint64_t dropped_full() const noexcept { return pair_ ? pair_->refused_full.get() : 0; }
  ROWE_RT std::uint64_t dropped_too_big() const noexcept { return pair_ ? pair_->refused_too_big.get() : 0; }
  ROWE_RT std::uint64_t expired() const noexcept { return pair_ ? pair_->expired_here.get() : 0; }

 private:
  // A completion that was taken, as what the caller gets.
  result<message_view> opened(std::uint32_t slot) noexcept {
    if (pair_->user.completions.memory.header(slot)->failed) return detail::fail_with(*pair_, slot, refusal_);
    return message_view{*pair_, pair_->user.completions, slot};
  }
  status answerable(const message_view& call, time_point now) const noexcept {
    if (!pair_ || call.pair_ != &*pair_ || !call.wants_reply()) return errc::misuse;
    if (detail::gone(*pair_, call.header().peer)) return errc::peer_lost;
    if (detail::expired_at(call.header(), now)) return errc::expired;
    return {};
  }
  static detail::value_header answer_to(const message_view& call, detail::entry what, time_point now,
                                        time_point expires) noexcept {
    detail::value_header made = detail::message_header(what, call.header().peer, now, expires);
    made.call = call.header().call;
    return made;
  }

  detail::pair_handle pair_;
  detail::diagnostic refusal_;
};

// ---- calls that wait

inline status lane::send(body object, duration ttl, connection to) noexcept {
  if (!pair_) return errc::misuse;
  if (!to && detail::crowded(*pair_)) return detail::with_depth(*pair_, errc::full);
  const time_point now = rt::monotonic_clock::now();
  detail::reclaim_rows(*pair_);
  const auto call = detail::start_call_to(*pair_, to, object,
                                          detail::message_header(detail::entry::message, detail::ref_of(to),
                                                                 now, detail::expiry_after(now, ttl)));
  if (!call) return call.error();
  pair_.wake_service();
  return detail::wait_sent(*pair_, *call);
}

inline result<message_view> lane::receive(duration timeout) noexcept {
  return detail::wait_next(pair_, timeout, [this] { return try_receive(); });
}

inline result<message_view> lane::invoke(body object, duration timeout, connection to) noexcept {
  const time_point now = rt::monotonic_clock::now();
  if (pair_) detail::reclaim_rows(*pair_);
  const auto started = start(object, timeout, now, to);
  if (!started) return started.error();
  const auto slot = detail::wait_call(pair_, *started, now, timeout);
  if (!slot) return slot.error();
  return opened(*slot);
}

inline status lane::reply(const message_view& call, body object, duration ttl) noexcept {
  const time_point now = rt::monotonic_clock::now();
  if (const status fine = answerable(call, now); !fine) return fine;
  detail::reclaim_rows(*pair_);
  const auto waiting = detail::begin_call(*pair_);
  if (!waiting) return waiting.error();
  detail::value_header header = answer_to(call, detail::entry::reply, now, detail::expiry_after(now, ttl));
  header.own = *waiting;
  if (const status sent = detail::post(*pair_, header, object); !sent) {
    detail::withdraw_call(*pair_, *waiting);
    return sent;
  }
  pair_.wake_service();
  return detail::wait_sent(*pair_, *waiting);
}

} // namespace rowe
