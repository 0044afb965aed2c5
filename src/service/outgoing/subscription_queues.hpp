// SPDX-License-Identifier: Apache-2.0
// The queues of subscriptions: what each may hold, how often it may be written, and whose turn it is. A
// subscription that may be written now is on the ready list of its peer and priority (peer_queues.hpp), where
// the sender finds it. A timer says when a throttled subscription may be written again.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/outgoing/long_outbox.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

// What messages are composed of that a codec writes whole: a value of a struct, or the text of its slot.
struct whole_source {
  rt::time_point published;
  rt::time_point expires;
  wire::typed_value value{};
};

struct subscription_queues_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  long_outbox& long_outbox_;
};

class subscription_queues : subscription_queues_needs {
 public:
  explicit subscription_queues(const subscription_queues_needs& parts) noexcept
      : subscription_queues_needs{parts}, subscription_rows_{state_.subscriptions.all()} {}

  // Queues a message for everyone who subscribes to the topic. The caller still holds its reference. `kept`:
  // it is the newest of the topic's latched values.
  void fan_out(topic_id topic, slot_id slot, bool kept) noexcept;
  // The same where some subscribers' codecs write whole messages: each such message is composed once, for the
  // first who takes it. `slot` may be none where no other codec needs it.
  void fan_out(topic_id topic, slot_id slot, bool kept, const whole_source& of) noexcept;
  // A message for everyone who subscribes to the topic found no room. Who still waits for latched values gets
  // it as one, if it was latched.
  void note_unsent(topic_id topic) noexcept;
  // The topic of a new subscription has latched values: the subscription must get them.
  void schedule_latched(subscription_id subscription) noexcept;
  // The requests for a subscription have changed, or the `keep` of its topic: sets its depth and throttle.
  void merge_requests(subscription_id subscription) noexcept;
  // The throttle of a subscription allows its next message.
  void throttle_over(subscription_id subscription) noexcept;
  // Drops all that a subscription has queued; it is not ready any more.
  void drop(subscription_id subscription) noexcept;

  // ---- sender

  // Queues one latched value of a ready subscription that waits for some. False: none can be queued now.
  bool place_pending_latched(peer_index peer) noexcept;
  // A message of the subscription goes to a socket.
  void mark_served(subscription_id subscription) noexcept {
    struct subscription& s = subscription_rows_[subscription];
    s.served = true;
    if (s.throttle != rt::duration{0}) [[unlikely]]
      begin_throttle(s);
  }
  // Takes subscriptions that have nothing to write off the ready lists. Those that were served go behind
  // those that were not, so that they take turns.
  void rotate_ready(peer_index peer) noexcept;

  // For checks. Whether a peer has a message that may be written now, in any of its queues.
  bool any_due(peer_index peer) const noexcept;
  // A subscription is marked ready if it is on a list, and timed if it is armed.
  bool check() const noexcept;

 private:
  void add(counter which) noexcept { state_.counts.add(which); }
  bool accepts(subscription& s) noexcept;
  void push(subscription_id subscription, slot_id slot, bool kept) noexcept;
  void note_full(const subscription& s) noexcept;
  void trim(subscription& s, std::uint32_t most) noexcept;
  void merge_codecs(subscription& s) noexcept;
  void place_latched(subscription& s) noexcept;
  latch_id next_latched(subscription& s, const latched_list& all) noexcept;
  bool joins_latched(subscription& s, bool kept) noexcept;
  slot_id compose_whole(const subscription& to, slot_id text, const whole_source& of) noexcept;
  // Makes it ready if it has something to write, and is not ready yet.
  void make_ready(subscription_id index) noexcept {
    subscription& s = subscription_rows_[index];
    if (!s.ready && (!s.pending.empty() || s.latched_pending)) put_on_ready_list(index, s);
  }
  void put_on_ready_list(subscription_id index, subscription& s) noexcept;
  void begin_throttle(subscription& s) noexcept;

  const rows<subscription_id, subscription> subscription_rows_;
};

} // namespace rowe::service
