// SPDX-License-Identifier: Apache-2.0
// Publishers: from endpoint::advertise<T>(), for one thread, in a loop.
#pragma once
#include <cstdint>
#include <cstring>
#include <utility>

#include <rowe/detail/payload.hpp>
#include <rowe/detail/posting.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/json_text.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// Publishes values of one type: a struct that has a schema, or json_text. For json_text each value is one
// JSON object, as a message or as text. The service thread validates it. A value that is no object is dropped
// there, and counted as `malformed`. Move-only; one thread at a time.
template <class T>
class publisher {
  using payload = detail::payload<T>;

 public:
  // A struct, by reference; for json_text a rowe::body: a message or a text.
  using given = typename payload::given;

  publisher() noexcept = default; // empty: every call says errc::misuse
  explicit publisher(detail::pair_handle pair) noexcept : pair_{std::move(pair)} {}

  // Hands a copy of `value` to the service thread, which sends it as JSON to all that listen. `now` is the
  // loop's time (rt::periodic::wait() returns it); the value's time to live counts from then. Errors: no_peer
  // (nobody listens: nothing was queued), full (keep::all only: `depth` values are still waiting), closed,
  // misuse (an empty handle); for json_text also too_big (longer than the option `text_bytes_max`, or a
  // message that overflowed). All except closed and misuse are counted, so a loop may ignore the status.
  // Never waits, never allocates, no system call: it copies the value and does one release store.
  ROWE_RT status publish(given value, time_point now) noexcept {
    if (!pair_) return errc::misuse;
    if (const std::size_t capacity = payload::outgrown(value); capacity != 0) [[unlikely]]
      return detail::outgrew(*pair_, capacity);
    return detail::publish_into(*pair_, payload::bytes(value), now, [&](std::byte* slot) {
      if (payload::bytes(value) != 0) std::memcpy(slot, payload::data(value), payload::bytes(value));
    });
  }
  // The same; reads the time itself: one clock read more.
  ROWE_RT status publish(given value) noexcept { return publish(value, rt::monotonic_clock::now()); }

  // Whether anybody listens now. For loops that do not want to compute values for nobody.
  ROWE_RT bool wanted() const noexcept {
    return pair_ && pair_->audience.advice() == detail::audience::somebody;
  }
  // Values accepted, and refused because nobody listened or because the queue was full. Any thread.
  ROWE_RT std::uint64_t published() const noexcept { return pair_ ? pair_->published.get() : 0; }
  ROWE_RT std::uint64_t dropped_no_peer() const noexcept { return pair_ ? pair_->no_peer.get() : 0; }
  ROWE_RT std::uint64_t dropped_full() const noexcept { return pair_ ? pair_->refused_full.get() : 0; }

 private:
  detail::pair_handle pair_;
};

} // namespace rowe
