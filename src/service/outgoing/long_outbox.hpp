// SPDX-License-Identifier: Apache-2.0
// Composes long messages: their text stays where it is, in chunks, and the slot has only what stands around
// it. Where slots or chunks are taken, the peer that holds most loses its oldest long message. Service thread
// only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct long_outbox_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
};

class long_outbox : long_outbox_needs {
 public:
  explicit long_outbox(const long_outbox_needs& parts) noexcept : long_outbox_needs{parts} {}

  // Whether so many chunks are free, besides those for what is received. For them it gives up what is stored
  // for pages, then evicts long messages, then ends pages.
  bool make_room(std::uint32_t chunks) noexcept {
    for (unsigned left = evictions_max; state_.chunks.left() < std::int64_t{chunks}; --left) {
      if (left == 0) return false;
      if (!state_.last_values.give_up_long() && !outbox_.evict_for(slot_class::chunked) &&
          !state_.long_pages.give_up())
        return false;
    }
    return true;
  }
  // Composes a topic's message whose body is a long text. None, counted: what is on its way has all slots for
  // long messages, or all chunks but those for what is received.
  slot_id compose(topic_id topic, rt::time_point published, rt::time_point expires, text_id body) noexcept {
    if (!has_room()) return {};
    const message_lifetime lifetime = message_lifetime::of_topic(expires, state_.cycle.now);
    return message_store_.compose_chunked(body, lifetime, published, [&](json::writer& out) {
      out.append(state_.topics.head(topic));
      const std::size_t at = out.bytes();
      out.append(state_.topics.tail());
      return at;
    });
  }
  // A latched value of a topic, as a long message or a short one. None: no slot is free, which is counted.
  slot_id compose_latched(topic_id topic, const latched_value& kept) noexcept {
    if (is_long(kept)) return compose(topic, kept.published, kept.expires, kept.chunks);
    return outbox_.compose_message(topic, kept.published, kept.expires,
                                   [&](json::writer& into) { state_.latches.write(kept, into); });
  }
  // Whether it is a long one.
  bool is_long(const latched_value& kept) const noexcept {
    return kept.chunks && kept.bytes > state_.bounds().message_bytes_max;
  }
  // Queues a call, or an answer, with a long value in it to one peer: it may be evicted for others.
  // `write_text(json::writer&)` writes it with the stand-in. Returns its slot. Errors, counted: full, or the
  // peer is closing; too_big, as message_store::compose_around().
  template <class WriteText>
  result<slot_id> reply(peer_index to, const long_value& value, WriteText&& write_text) noexcept {
    result<slot_id> composed = errc::full;
    const slot_id queued = outbox_.reply_with(to, [&] {
      if (has_room()) composed = message_store_.compose_around(value, write_text);
      return composed ? *composed : slot_id{};
    });
    return queued || !composed ? composed : errc::full;
  }

  std::uint32_t generation_of(slot_id slot) const noexcept {
    return message_store_.slots().ref(slot).generation;
  }
  // Whether some of a message was written, but not all.
  bool is_being_written(slot_ref which) const noexcept {
    const slot_pool& slots = message_store_.slots();
    return slots.alive(which) && slots.partial(which.index) != 0;
  }

 private:
  // Makes room for one message more. False, counted: there is none.
  bool has_room() noexcept {
    if (message_store_.slots().free_for_all(slot_class::chunked) == 0)
      (void)outbox_.evict_for(slot_class::chunked);
    if (make_room(0)) return true;
    state_.counts.add(counter::no_chunks);
    return false;
  }
};

} // namespace rowe::service
