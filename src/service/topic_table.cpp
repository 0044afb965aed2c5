// SPDX-License-Identifier: Apache-2.0
#include "service/topic_table.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <utility>

namespace rowe::service {
namespace {

std::size_t bucket_count(const limits& bounds) noexcept {
  return std::bit_ceil(std::size_t{bounds.topics_max} * 2);
}
// With the slash that may be added here.
std::size_t name_bytes_max_of(const limits& bounds) noexcept {
  return std::size_t{bounds.topic_bytes_max} + 1;
}
std::size_t head_bytes_max_of(const limits& bounds) noexcept {
  return wire::topic_head_bytes_max(name_bytes_max_of(bounds));
}
std::size_t name_stride_of(const limits& bounds) noexcept {
  return 2 * name_bytes_max_of(bounds) + head_bytes_max_of(bounds);
}

} // namespace

std::size_t topic_table::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<topic>(bounds.topics_max) + arena::bytes_for<topic_id>(bucket_count(bounds)) +
         arena::bytes_for(bounds.topics_max * name_stride_of(bounds)) +
         arena::bytes_for<subscription>(bounds.subscriptions_max) +
         arena::bytes_for<of_peer>(bounds.connections_max);
}

topic_table::topic_table(rt::arena& memory, const limits& bounds, const wire::codec& envelope) noexcept
    : envelope_{envelope},
      topics_{memory.carve<topic>(bounds.topics_max)},
      buckets_{memory.carve<topic_id>(bucket_count(bounds))},
      names_{memory.carve<char>(bounds.topics_max * name_stride_of(bounds))},
      subscriptions_{memory.carve<subscription>(bounds.subscriptions_max)},
      of_peers_{memory.carve<of_peer>(bounds.connections_max)},
      name_bytes_max_{name_bytes_max_of(bounds)},
      head_bytes_max_{head_bytes_max_of(bounds)},
      name_stride_{name_stride_of(bounds)} {
  for (std::uint32_t i = topic_places(); i-- > 0;) {
    topics_[{i}].next = free_topic_;
    free_topic_ = {i};
  }
  for (std::uint32_t i = subscription_places(); i-- > 0;) {
    subscriptions_[{i}].next_on_peer = free_subscription_;
    free_subscription_ = {i};
  }
}

std::string_view topic_table::name(topic_id index) const noexcept {
  return {names(index), topics_[index].name_bytes};
}

std::string_view topic_table::type(topic_id index) const noexcept {
  return {names(index) + name_bytes_max_, topics_[index].type_bytes};
}

std::string_view topic_table::head(topic_id index) const noexcept {
  return {names(index) + 2 * name_bytes_max_, topics_[index].head_bytes};
}

topic_id topic_table::find(std::string_view wanted) const noexcept {
  wanted = without_slash(wanted);
  const std::uint64_t hash = hash_of(wanted);
  for (topic_id i = bucket(hash); i; i = topics_[i].next) {
    if (topics_[i].hash == hash && without_slash(name(i)) == wanted) return i;
  }
  return {};
}

topic_id topic_table::find_or_add(std::string_view wanted) noexcept {
  const topic_id found = find(wanted);
  const std::size_t slash = has_slash(wanted) ? 0 : 1;
  const std::size_t bytes = slash + wanted.size();
  if (found || !free_topic_ || bytes > name_bytes_max_) return found;
  const topic_id added = free_topic_;
  topic& fresh = topics_[added];
  free_topic_ = fresh.next;
  fresh = topic{};
  fresh.hash = hash_of(without_slash(wanted));
  fresh.channel = ++channels_;
  ++changes_;
  fresh.name_bytes = static_cast<std::uint16_t>(bytes);
  *names(added) = '/';
  std::memcpy(names(added) + slash, wanted.data(), wanted.size());
  json::writer head{{names(added) + 2 * name_bytes_max_, head_bytes_max_}};
  envelope_.write_topic_head(head, name(added));
  fresh.head_bytes = static_cast<std::uint16_t>(head.bytes());
  fresh.next = bucket(fresh.hash);
  bucket(fresh.hash) = added;
  ++topic_count_;
  return added;
}

topic_id topic_table::find_channel(std::uint32_t channel) const noexcept {
  const auto found = std::find_if(topics_.begin(), topics_.end(), [channel](const topic& one) {
    return one.holders != 0 && one.channel == channel;
  });
  if (found == topics_.end()) return {};
  return {static_cast<std::uint32_t>(found - topics_.begin())};
}

bool topic_table::set_type(topic_id index, std::string_view wanted) noexcept {
  if (wanted.empty() || same_type(wanted, type(index))) return true;
  if (topics_[index].type_bytes != 0 || wanted.size() > name_bytes_max_) return false;
  replace_type(index, wanted);
  return true;
}

