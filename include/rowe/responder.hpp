// SPDX-License-Identifier: Apache-2.0
// Responders: from endpoint::serve<Q, A>(), for one thread, in a loop, to answer the calls of one service,
// whoever calls and by whatever codec:
//
//   if (auto request = mode.try_next(now)) (void)mode.reply(*request, apply(request->value()), now);
#pragma once
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/payload.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/responding.hpp>
#include <rowe/detail/waiting.hpp>
#include <rowe/json_text.hpp>
#include <rowe/json_value.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// A call that waits for its answer. The slot of the answer is reserved, so answering cannot fail because
// there is no slot. A request that is destroyed unanswered is refused. Move-only; destroy it on its
// responder's thread, and before the responder. A request of json_text has the functions of
// rowe/json_value.hpp: get<T>("a.b[2]"), find(), as<T>(), members(), elements().
template <class Q>
class request
    : public detail::open_request,
      public std::conditional_t<detail::is_text<Q>, detail::reads_json<request<Q>>, detail::reads_none> {
  using taken = typename detail::payload<Q>::taken;

 public:
  // The request: a struct; for json_text a view of the text, one JSON object. The view is valid until the
  // request is answered or destroyed, and holds its slot until then.
  ROWE_RT const taken& value() const noexcept { return value_; }
  ROWE_RT const taken& operator*() const noexcept { return value_; }
  ROWE_RT const taken* operator->() const noexcept { return &value_; }

  // from(): the caller; no connection (false) if it is this process. arrived(): when the call's last byte was
  // read. expires(): when the caller gives up; rt::never if it did not say.

 private:
  template <class, class>
  friend class responder;
  request(detail::queue_pair& on, detail::request_slots both, const taken& value) noexcept
      : detail::open_request{on, both, detail::is_text<Q>}, value_{value} {}

  taken value_;
};

// Answers with structs that have schemas: requests are decoded into Q, replies are A. A request that does not
// match Q's schema never comes here: it is refused with a diagnostic that says why. If both are json_text, it
// answers with text that is one JSON object. The service thread validates it; a reply that is no object is
// counted as `malformed`, and the call is refused. Move-only; one thread at a time. Every call of an empty
// handle says errc::misuse.
template <class Q, class A>
class responder {
  static_assert(detail::is_text<Q> == detail::is_text<A>, "either both are structs, or both are json_text");

 public:
  // A struct, by reference; for json_text a rowe::body: a message or a text.
  using given = typename detail::payload<A>::given;

  responder() noexcept = default;
  explicit responder(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // Takes the oldest call whose caller has not given up. Errors: empty (none), full (no slot for its answer:
  // more than `depth` requests are unanswered), closed. Never waits, never allocates, no system call; at most
  // `depth` steps.
  ROWE_RT result<request<Q>> try_next(time_point now) noexcept {
    const auto both = detail::next_request(pair_, now);
    if (!both) return both.error();
    const auto asked = detail::payload<Q>::read(pair_->user.in.memory, both->in);
    return request<Q>{*pair_, *both, asked};
  }
  // The same; reads the time itself.
  ROWE_RT result<request<Q>> try_next() noexcept { return try_next(rt::monotonic_clock::now()); }

  // Waits for the next call at most `timeout` (negative: for ever). Errors: as try_next(), but timed_out in
  // place of empty. Not for real-time loops: sleeps in the kernel.
  result<request<Q>> next(duration timeout) noexcept {
    return detail::wait_next(pair_, timeout, [this] { return try_next(); });
  }

  // Answers a request. Errors: peer_lost (the caller is gone), expired (the caller does not wait any more),
  // closed: there is nobody to answer, and the request has ended; misuse (answered already, or by another
  // responder); for json_text also too_big (longer than the option `text_bytes_max`, or a message that
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

  // Refuses a request, with a diagnostic (cut at 192 bytes). Errors: as reply(), except too_big. Never waits,
  // never allocates, no system call.
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
