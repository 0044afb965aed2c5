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

  // Whether so many chunks are free, besides those for what is received. For them it gives up what is kept
  // for pages, then evicts long messages, then ends pages.
  bool make_room(std::uint32_t chunks) noexcept;
  // Composes a topic's message whose body is a long text. None, counted: what is on its way has all slots for
  // long messages, or all chunks but those for what is received.
  slot_id compose(topic_id topic, rt::time_point published, rt::time_point expires, text_id body) noexcept;
  // A latched value of a topic, as a long message or a short one. None: no slot is free, which is counted.
  slot_id compose_latched(topic_id topic, const latched_value& kept) noexcept;
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
  bool has_room() noexcept;
};

} // namespace rowe::service
