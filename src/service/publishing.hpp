// SPDX-License-Identifier: Apache-2.0
// From a value to the queues of those who want it: encoded once per dialect, not per peer. A template over
// what writes the body (a struct's encoder, text that is JSON already, the statistics), so that it is written
// where it stays. Service thread only.
#pragma once
#include "service/core.hpp"

namespace rowe::service {

// The message of `topic` whose body `write_body(json::writer&)` writes, in a slot with one reference;
// no_index, counted, when there is no slot or none is large enough.
template <class WriteBody>
std::uint32_t core::encode(std::uint32_t topic, rt::time_point expires, WriteBody&& write_body) noexcept {
  counter why = counter::no_slot;
  for (const std::size_t size : {slots_.small_bytes(), slots_.large_bytes()}) {
    const auto slot = slots_.take(size);
    if (!slot) continue;
    json::writer text{slots_.room(*slot)};
    text.append(router_.head(topic));
    const std::size_t body_at = text.bytes();
    write_body(text);
    const std::size_t body_bytes = text.bytes() - body_at;
    text.append(wire::rosbridge::publish_tail);
    if (!text.overflowed()) {
      if (text.nonfinite() != 0) add(counter::nonfinite, text.nonfinite());
      finish(*slot, text.bytes(), body_at, body_bytes, expires);
      return *slot;
    }
    release(*slot);
    if (size == slots_.large_bytes()) why = counter::too_big;
  }
  add(why);
  return no_index;
}

// Sends a value to everyone who wants it now. `published` is its own time, `expires` the end of it.
template <class WriteBody>
void core::publish(std::uint32_t topic_index, rt::time_point published, rt::time_point expires,
                   WriteBody&& write_body) noexcept {
  topic& on = router_.at(topic_index);
  note(on, published);
  if (expires < now_) return add(counter::expired);
  if (!wanted_now(on)) return;
  const std::uint32_t slot = encode(topic_index, expires, write_body);
  if (slot == no_index) return;
  on.bytes = slots_.body(slot).size();
  deliver(topic_index, slot);
  for (std::uint32_t i = on.first_inbox; i != no_index; i = views_[i].next_inbox)
    deliver_inbox(i, slots_.body(slot));
  release(slot);
}

} // namespace rowe::service
