// SPDX-License-Identifier: Apache-2.0
// Subscribers: from endpoint::subscribe<T>(), for one thread.
#pragma once
#include <type_traits>
#include <utility>

#include <rowe/detail/calls.hpp>
#include <rowe/detail/lane.hpp>
#include <rowe/json_text.hpp>
#include <rowe/message_view.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// Takes the messages of a topic decoded into a struct that has a schema; those that are not what it says are
// counted as `undecodable` and dropped. Move-only; one thread at a time.
template <class T>
class subscriber {
  static_assert(described<T>, "a subscribed struct needs a schema: see rowe/schema.hpp");
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= detail::value_alignment);

 public:
  subscriber() noexcept = default; // empty: every call says errc::misuse
  explicit subscriber(detail::lane_handle lane) noexcept : lane_{std::move(lane)} {}

  // The oldest value that has arrived and was not taken; with keep::newest the newest one, if it was not
  // taken yet. Errors: empty (none has), closed (the endpoint is, and nothing is left), misuse (an empty
  // handle). Never waits, never allocates, no system call.
  ROWE_RT result<value_view<T>> try_take() noexcept {
    if (!lane_) return errc::misuse;
    const bool over = detail::closed(*lane_); // before looking: what came before it closed is still there
    detail::emptying_end& path = lane_->user.in;
    if (path.newest != nullptr) {
      const auto found = path.newest->begin_read();
      if (found.state == rt::freshness::fresh)
        return value_view<T>{*lane_, found.slot | value_view<T>::of_window};
    } else if (const auto slot = path.out->try_pop()) {
      return value_view<T>{*lane_, *slot};
    }
    return over ? errc::closed : errc::empty;
  }

  // The newest value; older ones that were not taken are given back unread. Errors as try_take(). Never
  // waits, never allocates, no system call; at most `depth` steps.
  ROWE_RT result<value_view<T>> latest() noexcept {
    result<value_view<T>> newest = try_take();
    if (!newest || lane_->user.in.newest != nullptr) return newest;
    for (std::size_t left = lane_->user.in.out->waiting_at_least(); left > 0; --left) newest = try_take();
    return newest;
  }

  // Waits for the next value at most `timeout` (negative: for ever). Errors: as try_take(), but timed_out in
  // place of empty. Not for real-time loops: sleeps in the kernel.
  result<value_view<T>> take(duration timeout) noexcept {
    return detail::wait_next(lane_, timeout, [this] { return try_take(); });
  }

 private:
  detail::lane_handle lane_;
};

// Takes the messages of a topic as JSON text. Move-only; one thread at a time.
template <>
class subscriber<json_text> {
 public:
  subscriber() noexcept = default; // empty: every call says errc::misuse
  explicit subscriber(detail::lane_handle lane) noexcept : lane_{std::move(lane)} {}

  // The oldest message that has arrived and was not taken. Errors: empty (none has), closed (the endpoint is,
  // and nothing is left), misuse (an empty handle). Never waits, never allocates, no system call.
  ROWE_RT result<message_view> try_take() noexcept {
    if (!lane_) return errc::misuse;
    const bool over = detail::closed(*lane_); // before looking: what came before it closed is still there
    if (const auto slot = lane_->user.in.out->try_pop()) {
      return message_view{*lane_, lane_->user.in, *slot};
    }
    return over ? errc::closed : errc::empty;
  }

  // The newest message; older ones that were not taken are given back unread. Errors as try_take(). Never
  // waits, never allocates, no system call; at most `depth` steps.
  ROWE_RT result<message_view> latest() noexcept {
    result<message_view> newest = try_take();
    for (std::size_t left = newest ? lane_->user.in.out->waiting_at_least() : 0; left > 0; --left) {
      newest = try_take();
    }
    return newest;
  }

  // Waits for the next message at most `timeout` (negative: for ever). Errors: as try_take(), but timed_out
  // in place of empty. Not for real-time loops: sleeps in the kernel.
  result<message_view> take(duration timeout) noexcept {
    return detail::wait_next(lane_, timeout, [this] { return try_take(); });
  }

 private:
  detail::lane_handle lane_;
};

} // namespace rowe
