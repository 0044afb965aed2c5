// SPDX-License-Identifier: Apache-2.0
#include "service/topics/recorded_values.hpp"

#include "service/base/service_limits.hpp"

namespace rowe::service {

bool recorded_values::keep(topic_id index, std::span<const char> body, rt::time_point published) noexcept {
  if (!state_.recordings.look(index)) return false;
  state_.recordings.keep(index, {body.data(), body.size()}, state_.cycle.now, published);
  return true;
}

bool recorded_values::keep_long(topic_id index, text_id value, rt::time_point published,
                                std::uint8_t by) noexcept {
  if (!state_.recordings.look(index)) return false;
  state_.recordings.keep_long(index, value, state_.cycle.now, published, by);
  state_.due.arm(timer::recording, state_.cycle.now);
  return true;
}

void recorded_values::keep_latched(topic_id index, std::uint8_t by) noexcept {
  const latched_list& all = state_.topics.at(index).latched;
  latched_place at;
  while (const latch_id i = state_.latches.next(all, at, state_.latches.newest())) {
    at = {i, state_.latches.at(i).number};
    const latched_value& kept = state_.latches.at(i).value;
    if (long_outbox_.is_long(kept)) {
      (void)keep_long(index, kept.chunks, kept.published, by);
    } else if (const slot_id slot = long_outbox_.compose_latched(index, kept)) {
      const auto body = message_store_.slots().body(slot);
      state_.recordings.keep(index, {body.data(), body.size()}, state_.cycle.now, kept.published, by);
      message_store_.release(slot);
    }
  }
}

void recorded_values::copy_long_values() noexcept {
  state_.recordings.copy_long(long_copy_bytes);
  if (state_.recordings.any_long())
    state_.due.arm(timer::recording, state_.cycle.now + rt::duration{1}); // in the next cycle
}

} // namespace rowe::service
