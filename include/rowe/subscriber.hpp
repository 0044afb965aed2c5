// SPDX-License-Identifier: Apache-2.0
// Subscribers: from endpoint::subscribe<T>(), for one thread.
#pragma once
#include <cstddef>
#include <cstdint>
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

  // Takes the oldest value that has arrived and whose time to live is not over; with keep::newest, which
  // texts do not have, the newest one, if it was not taken yet. A value has a time to live if its publisher
  // gave it one (topic_options::ttl); the time of a peer's value counts from its arrival here. Errors: empty
  // (there is none), closed (the endpoint is, and nothing is left), misuse (an empty handle). Never waits,
  // never allocates, no system call; at most as many steps as `depth`. Without `now` it reads the clock, if a
  // value has a time to live.
  ROWE_RT result<view> try_take(time_point now) noexcept { return take_at(&now); }
  ROWE_RT result<view> try_take() noexcept { return take_at(nullptr); }

  // The newest value. Older values that were not taken are released unread. Otherwise as try_take().
  ROWE_RT result<view> latest(time_point now) noexcept { return take_newest_at(&now); }
  ROWE_RT result<view> latest() noexcept { return take_newest_at(nullptr); }

  // With a lease (topic_options::lease): the command that is in force at `now`, the same one as long as it
  // is. `now` is the loop's own clock, read in this cycle. A command is in force from its arrival until a
  // newer one arrives; until the lease is over, which counts from when it was sent; until its sender drives
  // no more; and until the robot is stopped. Errors: empty (none is in force: stand still), closed, misuse
  // (an empty handle, or one without a lease). Never waits, never allocates, no system call, a bounded number
  // of steps. With a lease, the other calls say misuse, so no loop acts on a command that is over.
  ROWE_RT result<view> latest_within(time_point now) noexcept {
    if (!pair_ || pair_->lease == duration{}) return errc::misuse;
    if (detail::closed(*pair_)) return pair_->closed_as;
    if constexpr (!detail::is_text<T>) {
      const auto found = pair_->user.in.newest->begin_read();
      if (found.state == rt::freshness::empty) return errc::empty;
      const detail::value_header& its = *pair_->user.in.memory.header(found.slot);
      if (its.expires_ns > rt::nanoseconds_of(now) && pair_->turn.is(its.outcome_value))
        return view{*pair_, pair_->user.in, found.slot | view::of_window};
    }
    return errc::empty;
  }

  // How many values arrived here, and were out of date when they would have been taken.
  ROWE_RT std::uint64_t expired() const noexcept { return pair_ ? pair_->expired_here.get() : 0; }

  // Waits for the next value at most `timeout` (negative: for ever). Errors: as try_take(), but timed_out in
  // place of empty. Not for real-time loops: sleeps in the kernel.
  result<view> take(duration timeout) noexcept {
    return detail::wait_next(pair_, timeout, [this] { return try_take(); });
  }

 private:
  // nullptr: now.
  result<view> take_at(const time_point* at) noexcept {
    if (!pair_) return errc::misuse;
    const bool over = detail::closed(*pair_); // before looking: what came before it closed is still there
    detail::consumer_end& end = pair_->user.in;
    if (keeps_newest()) {
      if constexpr (!detail::is_text<T>) {
        if (pair_->lease != duration{}) [[unlikely]]
          return errc::misuse;
        const auto found = end.newest->begin_read();
        if (found.state == rt::freshness::fresh &&
            (!detail::has_time_to_live(*pair_, found.slot) || !detail::drops_expired(*pair_, found.slot, at)))
          return view{*pair_, end, found.slot | view::of_window};
      }
    } else if (auto slot = end.ring->try_pop()) {
      if (detail::has_time_to_live(*pair_, *slot)) [[unlikely]]
        slot = detail::first_in_time(*pair_, *slot, at);
      if (slot) return view{*pair_, end, *slot};
    }
    return over ? pair_->closed_as : errc::empty;
  }

  result<view> take_newest_at(const time_point* at) noexcept {
    result<view> newest = take_at(at);
    if (!newest || keeps_newest()) return newest;
    for (std::size_t left = pair_->user.in.ring->pending_at_least(); left > 0; --left) {
      if (result<view> next = take_at(at)) newest = std::move(next);
    }
    return newest;
  }

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
