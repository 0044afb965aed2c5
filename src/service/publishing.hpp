// SPDX-License-Identifier: Apache-2.0
// From a value to the queues of those who want it: encoded once per dialect, not per peer. A template over
// what writes the body (a struct's encoder, text that is JSON already, the statistics), so that it is written
// where it stays. Service thread only.
#pragma once
#include "service/core.hpp"

namespace rowe::service {

// The whole text of one message, which `write_text(json::writer&)` writes, in a slot with one reference;
// no_index, counted, when there is no slot or none is large enough. Tried in a small slot first; the peer
// that holds most makes room. What the stop needs may take the last slot.
template <class WriteText>
std::uint32_t core::compose(rt::time_point expires, WriteText&& write_text, slot_use what) noexcept {
  counter why = counter::no_slot;
  for (const slot_class size : {slot_class::small, slot_class::large}) {
    const bool none = slots_.free_for_all(size) == 0;
    if (none && what == slot_use::ordinary)
      (void)reclaim(size); // whether it did is seen by what can be taken
    const auto slot = slots_.take(slots_.bytes_of(size), what);
    if (!slot) continue;
    json::writer text{slots_.room(*slot)};
    write_text(text);
    if (!text.overflowed() && text.bytes() <= text_bytes_max()) {
      if (text.nonfinite() != 0) add(counter::nonfinite, text.nonfinite());
      seal(*slot, text.bytes(), expires);
      return *slot;
    }
    release(*slot);
    if (size == slot_class::large) why = counter::too_big;
  }
  add(why);
  return no_index;
}

// An answer to one peer: never thinned out, and dropped as late only where it has a time of its own. Returns
// its slot; no_index when it is lost, counted.
template <class WriteText>
std::uint32_t core::answer(connection& c, WriteText&& write_text, rt::time_point expires) noexcept {
  if (!c.open()) return no_index;
  const bool has_place = has_place_for_answer(c);
  const std::uint32_t slot = has_place ? compose(expires, write_text) : no_index;
  if (!has_place) add(counter::outbox_full);
  if (slot == no_index) return no_index;
  if (enqueue(c.direct, slot)) {
    list(c);
    return slot;
  }
  release(slot);
  add(counter::outbox_full);
  return no_index;
}

// The message of `topic` whose body `write_body(json::writer&)` writes, as compose() does.
template <class WriteBody>
std::uint32_t core::encode(std::uint32_t topic, rt::time_point expires, WriteBody&& write_body) noexcept {
  std::size_t body_at = 0;
  std::size_t body_bytes = 0;
  const std::uint32_t slot = compose(expires, [&](json::writer& text) {
    text.append(router_.head(topic));
    body_at = text.bytes();
    write_body(text);
    body_bytes = text.bytes() - body_at;
    text.append(wire::rosbridge::publish_tail);
  });
  if (slot != no_index) slots_.mark_body(slot, body_at, body_bytes);
  return slot;
}

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
  const std::uint32_t slot = encode(topic_index, expires, write_body);
  if (slot == no_index) return;
  on.bytes = slots_.body(slot).size();
  if (keeps) keep_latched(on, slot, latches);
  deliver(topic_index, slot);
  for (std::uint32_t i = on.first_inbox; i != no_index; i = views_[i].next_inbox)
    deliver_inbox(i, slots_.body(slot), who);
  release(slot);
}

} // namespace rowe::service
