// SPDX-License-Identifier: Apache-2.0
// Folder topics: who publishes, who subscribes, and what happens to a value. No calls.
// Sends a value to everyone who wants it. The value is encoded once, not for each peer. Values of this
// process and values that peers publish go the same way: into the queues of peers, and into the inboxes of
// handles. Service thread only; nothing waits or allocates.
#pragma once
#include <span>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>

#include "service/control/command_gate.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/long_deliveries.hpp"
#include "service/outgoing/long_outbox.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/subscription_queues.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/missed_values.hpp"
#include "service/topics/published_by.hpp"
#include "service/topics/recorded_values.hpp"
#include "service/topics/topic_rates.hpp"
#include "wire/codec/request.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct broker_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  long_outbox& long_outbox_;
  subscription_queues& subscription_queues_;
  refusals& refusals_;
  local_delivery& local_delivery_;
  long_deliveries& long_deliveries_;
  command_gate& command_gate_;
  const advertisement_table& advertisement_table_;
};

class broker : broker_needs {
 public:
  explicit broker(const broker_needs& parts) noexcept : broker_needs{parts} {}

  // Sends a value to everyone who wants it now. It was published at `published` and expires at `expires`. If
  // `latches` names an owner, the value is retained for late subscribers. `write_body(json::writer&)` writes
  // the value directly into the slot: by the encoder of a struct, or by copying text that is JSON already.
  template <class WriteBody>
  void publish(topic_id topic, rt::time_point published, rt::time_point expires, latch_owner latches,
               WriteBody&& write_body, const published_by& who = {}) noexcept;
  // The same for a value that is a long text.
  void publish_long(topic_id topic, rt::time_point published, rt::time_point expires, latch_owner latches,
                    text_id value, const published_by& who = {}) noexcept;
  // A peer published: passes it to subscribed handles of this process and, in a hub, to subscribed peers.
  // `body`: the body, if it is a long text.
  void relay(connection& c, const wire::request& asked, text_id body = {}) noexcept;
  // Delivers a value to the handles of this process that subscribed, on a topic that is not driven. They take
  // none whose time is `over`.
  void deliver(const topic& on, std::span<const char> body, rt::time_point over,
               const published_by& who) noexcept {
    for (pair_index i = on.inboxes.head; i; i = state_.pair_rows[i].next_inbox)
      deliver_share(i, body, over, who);
  }
  // Delivers the latched values to a handle that was just attached, the oldest first. Behind a long one they
  // go on when the handle has that.
  void deliver_latched(pair_index pair) noexcept;
  // Copies this cycle's share of the long values that are under way to handles.
  void deliver_long_values() noexcept;
  recorded_values& recorded() noexcept { return recorded_; }

 private:
  bool is_wanted_now(const topic& on) noexcept;
  // The same for a topic with subscribers whose codecs write whole messages.
  void publish_whole(topic_id topic, const whole_source& of, latch_owner latches, const wire::body& text,
                     const published_by& who) noexcept;
  // For who asks over HTTP, and for who records.
  void keep_aside(topic_id index, std::span<const char> body, rt::time_point published,
                  rt::time_point expires) noexcept;
  void deliver_relayed(topic_id index, const wire::request& asked, text_id body, rt::time_point over,
                       const published_by& who) noexcept;
  bool keep_latched(topic_id index, slot_id slot, latch_owner owner, const published_by& who) noexcept;
  // As many as the peer may have waiting in the handle's queue.
  void deliver_share(pair_index pair, std::span<const char> body, rt::time_point over,
                     const published_by& who) noexcept {
    local_delivery_.may_deliver(pair, who.peer) ? (void)deliver_to(pair, body, over, who)
                                                : state_.counts.add(counter::inbox_full);
  }
  // False: the handle did not get it, and that was counted.
  bool deliver_to(pair_index pair, std::span<const char> body, rt::time_point over, const published_by& who,
                  std::int64_t turn = 0) noexcept;
  void deliver_command(const topic& on, std::span<const char> body, rt::time_point published,
                       rt::time_point over, const published_by& who) noexcept;
  void deliver_long(const topic& on, text_id value, rt::time_point over, const published_by& who) noexcept;
  void go_on_with_latched(pair_index pair) noexcept;
  bool deliver_long_to(pair_index pair, text_id value, rt::time_point over, const published_by& who) noexcept;

  missed_values missed_{state_, refusals_};
  recorded_values recorded_{state_, message_store_, long_outbox_};
};

// ---- inline definitions

template <class WriteBody>
void broker::publish(topic_id index, rt::time_point published, rt::time_point expires, latch_owner latches,
                     WriteBody&& write_body, const published_by& who) noexcept {
  topic& on = state_.topics.at(index);
  topic_rates::note(on, published);
  if (expires < state_.cycle.now) return state_.counts.add(counter::expired);
  const bool keeps = latches.who != latch_owner::kind::nobody;
  if (!keeps && !is_wanted_now(on)) return;
  if (on.whole != 0) [[unlikely]]
    return publish_whole(index, {published, expires, who.value}, latches, wire::body{write_body}, who);
  const slot_id slot = outbox_.compose_message(index, published, expires, write_body);
  if (!slot) return;
  const std::span<const char> body = message_store_.slots().body(slot);
  on.bytes = body.size();
  const bool kept = keeps && keep_latched(index, slot, latches, who);
  subscription_queues_.fan_out(index, slot, kept);
  if (on.driven) [[unlikely]]
    deliver_command(on, body, published, expires, who);
  else
    deliver(on, body, expires, who);
  if (on.aside != 0) [[unlikely]]
    keep_aside(index, body, published, expires);
  message_store_.release(slot);
}

} // namespace rowe::service
