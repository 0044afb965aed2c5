// SPDX-License-Identifier: Apache-2.0
// Responders: from endpoint::serve<Q, A>(), for one thread, in a loop, to answer the calls of one service,
// whoever calls and by whatever codec:
//
//   if (auto request = mode.try_next(now)) (void)mode.reply(*request, apply(request->value()), now);
#pragma once
#include <string_view>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/payload.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/responding.hpp>
#include <rowe/json_text.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// A call that waits for its answer. The place of the answer is reserved, so answering cannot fail for want of
// room; a request that is destroyed unanswered is refused. Move-only; destroy it on its responder's thread,
// and before the responder.
template <class Q>
class request : public detail::open_request {
  using taken = typename detail::payload<Q>::taken;

 public:
  // What was asked: a struct; for json_text a view of the text, one JSON object, which is valid until the
  // request is answered or destroyed, and keeps its slot until then.
  ROWE_RT const taken& value() const noexcept { return value_; }
  ROWE_RT const taken& operator*() const noexcept { return value_; }
  ROWE_RT const taken* operator->() const noexcept { return &value_; }

  // from(): who asked; no connection (false) where it was this process. arrived(): when the call's last byte
  // was read. expires(): when the one who asked gives up; rt::never where it said nothing.

 private:
  template <class, class>
  friend class responder;
  request(detail::queue_pair& on, detail::request_slots slots, const taken& value) noexcept
      : detail::open_request{on, slots, detail::is_text<Q>}, value_{value} {}

  taken value_;
};

// Answers with structs that have schemas: requests are decoded into Q, replies are A. A request that is not
// what Q's schema says never gets here: it is refused with a diagnostic that says why. Or, where both are
// json_text, with text that is JSON: one object, which the service thread validates; a reply that is none is
// counted as `malformed`, and the call is refused. Move-only; one thread at a time. An empty handle says
// errc::misuse to everything.
template <class Q, class A>
class responder {
  static_assert(detail::is_text<Q> == detail::is_text<A>, "either both are structs, or both are json_text");

 public:
  // A struct, by reference; for json_text a rowe::body: a message or a text.
  using given = typename detail::payload<A>::given;

  responder() noexcept = default;
  explicit responder(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // The oldest call that waits and has not given up. Errors: empty (none), full (no place for its answer:
  // more than `depth` requests are held unanswered), closed. Never waits, never allocates, no system call; at
  // most `depth` steps.
  ROWE_RT result<request<Q>> try_next(time_point now) noexcept {
    const auto slots = detail::next_request(pair_, now);
    if (!slots) return slots.error();
    const auto asked = detail::payload<Q>::read(pair_->user.in.slots, slots->in);
    return request<Q>{*pair_, *slots, asked};
  }
  // The same with the time read here.
  ROWE_RT result<request<Q>> try_next() noexcept { return try_next(rt::monotonic_clock::now()); }

  // Waits for the next call at most `timeout` (negative: for ever). Errors: as try_next(), but timed_out in
  // place of empty. Not for real-time loops: sleeps in the kernel.
  result<request<Q>> next(duration timeout) noexcept {
    return detail::wait_next(pair_, timeout, [this] { return try_next(); });
  }

  // Answers. Errors: peer_lost (who asked is gone), expired (it does not wait any more), closed: there is
  // nobody to answer, and the request is over all the same; misuse (answered already, or by another
  // responder); of json_text also too_big (longer than the option `text_bytes_max`, or a message that
  // overflowed): the request can still be answered. Never waits, never allocates, no system call.
  ROWE_RT status reply(request<Q>& to, given value, time_point now) noexcept {
    if constexpr (detail::is_text<A>) {
      return to.answer(pair_, value, now);
    } else {
      return to.answer(pair_, detail::entry::reply, &value, sizeof(A), now);
    }
  }
  ROWE_RT status reply(request<Q>& to, given value) noexcept {
    return reply(to, value, rt::monotonic_clock::now());
  }

  // Says no, with a diagnostic (cut at 192 bytes). Errors: as reply(), but for too_big. Never waits, never
  // allocates, no system call.
  ROWE_RT status refuse(request<Q>& to, std::string_view diagnostic, time_point now) noexcept {
    return to.refuse(pair_, diagnostic, now);
  }
  ROWE_RT status refuse(request<Q>& to, std::string_view diagnostic) noexcept {
    return refuse(to, diagnostic, rt::monotonic_clock::now());
  }

 private:
  detail::pair_handle pair_;
};

} // namespace rowe
