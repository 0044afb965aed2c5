// SPDX-License-Identifier: Apache-2.0
// Who subscribes to what: each subscription is on the list of its topic and on the list of its peer. Service
// thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/index_list.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/state/topic_rows.hpp"
#include "service/state/topic_table.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

class subscription_table {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  subscription_table(rt::arena& memory, const limits& bounds, topic_table& topics) noexcept;

  subscription& at(subscription_id index) noexcept { return rows_[index]; }
  const subscription& at(subscription_id index) const noexcept { return rows_[index]; }
  rows<subscription_id, subscription> all() const noexcept { return rows_; }
  // A peer may have two subscriptions to a topic: one for each spelling. Finds the first of either spelling,
  // or the one of this spelling; none: there is none.
  subscription_id find(topic_id topic, peer_index of) const noexcept;
  subscription_id find(topic_id topic, peer_index of, bool unslashed) const noexcept;
  subscription_id first_of(peer_index peer) const noexcept { return of_peers_[peer].list.head; }
  std::uint32_t count_of(peer_index peer) const noexcept { return of_peers_[peer].count; }
  std::uint32_t count() const noexcept { return free_.in_use(); }

  // Holds the topic, too. None: subscriptions_max are taken.
  subscription_id add(topic_id topic, peer_index of) noexcept;
  // The caller lets the topic go.
  void remove(subscription_id index) noexcept;
  // Sets how the messages of a subscription are written.
  void set_form(subscription& of, const wire::codec& codec, std::uint32_t tag, bool unslashed) noexcept {
    if (of.whole) count_form(of, -1);
    of.codec = codec.id();
    of.tag = tag;
    of.unslashed = unslashed;
    of.own_head = unslashed || codec.id() != topics_.envelope().id();
    of.whole = codec.writes_whole();
    of.of_types = codec.writes_types();
    if (of.whole) count_form(of, 1);
  }
  // Merges the requests of a subscription: the smallest throttle and the smallest queue count.
  void merge(subscription& of, std::uint32_t depth_max) noexcept;

  bool check() const noexcept;

 private:
  struct of_peer {
    index_queue<subscription_id, subscription, &subscription::next_on_peer> list;
    std::uint32_t count = 0;
  };

  void count_form(const subscription& of, int change) noexcept {
    topics_.at(of.topic).whole += static_cast<std::uint32_t>(change);
    if (of.of_types) topics_.at(of.topic).of_types += static_cast<std::uint32_t>(change);
  }

  topic_table& topics_;
  rows<subscription_id, subscription> rows_;
  rows<peer_index, of_peer> of_peers_;
  indexed_pool<subscription_id, subscription, &subscription::next_on_peer> free_;
};

} // namespace rowe::service
