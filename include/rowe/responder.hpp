// SPDX-License-Identifier: Apache-2.0
// Responders: from endpoint::serve<Q, A>(), for one thread, in a loop, to answer the calls of one service,
// whoever asks and in whatever dialect:
//
//   if (auto request = mode.try_next(now)) (void)mode.reply(*request, apply(request->value()), now);
#pragma once
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/lane.hpp>
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
  using asked = std::conditional_t<std::is_same_v<Q, json_text>, std::string_view, Q>;

 public:
  // What was asked: a struct, or for json_text a view of the text, one JSON object, which is valid until the
  // request is answered or destroyed.
  ROWE_RT const asked& value() const noexcept { return value_; }
  ROWE_RT const asked& operator*() const noexcept { return value_; }
  ROWE_RT const asked* operator->() const noexcept { return &value_; }

  // from(): who asked; no connection (false) where it was this process. arrived(): when the call's last byte
  // was read. expires(): when the one who asked gives up; rt::never where it said nothing.

 private:
  template <class, class>
  friend class responder;
  request(detail::lane& on, detail::request_slots slots, const asked& value) noexcept
      : detail::open_request{on, slots, std::is_same_v<Q, json_text>}, value_{value} {}

  asked value_;
};

// Answers with structs that have schemas: requests are decoded into Q, replies are A. A request that is not
// what Q's schema says never gets here: it is refused with a sentence that says why. Move-only; one thread at
// a time. An empty handle says errc::misuse to everything.
template <class Q, class A>
class responder {
  static_assert(described<Q> && described<A>, "requests and replies need schemas: see rowe/schema.hpp");
  static_assert(std::is_trivially_copyable_v<Q> && alignof(Q) <= detail::value_alignment);
  static_assert(std::is_trivially_copyable_v<A> && alignof(A) <= detail::value_alignment);

 public:
  responder() noexcept = default;
  explicit responder(detail::lane_handle lane) noexcept : lane_{std::move(lane)} {}

  // The oldest call that waits and has not given up. Errors: empty (none), full (no place for its answer:
  // more than `depth` requests are held unanswered), closed. Never waits, never allocates, no system call; at
  // most `depth` steps.
  ROWE_RT result<request<Q>> try_next(time_point now) noexcept {
    const auto slot = detail::next_request(lane_, now);
    if (!slot) return slot.error();
    Q asked;
    std::memcpy(static_cast<void*>(&asked), lane_->user.in.slots.value(slot->in), sizeof(Q));
    return request<Q>{*lane_, *slot, asked};
  }
  // The same with the time read here.
  ROWE_RT result<request<Q>> try_next() noexcept { return try_next(rt::monotonic_clock::now()); }

  // Waits for the next call at most `timeout` (negative: for ever). Errors: as try_next(), but timed_out in
  // place of empty. Not for real-time loops.
  result<request<Q>> next(duration timeout) noexcept {
    return detail::wait_next(lane_, timeout, [this] { return try_next(); });
  }

  // Answers. Errors: peer_lost (who asked is gone), expired (it does not wait any more), closed: there is
  // nobody to answer, and the request is over all the same; misuse (answered already, or by another
  // responder). Never waits, never allocates, no system call.
  ROWE_RT status reply(request<Q>& to, const A& value, time_point now) noexcept {
    return to.answer(lane_, detail::entry::reply, &value, sizeof(A), now);
  }
  ROWE_RT status reply(request<Q>& to, const A& value) noexcept {
    return reply(to, value, rt::monotonic_clock::now());
  }

  // Says no, with a sentence (cut at 192 bytes). Errors: as reply(). Never waits, never allocates, no system
  // call.
  ROWE_RT status refuse(request<Q>& to, std::string_view sentence, time_point now) noexcept {
    return to.refuse(lane_, sentence, now);
  }
  ROWE_RT status refuse(request<Q>& to, std::string_view sentence) noexcept {
    return refuse(to, sentence, rt::monotonic_clock::now());
  }

 private:
  detail::lane_handle lane_;
};

// Answers with text that is JSON: one object, which the service thread validates. A reply that is none is
// counted as `malformed`, and the call is refused.
template <>
class responder<json_text, json_text> {
 public:
  responder() noexcept = default;
  explicit responder(detail::lane_handle lane) noexcept : lane_{std::move(lane)} {}

  // As responder<Q, A>. A request that is held keeps its text's slot.
  ROWE_RT result<request<json_text>> try_next(time_point now) noexcept {
    const auto slot = detail::next_request(lane_, now);
    if (!slot) return slot.error();
    const std::string_view asked{reinterpret_cast<const char*>(lane_->user.in.slots.value(slot->in)),
                                 lane_->user.in.slots.header(slot->in)->bytes};
    return request<json_text>{*lane_, *slot, asked};
  }
  ROWE_RT result<request<json_text>> try_next() noexcept { return try_next(rt::monotonic_clock::now()); }
  result<request<json_text>> next(duration timeout) noexcept {
    return detail::wait_next(lane_, timeout, [this] { return try_next(); });
  }

  // As responder<Q, A>; also too_big (the option `text_bytes_max`): the request can still be answered.
  ROWE_RT status reply(request<json_text>& to, body object, time_point now) noexcept {
    return to.answer(lane_, object, now);
  }
  ROWE_RT status reply(request<json_text>& to, body object) noexcept {
    return reply(to, object, rt::monotonic_clock::now());
  }
  ROWE_RT status refuse(request<json_text>& to, std::string_view sentence, time_point now) noexcept {
    return to.refuse(lane_, sentence, now);
  }
  ROWE_RT status refuse(request<json_text>& to, std::string_view sentence) noexcept {
    return refuse(to, sentence, rt::monotonic_clock::now());
  }

 private:
  detail::lane_handle lane_;
};

} // namespace rowe