void topic_table::replace_type(topic_id index, std::string_view wanted) noexcept {
  assert(wanted.size() <= name_bytes_max_);
  std::memcpy(names(index) + name_bytes_max_, wanted.data(), wanted.size());
  topics_[index].type_bytes = static_cast<std::uint16_t>(wanted.size());
  topics_[index].channel = ++channels_; // a peer that knows it by number also knows its type
  ++changes_;
}

void topic_table::hold_as_own(topic_id index) noexcept {
  hold(index);
  if (topics_[index].own_holders++ == 0) ++own_topics_;
}

bool topic_table::let_go_as_own(topic_id index) noexcept {
  assert(topics_[index].own_holders > 0);
  if (--topics_[index].own_holders == 0) --own_topics_;
  return let_go(index);
}

bool topic_table::let_go(topic_id index) noexcept {
  topic& held = topics_[index];
  assert(held.holders > 0);
  if (--held.holders != 0) return false;
  assert(!held.has_audience());
  topic_id* link = &bucket(held.hash);
  while (*link != index) link = &topics_[*link].next;
  *link = held.next;
  held = topic{};
  held.next = free_topic_;
  free_topic_ = index;
  --topic_count_;
  ++changes_;
  return true;
}

subscription_id topic_table::find_subscription(topic_id wanted, peer_index of) const noexcept {
  for (subscription_id i = of_peers_[of].first; i; i = subscriptions_[i].next_on_peer) {
    if (subscriptions_[i].topic == wanted) return i;
  }
  return {};
}

subscription_id topic_table::find_subscription(topic_id wanted, peer_index of,
                                               bool unslashed) const noexcept {
  for (subscription_id i = of_peers_[of].first; i; i = subscriptions_[i].next_on_peer) {
    if (subscriptions_[i].topic == wanted && subscriptions_[i].unslashed == unslashed) return i;
  }
  return {};
}

subscription_id topic_table::add_subscription(topic_id to, peer_index peer) noexcept {
  if (!free_subscription_) return {};
  const subscription_id added = free_subscription_;
  subscription& fresh = subscriptions_[added];
  free_subscription_ = fresh.next_on_peer;
  fresh = subscription{};
  fresh.topic = to;
  fresh.peer = peer;
  fresh.codec = envelope_.id();
  fresh.pending.owner = queue_entries::owner_of(peer, queued_as::evictable);
  fresh.next_on_peer = std::exchange(of_peers_[peer].first, added);
  ++of_peers_[peer].count;
  topic& of = topics_[to];
  fresh.next_on_topic = of.first_subscription;
  if (of.first_subscription) subscriptions_[of.first_subscription].previous_on_topic = added;
  of.first_subscription = added;
  ++of.subscriptions;
  ++subscription_count_;
  hold(to);
  return added;
}

void topic_table::remove_subscription(subscription_id index) noexcept {
  subscription& gone = subscriptions_[index];
  assert(gone.pending.empty() && !gone.ready && !gone.timed);
  subscription_id* link = &of_peers_[gone.peer].first;
  while (*link != index) link = &subscriptions_[*link].next_on_peer;
  *link = gone.next_on_peer;
  topic& of = topics_[gone.topic];
  (!gone.previous_on_topic ? of.first_subscription : subscriptions_[gone.previous_on_topic].next_on_topic) =
      gone.next_on_topic;
  if (gone.next_on_topic) subscriptions_[gone.next_on_topic].previous_on_topic = gone.previous_on_topic;
  --of.subscriptions;
  --of_peers_[gone.peer].count;
  --subscription_count_;
  gone = subscription{};
  gone.next_on_peer = free_subscription_;
  free_subscription_ = index;
}

void topic_table::merge(subscription& of, std::uint32_t depth_max) noexcept {
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
  of.merges = topics_[of.topic].keep == keep::newest && !stated;
  if (of.discards || of.merges) of.depth = 1;
}

bool topic_table::check() const noexcept {
  std::uint32_t held = 0;
  std::uint32_t own = 0;
  std::uint32_t subscriptions = 0;
  for (std::uint32_t b = 0; b < buckets_.size(); ++b) {
    for (topic_id i = buckets_[b]; i; i = topics_[i].next) {
      if (++held > topics_.size() || topics_[i].holders == 0) return false;
      if (topics_[i].own_holders > topics_[i].holders) return false;
      own += topics_[i].own_holders != 0;
      subscriptions += topics_[i].subscriptions;
      std::uint32_t on_topic = 0;
      for (subscription_id s = topics_[i].first_subscription; s; s = subscriptions_[s].next_on_topic) {
        if (subscriptions_[s].topic != i || ++on_topic > topics_[i].subscriptions) return false;
      }
      if (on_topic != topics_[i].subscriptions) return false;
    }
  }
  return held == topic_count_ && own == own_topics_ && subscriptions == subscription_count_;
}

} // namespace rowe::service
