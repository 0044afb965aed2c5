// SPDX-License-Identifier: Apache-2.0
#include "service/state/subscription_table.hpp"

#include <algorithm>
#include <cassert>

namespace rowe::service {

std::size_t subscription_table::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<subscription>(bounds.subscriptions_max) +
         arena::bytes_for<of_peer>(bounds.connections_max);
}

subscription_table::subscription_table(rt::arena& memory, const limits& bounds, topic_table& topics) noexcept
    : topics_{topics},
      rows_{memory.carve<subscription>(bounds.subscriptions_max)},
      of_peers_{memory.carve<of_peer>(bounds.connections_max)},
      free_{rows_} {}

subscription_id subscription_table::find(topic_id topic, peer_index of) const noexcept {
  for (subscription_id i = first_of(of); i; i = rows_[i].next_on_peer) {
    if (rows_[i].topic == topic) return i;
  }
  return {};
}

subscription_id subscription_table::find(topic_id topic, peer_index of, bool unslashed) const noexcept {
  for (subscription_id i = first_of(of); i; i = rows_[i].next_on_peer) {
    if (rows_[i].topic == topic && rows_[i].unslashed == unslashed) return i;
  }
  return {};
}

subscription_id subscription_table::add(topic_id topic, peer_index of) noexcept {
  const subscription_id added = free_.take();
  if (!added) return added;
  subscription& fresh = rows_[added];
  fresh = subscription{};
  fresh.topic = topic;
  fresh.peer = of;
  fresh.codec = topics_.envelope().id();
  fresh.pending.owner = queue_entries::owner_of(of, queued_as::evictable);
  of_peers_[of].list.push_front(rows_, added);
  ++of_peers_[of].count;
  topics_.at(topic).subscriptions.push_front(rows_, added);
  topics_.hold(topic);
  topics_.changes().note_subscribers(topics_.at(topic));
  return added;
}

void subscription_table::remove(subscription_id index) noexcept {
  subscription& gone = rows_[index];
  assert(gone.pending.empty() && !gone.ready && !gone.timed);
  of_peers_[gone.peer].list.erase(rows_, index);
  --of_peers_[gone.peer].count;
  if (gone.whole) count_form(gone, -1);
  topics_.at(gone.topic).subscriptions.erase(rows_, index);
  topics_.changes().note_subscribers(topics_.at(gone.topic));
  gone = subscription{};
  free_.give_back(index);
}

void subscription_table::merge(subscription& of, std::uint32_t depth_max) noexcept {
  of.throttle = rt::duration{0};
  of.depth = depth_max;
  bool stated = false;
  for (std::uint8_t i = 0; i < of.request_count; ++i) {
    const subscribe_request& request = of.requests[i];
    of.throttle = i == 0 ? request.throttle : std::min(of.throttle, request.throttle);
    if (request.queue_length != 0) {
      of.depth = std::min(of.depth, request.queue_length);
      stated = true;
    }
  }
  // Without a queue, a value within the throttle period is discarded.
  of.discards = of.throttle > rt::duration{0} && !stated;
  of.merges = topics_.at(of.topic).keep == keep::newest && !stated;
  if (of.discards || of.merges) of.depth = 1;
}

bool subscription_table::check() const noexcept {
  std::uint32_t on_topics = 0;
  for (const topic_id i : topics_.topic_ids()) {
    const topic& one = topics_.at(i);
    if (!one.subscriptions.check(rows_, [i](const subscription& s) { return s.topic == i; })) return false;
    on_topics += one.subscriptions.count;
    std::uint32_t whole = 0;
    std::uint32_t of_types = 0;
    for (subscription_id s = one.subscriptions.head; s; s = rows_[s].next_on_topic) {
      whole += rows_[s].whole;
      of_types += rows_[s].of_types;
    }
    if (whole != one.whole || of_types != one.of_types) return false;
  }
  std::uint32_t of_peers = 0;
  for (const peer_index i : of_peers_.ids()) {
    std::uint32_t left = of_peers_[i].count;
    for (subscription_id s = first_of(i); s; s = rows_[s].next_on_peer) {
      if (left-- == 0 || rows_[s].peer != i) return false;
    }
    if (left != 0) return false;
    of_peers += of_peers_[i].count;
  }
  return on_topics == count() && of_peers == count() &&
         free_.check([](const subscription& one) { return one.pending.empty() && !one.ready && !one.timed; });
}

} // namespace rowe::service
