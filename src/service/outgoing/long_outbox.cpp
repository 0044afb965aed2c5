// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/long_outbox.hpp"

namespace rowe::service {

bool long_outbox::make_room(std::uint32_t chunks) noexcept {
  for (unsigned left = evictions_max; state_.chunks.left() < std::int64_t{chunks}; --left) {
    if (left == 0) return false;
    if (!state_.last_values.give_up_long() && !outbox_.evict_for(slot_class::chunked) &&
        !state_.long_pages.give_up())
      return false;
  }
  return true;
}

bool long_outbox::has_room() noexcept {
  if (message_store_.slots().free_for_all(slot_class::chunked) == 0)
    (void)outbox_.evict_for(slot_class::chunked);
  if (make_room(0)) return true;
  state_.counts.add(counter::no_chunks);
  return false;
}

slot_id long_outbox::compose(topic_id topic, rt::time_point published, rt::time_point expires,
                             text_id body) noexcept {
  if (!has_room()) return {};
  const message_lifetime lifetime = message_lifetime::of_topic(expires, state_.cycle.now);
  return message_store_.compose_chunked(body, lifetime, published, [&](json::writer& out) {
    out.append(state_.topics.head(topic));
    const std::size_t at = out.bytes();
    out.append(state_.topics.tail());
    return at;
  });
}

slot_id long_outbox::compose_latched(topic_id topic, const latched_value& kept) noexcept {
  if (is_long(kept)) return compose(topic, kept.published, kept.expires, kept.chunks);
  return outbox_.compose_message(topic, kept.published, kept.expires,
                                 [&](json::writer& into) { state_.latches.write(kept, into); });
}

} // namespace rowe::service
