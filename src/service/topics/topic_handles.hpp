// SPDX-License-Identifier: Apache-2.0
// Handles of this process that publish or subscribe: attaches them to their topic, detaches them and, in a
// client, announces them to the server. Service thread only; nothing waits or allocates. A user thread that
// sleeps is woken, which enters the kernel.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>

#include "service/control/command_gate.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/advertisements.hpp"
#include "service/topics/audiences.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/publish_predictor.hpp"
#include "service/topics/recorder_handles.hpp"
#include "service/topics/subscriptions.hpp"
#include "service/topics/topic_places.hpp"
#include "service/topics/topic_rates.hpp"

namespace rowe::service {

struct topic_handles_needs {
  core_state& state_;
  const message_store& message_store_;
  outbox& outbox_;
  publish_predictor& publish_predictor_;
  audiences& audiences_;
  topic_rates& topic_rates_;
  topic_places& topic_places_;
  subscriptions& subscriptions_;
  advertisements& advertisements_;
  command_gate& command_gate_;
  broker& broker_;
};

class topic_handles : topic_handles_needs {
 public:
  explicit topic_handles(const topic_handles_needs& parts) noexcept : topic_handles_needs{parts} {}

  // Errors: too_many_topics; too_many_leases; type_conflict, and then an event names the types.
  status attach(pair_index pair) noexcept;
  void detach(pair_index pair) noexcept;
  // In a client: announces to the server a handle that was attached or is being detached.
  void announce(connection& c, pair_index pair, bool begins) noexcept;
  // The queue to the server for the values of this handle; null: there is none.
  queue* queue_to_server(pair_index pair) noexcept;
  // How many values the queue to the server takes now; a server has none, and no limit.
  std::size_t room_to_server(pair_index pair) noexcept {
    const queue* const towards = state_.options.ours == side::client ? queue_to_server(pair) : nullptr;
    if (towards == nullptr) return SIZE_MAX;
    const std::uint32_t depth = state_.bounds().queue_depth_max;
    return depth - std::min(towards->count, depth);
  }
  // Those that record belong to no topic.
  recorder_handles& recorders() noexcept { return recorders_; }
  // How many values of its topic may be taken from a handle besides the usual `taken`.
  std::size_t ample_budget(pair_index pair, std::size_t taken) const noexcept;

 private:
  topic_id hold_topic(std::string_view name) noexcept;
  void note_holders(pair_index pair) noexcept;
  void announce_to_servers(pair_index pair, bool begins) noexcept;
  bool has_other(topic_id topic, bool that_reads) const noexcept;
  // Other handles that do the same with a topic: both subscribe, or both publish.
  struct others {
    bool any = false;
    bool any_before = false; // of a lower number
    rt::duration throttle = rt::for_ever;
  };
  others others_of(pair_index pair) const noexcept;
  void report_conflict(topic_id topic, const detail::queue_pair& asked) noexcept;
  const schema_description* schema_of(topic_id topic) const noexcept;
  void begin_publishing(pair_index pair) noexcept;

  recorder_handles recorders_{{state_, audiences_, topic_rates_, broker_}};
};

} // namespace rowe::service
