// SPDX-License-Identifier: Apache-2.0
// Publishers: from endpoint::advertise<T>(), for one thread, in a loop.
#pragma once
#include <cstring>
#include <string_view>
#include <type_traits>

#include <rowe/detail/lane.hpp>
#include <rowe/json_text.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// Publishes values of a struct that has a schema. Move-only; one thread at a time.
template <class T>
class publisher {
  static_assert(described<T>, "a published struct needs a schema: see rowe/schema.hpp");
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= detail::value_alignment);

 public:
  publisher() noexcept = default; // empty: every call says errc::misuse
  explicit publisher(detail::lane_handle lane) noexcept : lane_{std::move(lane)} {}

  // Hands a copy of `value` to the service thread, which sends it as JSON to whoever listens. `now` is the
  // loop's time (rt::periodic::wait() returns it); the value's time to live runs from then. Errors: no_peer
  // (nobody listens: nothing was queued), full (keep::all only: `depth` values are still waiting), closed,
  // misuse (an empty handle). Each but closed and misuse is counted, so a loop may ignore the status. Never
  // waits, never allocates, no system call: copying the struct and one release store.
  ROWE_RT status publish(const T& value, time_point now) noexcept {
    if (!lane_) return errc::misuse;
    return detail::publish_into(*lane_, sizeof(T), now,
                                [&](std::byte* slot) { std::memcpy(slot, &value, sizeof(T)); });
  }
  // The same with the time read here: one clock read more.
  ROWE_RT status publish(const T& value) noexcept { return publish(value, rt::monotonic_clock::now()); }

  // Whether somebody listens at the moment; for loops that would rather not compute what nobody wants.
  ROWE_RT bool wanted() const noexcept {
    return lane_ && lane_->audience.advice() == detail::audience::somebody;
  }
  // Values accepted, and refused because nobody listened or because the queue was full. Any thread.
  ROWE_RT std::uint64_t published() const noexcept { return lane_ ? lane_->published.get() : 0; }
  ROWE_RT std::uint64_t dropped_no_peer() const noexcept { return lane_ ? lane_->no_peer.get() : 0; }
  ROWE_RT std::uint64_t dropped_full() const noexcept { return lane_ ? lane_->refused_full.get() : 0; }

 private:
  detail::lane_handle lane_;
};

// Publishes text that is JSON already: one object. The service thread validates it; what is no JSON object is
// dropped there and counted as `malformed`.
template <>
class publisher<json_text> {
 public:
  publisher() noexcept = default;
  explicit publisher(detail::lane_handle lane) noexcept : lane_{std::move(lane)} {}

  // As publisher<T>::publish; also too_big: `text` is longer than the option `text_bytes_max`.
  ROWE_RT status publish(std::string_view text, time_point now) noexcept {
    if (!lane_) return errc::misuse;
    return detail::publish_into(*lane_, text.size(), now, [&](std::byte* slot) {
      text.copy(reinterpret_cast<char*>(slot), text.size());
    });
  }
  ROWE_RT status publish(std::string_view text) noexcept { return publish(text, rt::monotonic_clock::now()); }

  ROWE_RT bool wanted() const noexcept {
    return lane_ && lane_->audience.advice() == detail::audience::somebody;
  }
  ROWE_RT std::uint64_t published() const noexcept { return lane_ ? lane_->published.get() : 0; }
  ROWE_RT std::uint64_t dropped_no_peer() const noexcept { return lane_ ? lane_->no_peer.get() : 0; }
  ROWE_RT std::uint64_t dropped_full() const noexcept { return lane_ ? lane_->refused_full.get() : 0; }

 private:
  detail::lane_handle lane_;
};

} // namespace rowe
