// SPDX-License-Identifier: Apache-2.0
// From a value to the queues of those who want it: encoded once per dialect, not per peer. A template over
// what writes the body (a struct's encoder, text that is JSON already, the statistics), so that it is written
// where it stays. Service thread only.
#pragma once
#include "service/core.hpp"

namespace rowe::service {

inline constexpr std::uint32_t direct_depth = 64; // answers to one peer that it has not read yet
// The same of a peer that reads more slowly than it is written to: a few that ask and do not read must not
// take the slots of all.
inline constexpr std::uint32_t direct_depth_behind = 16;

// The whole text of one message, which `write_text(json::writer&)` writes, in a slot with one reference;
// no_index, counted, when there is no slot or none is large enough. Tried in a small slot first; what peers
// hold that do not read makes room.
template <class WriteText>
std::uint32_t core::compose(rt::time_point expires, WriteText&& write_text) noexcept {
  counter why = counter::no_slot;
  for (const std::size_t size : {slots_.small_bytes(), slots_.large_bytes()}) {
    if (!slots_.has_free(size)) (void)reclaim(size); // whether it did is seen by what can be taken
    const auto slot = slots_.take(size);
    if (!slot) continue;
    json::writer text{slots_.room(*slot)};
    write_text(text);
    if (!text.overflowed() && text.bytes() <= text_bytes_max()) {
      if (text.nonfinite() != 0) add(counter::nonfinite, text.nonfinite());
      seal(*slot, text.bytes(), expires);
      return *slot;
    }
    release(*slot);
    if (size == slots_.large_bytes()) why = counter::too_big;
  }
  add(why);
  return no_index;
}

// An answer to one peer: never thinned out, and dropped as late only where it has a time of its own. Returns
// its slot; no_index when it is lost, counted.
template <class WriteText>
std::uint32_t core::answer(connection& c, WriteText&& write_text, rt::time_point expires) noexcept {
  if (!c.open()) return no_index;
  drop_dead(c.direct);
  const bool has_place = c.direct.count < (c.behind() ? direct_depth_behind : direct_depth);
  const std::uint32_t slot = has_place ? compose(expires, write_text) : no_index;
  if (!has_place) add(counter::outbox_full);
  if (slot == no_index) return no_index;
  if (entries_.push(c.direct, slots_.ref(slot))) {
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
