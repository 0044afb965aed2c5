// SPDX-License-Identifier: Apache-2.0
// Subscribers: from endpoint::subscribe<T>(), for one thread.
#pragma once
#include <cstddef>
#include <utility>

#include <rowe/detail/payload.hpp>
#include <rowe/detail/posting.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/waiting.hpp>
#include <rowe/json_text.hpp>
#include <rowe/message_view.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// Takes the messages of a topic, decoded into a struct that has a schema. Messages that do not match the
// schema are counted as `undecodable` and dropped. For json_text, messages are taken as they are. Move-only;
// one thread at a time.
template <class T>
class subscriber {
 public:
  // A value_view of a struct; a message_view of text.
  using view = typename detail::payload<T>::view;

  subscriber() noexcept = default; // empty: every call says errc::misuse
  explicit subscriber(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // Takes the oldest value that has arrived; with keep::newest, which texts do not have, the newest one, if
  // it was not taken yet. Errors: empty (there is none), closed (the endpoint is, and nothing is left),
  // misuse (an empty handle). Never waits, never allocates, no system call.
  ROWE_RT result<view> try_take() noexcept {
    if (!pair_) return errc::misuse;
    const bool over = detail::closed(*pair_); // before looking: what came before it closed is still there
    detail::consumer_end& end = pair_->user.in;
    if (keeps_newest()) {
      if constexpr (!detail::is_text<T>) {
        const auto found = end.newest->begin_read();
        if (found.state == rt::freshness::fresh) return view{*pair_, end, found.slot | view::of_window};
      }
    } else if (const auto slot = end.ring->try_pop()) {
      return view{*pair_, end, *slot};
    }
    return over ? errc::closed : errc::empty;
  }

  // The newest value. Older values that were not taken are released unread. Errors as try_take(). Never
  // waits, never allocates, no system call; at most `depth` steps.
  ROWE_RT result<view> latest() noexcept {
    result<view> newest = try_take();
    if (!newest || keeps_newest()) return newest;
    for (std::size_t left = pair_->user.in.ring->pending_at_least(); left > 0; --left) newest = try_take();
    return newest;
  }

  // Waits for the next value at most `timeout` (negative: for ever). Errors: as try_take(), but timed_out in
  // place of empty. Not for real-time loops: sleeps in the kernel.
  result<view> take(duration timeout) noexcept {
    return detail::wait_next(pair_, timeout, [this] { return try_take(); });
  }

 private:
  bool keeps_newest() const noexcept {
    if constexpr (detail::is_text<T>) {
      return false; // see subscribe_request()
    } else {
      return pair_->user.in.newest != nullptr;
    }
  }

  detail::pair_handle pair_;
};

} // namespace rowe
