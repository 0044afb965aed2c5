// SPDX-License-Identifier: Apache-2.0
// Which frames are written to a peer next, and how many: the rest of a partial frame, then urgent frames,
// then messages by their priority, as far as the batch and the peer's credit take them. The subscriptions of
// one priority take turns. Service thread only; nothing waits or allocates.
#pragma once
#include "service/batch.hpp"
#include "service/core_state.hpp"
#include "service/mask_keys.hpp"
#include "service/message_frames.hpp"
#include "service/message_store.hpp"
#include "service/outbox.hpp"
#include "service/partial_frames.hpp"
#include "service/urgent_frames.hpp"

namespace rowe::service {

// The peer that is written to, looked up once.
struct recipient {
  peer_index index;
  connection& peer;
  peer_queues& queues;
  bool masked;
};

class frame_selection {
 public:
  struct needs {
    core_state& state;
    class message_store& message_store;
    class outbox& outbox;
    class mask_keys& mask_keys;
    class urgent_frames& urgent_frames;
    class partial_frames& partial_frames;
    const class message_frames& message_frames;
  };
  explicit frame_selection(const needs& parts) noexcept
      : subscription_rows_{parts.state.subscriptions.all()},
        message_store_{parts.message_store},
        outbox_{parts.outbox},
        mask_keys_{parts.mask_keys},
        urgent_frames_{parts.urgent_frames},
        partial_frames_{parts.partial_frames},
        message_frames_{parts.message_frames} {}

  // Adds what is written first: a partial frame, then urgent frames. False: no message may follow.
  bool add_urgent(const recipient& to, batch& into) noexcept;
  // Then messages, by their priority.
  void add_messages(const recipient& to, batch& into) noexcept;
  // Adds the rest of a partial frame. Nothing may go before it. False: nothing may follow, either.
  bool add_partial(const recipient& to, batch& into) noexcept;

 private:
  bool add_queue(const recipient& to, queue& from, subscription_id of, batch& into) noexcept;

  const rows<subscription_id, subscription> subscription_rows_;
  message_store& message_store_;
  outbox& outbox_;
  mask_keys& mask_keys_;
  urgent_frames& urgent_frames_;
  partial_frames& partial_frames_;
  const message_frames& message_frames_;
};

} // namespace rowe::service
