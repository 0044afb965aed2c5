// SPDX-License-Identifier: Apache-2.0
// From a value to the queues of those who want it: encoded once, not per peer. A template over
// what writes the body (a struct's encoder, text that is JSON already, the statistics), so that it is written
// where it stays. Service thread only.
#pragma once
#include "service/core.hpp"

namespace rowe::service {

// Sends a value to everyone who wants it now. `published` is its own time, `expires` the end of it. With
// `latches` it is kept for those who come late.
template <class WriteBody>
void core::publish(std::uint32_t topic_index, rt::time_point published, rt::time_point expires,
                   latch_owner latches, WriteBody&& write_body, const published_by& who) noexcept {
  topic& on = router_.at(topic_index);
  note(on, published);
  if (expires < now_) return add(counter::expired);
  const bool keeps = latches.who != latch_owner::kind::nobody;
  if (!keeps && !wanted_now(on)) return;
  const std::uint32_t slot = outbox_.compose_message(topic_index, expires, write_body);
  if (slot == no_index) return;
  on.bytes = slots_.body(slot).size();
  if (keeps) keep_latched(on, slot, latches);
  outbox_.fan_out(topic_index, slot);
  for (std::uint32_t i = on.first_inbox; i != no_index; i = views_[i].next_inbox)
    deliver_inbox(i, slots_.body(slot), who);
  release(slot);
}

} // namespace rowe::service
