// SPDX-License-Identifier: Apache-2.0
// Publishes a value that a handle submitted: a struct by its encoder, or text after it was checked. Service
// thread only; nothing waits or allocates. A user thread that sleeps is woken, which enters the kernel.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/rt/clock.hpp>

#include "service/state/core_state.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/publish_predictor.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/encoder.hpp"

namespace rowe::service {

struct value_publisher_needs {
  core_state& state_;
  broker& broker_;
  publish_predictor& publish_predictor_;
};

class value_publisher : value_publisher_needs {
 public:
  explicit value_publisher(const value_publisher_needs& parts) noexcept : value_publisher_needs{parts} {}

  // Publishes the value in this slot, which the caller releases. Counts what is malformed or expired.
  void publish(pair_index pair, pair_slot slot) noexcept;
  // Counts the values of a window that nobody read before this one.
  void note_newest(pair_index pair, std::uint64_t sequence) noexcept {
    pair_row& row = state_.pair_rows[pair];
    const std::uint64_t passed_over = sequence - row.sequence - 1;
    row.sequence = sequence;
    state_.topics.at(row.topic).messages += passed_over;
    state_.counts.add(counter::replaced, passed_over);
  }

 private:
};

// ---- inline definitions

inline void value_publisher::publish(pair_index pair, pair_slot slot) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const detail::value_header& header = *queues.service.out.memory.header(slot.value);
  const std::byte* const value = queues.service.out.memory.value(slot.value);
  const rt::time_point published = time_of(header.stamped_ns);
  const rt::time_point expires = state_.cycle.expiry_of(published, time_of(header.expires_ns));
  const topic_id topic = state_.pair_rows[pair].topic;
  const latch_owner latches =
      queues.latched ? latch_owner{latch_owner::kind::handle, pair.value} : latch_owner{};
  publish_predictor_.saw(pair, published);
  // Ends now, unlike one that is sent now or never: what is left of it is nothing.
  if (header.expires_ns != header.stamped_ns && expires == state_.cycle.now)
    return state_.counts.add(counter::expired);
  if (queues.kind == detail::pair_kind::publish_value) {
    return broker_.publish(topic, published, expires, latches,
                           [&](json::writer& into) { queues.encoder->encode(value, into); },
                           {.value = {value, queues.other_encoders}});
  }
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  if (!state_.seams.validator.validate(text) || !json::is_object(text))
    return state_.counts.add(counter::malformed);
  broker_.publish(topic, published, expires, latches, [&](json::writer& into) { into.raw(text); });
}

} // namespace rowe::service
