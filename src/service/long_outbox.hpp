// SPDX-License-Identifier: Apache-2.0
// Composes long messages: their text stays where it is, in chunks, and the slot has only what stands around
// it. Where slots or chunks are taken, the peer that holds most loses its oldest long message. Service thread
// only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/core_state.hpp"
#include "service/message_store.hpp"
#include "service/outbox.hpp"

namespace rowe::service {

class long_outbox {
 public:
  struct needs {
    core_state& state;
    class message_store& message_store;
    class outbox& outbox;
  };
  explicit long_outbox(const needs& parts) noexcept
      : state_{parts.state}, message_store_{parts.message_store}, outbox_{parts.outbox} {}

  // Whether so many chunks are free, besides those for what is received. For them it gives up what is kept
  // for pages, then evicts long messages, then ends pages.
  bool make_room(std::uint32_t chunks) noexcept;
  // Composes a topic's message whose body is a long text. None, counted: what is on its way has all slots for
  // long messages, or all chunks but those for what is received.
  slot_id compose(topic_id topic, rt::time_point published, rt::time_point expires, text_id body) noexcept;

 private:
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
};

} // namespace rowe::service
