// SPDX-License-Identifier: Apache-2.0
// Subscribers: from endpoint::subscribe<T>(), for one thread.
#pragma once
#include <optional>
#include <string_view>
#include <utility>

#include <rowe/detail/lane.hpp>
#include <rowe/json_text.hpp>

namespace rowe {

template <class T>
class subscriber;

// A message that arrived: a view of its text, which is valid JSON, in a slot of the subscriber. Gives the
// slot back when it is destroyed, on the subscriber's thread and before the subscriber.
class message_view {
 public:
  ROWE_RT message_view(message_view&& from) noexcept
      : lane_{std::exchange(from.lane_, nullptr)}, slot_{from.slot_} {}
  ROWE_RT message_view& operator=(message_view&& from) noexcept {
    std::swap(lane_, from.lane_);
    std::swap(slot_, from.slot_);
    return *this;
  }
  ROWE_RT ~message_view() {
    if (lane_ != nullptr) lane_->user.in.home->give(slot_);
  }

  // The message's body: one JSON value. 64 bytes behind it may be read.
  ROWE_RT std::string_view text() const noexcept {
    return {reinterpret_cast<const char*>(lane_->user.in.slots.value(slot_)),
            lane_->user.in.slots.header(slot_)->bytes};
  }
  // When its last byte was read from the socket.
  ROWE_RT time_point arrived() const noexcept {
    return time_point{duration{lane_->user.in.slots.header(slot_)->stamped_ns}};
  }

 private:
  friend class subscriber<json_text>;
  ROWE_RT message_view(detail::lane& on, std::uint32_t slot) noexcept : lane_{&on}, slot_{slot} {}

  detail::lane* lane_;
  std::uint32_t slot_;
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
    if (const auto slot = lane_->user.in.out->try_pop()) return message_view{*lane_, *slot};
    return closed() ? errc::closed : errc::empty;
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

  // Waits for the next message at most `patience` (negative: for ever). Errors: as try_take(), but timed_out
  // in place of empty. Not for real-time loops: sleeps in the kernel.
  result<message_view> take(duration patience) noexcept {
    if (!lane_) return errc::misuse;
    lane_->news.wait_until(rt::deadline_after(rt::monotonic_clock::now(), patience),
                           [&] { return lane_->user.in.out->waiting_at_least() > 0 || closed(); });
    result<message_view> taken = try_take();
    if (!taken && taken.code() == errc::empty) return error{errc::timed_out, 0, patience.count()};
    return taken;
  }

 private:
  bool closed() const noexcept {
    // acquire: pairs with the release in endpoint_state::close(), after which nothing is pushed
    return lane_->heard_by.load(std::memory_order_acquire) == detail::audience::closed;
  }

  detail::lane_handle lane_;
};

} // namespace rowe
