// SPDX-License-Identifier: Apache-2.0
// Sends a value to everyone who wants it. The value is encoded once, not for each peer. Values of this
// process and values that peers publish go the same way: into the queues of peers, and into the inboxes of
// handles. Service thread only; nothing waits or allocates.
#pragma once
#include <span>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>

#include "service/advertisement_table.hpp"
#include "service/core_state.hpp"
#include "service/local_delivery.hpp"
#include "service/outbox.hpp"
#include "service/refusals.hpp"
#include "service/subscription_queues.hpp"
#include "service/topic_rates.hpp"
#include "wire/request.hpp"
#include "json/writer.hpp"

namespace rowe::service {

// The peer that published a relayed value, and the id of its request; none: this process published it.
struct published_by {
  detail::peer_ref peer{};
  std::string_view id_raw{};
};

class broker {
 public:
  struct needs {
    core_state& state;
    class message_store& message_store;
    class outbox& outbox;
    class subscription_queues& subscription_queues;
    class refusals& refusals;
    class local_delivery& local_delivery;
    const class advertisement_table& advertisement_table;
  };
  explicit broker(const needs& parts) noexcept
      : state_{parts.state},
        message_store_{parts.message_store},
        outbox_{parts.outbox},
        subscription_queues_{parts.subscription_queues},
        refusals_{parts.refusals},
        local_delivery_{parts.local_delivery},
        advertisement_table_{parts.advertisement_table} {}

  // Sends a value to everyone who wants it now. It was published at `published` and expires at `expires`. If
  // `latches` names an owner, the value is kept for late subscribers. `write_body(json::writer&)` writes the
  // value directly into the slot: by the encoder of a struct, or by copying text that is JSON already.
  template <class WriteBody>
  void publish(topic_id topic, rt::time_point published, rt::time_point expires, latch_owner latches,
               WriteBody&& write_body, const published_by& who = {}) noexcept;
  // A peer published: passes it to subscribed handles of this process and, in a hub, to subscribed peers.
  void relay(connection& c, const wire::request& asked) noexcept;
  // Delivers a value to the handles of this process that subscribed.
  void deliver(const topic& on, std::span<const char> body, const published_by& who = {}) noexcept {
    for (pair_index i = on.inboxes.head; i; i = state_.pair_rows[i].next_inbox) deliver_to(i, body, who);
  }
  // Delivers the latched value to a handle that was just attached.
  void deliver_latched(pair_index pair) noexcept;

 private:
  bool is_wanted_now(const topic& on) noexcept;
  void keep_latched(topic& on, slot_id slot, latch_owner owner) noexcept;
  void deliver_to(pair_index pair, std::span<const char> body, const published_by& who) noexcept;
  void tell_undecodable(pair_index pair, const published_by& who, std::string_view why) noexcept;

  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  subscription_queues& subscription_queues_;
  refusals& refusals_;
  local_delivery& local_delivery_;
  const advertisement_table& advertisement_table_;
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
  const slot_id slot = outbox_.compose_message(index, published, expires, write_body);
  if (!slot) return;
  on.bytes = message_store_.slots().body(slot).size();
  if (keeps) keep_latched(on, slot, latches);
  subscription_queues_.fan_out(index, slot);
  deliver(on, message_store_.slots().body(slot), who);
  message_store_.release(slot);
}

} // namespace rowe::service
