// SPDX-License-Identifier: Apache-2.0
// The subscriptions of peers. In a client, the server counts as subscribed to what handles publish. A peer
// has at most its share of them (shares.hpp). Service thread only; nothing waits or allocates.
#pragma once
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/shares.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/subscription_queues.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/audiences.hpp"
#include "service/topics/stored_ids.hpp"
#include "service/topics/topic_places.hpp"
#include "service/topics/topic_rates.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct subscriptions_needs {
  core_state& state_;
  subscription_queues& subscription_queues_;
  refusals& refusals_;
  audiences& audiences_;
  topic_rates& topic_rates_;
  topic_places& topic_places_;
};

class subscriptions : subscriptions_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return stored_ids::footprint_bytes(bounds);
  }
  subscriptions(rt::arena& memory, const subscriptions_needs& parts) noexcept;

  // A peer leaves.
  void forget(peer_index peer) noexcept;

  // Requests of peers. A refusal says why.
  void subscribe(connection& c, const wire::request& asked) noexcept;
  // The timer of a subscription's deadline is due.
  void check_deadline(subscription_id subscription) noexcept;
  void unsubscribe(connection& c, const wire::request& asked) noexcept;

  // In a client: a handle begins to publish, or ends. A server gets the latched value when it begins.
  void subscribe_server(connection& c, topic_id topic, bool unslashed) noexcept;
  void unsubscribe_server(connection& c, topic_id topic) noexcept;
  // A handle of this process has set the topic's `keep`.
  void merge_requests(topic_id topic) noexcept;
  // Ends all subscriptions of the peer to the topic. Returns whether there was one.
  bool end(peer_index peer, topic_id topic) noexcept;
  // The topic now has a type: subscribers that expect another one get a report.
  void report_other_types(topic_id topic) noexcept;

  // Peers are charged for the subscriptions that they have.
  bool check() const noexcept;

 private:
  subscription_id add(connection& c, const wire::request& asked, topic_id topic) noexcept;
  wire::codec_id codec_for(topic_id topic, const wire::request& asked) const noexcept;
  void watch_deadline(subscription_id subscription, const wire::request& asked) noexcept;
  void warn_without_type(connection& c, std::string_view id_raw, const subscription& s) noexcept;
  void remove(peer_index peer, subscription_id index) noexcept;
  void report_other_type(connection& c, std::string_view id_raw, topic_id topic,
                         std::string_view asked) noexcept;

  claims claims_;
  stored_ids ids_; // of requests for deadlines
};

} // namespace rowe::service
