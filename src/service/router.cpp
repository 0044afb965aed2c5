// SPDX-License-Identifier: Apache-2.0
#include "service/router.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

namespace rowe::service {
namespace {

std::size_t bucket_count(const limits& bounds) noexcept {
  return std::bit_ceil(std::size_t{bounds.topics_max} * 2);
}
// Of a name that got its slash here.
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

std::size_t router::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<topic>(bounds.topics_max) + arena::bytes_for<std::uint32_t>(bucket_count(bounds)) +
         arena::bytes_for(bounds.topics_max * name_stride_of(bounds)) +
         arena::bytes_for<subscription>(bounds.subscriptions_max);
}

router::router(rt::arena& memory, const limits& bounds, const wire::codec& envelope) noexcept
    : envelope_{envelope},
      topics_{memory.carve<topic>(bounds.topics_max)},
      buckets_{memory.carve<std::uint32_t>(bucket_count(bounds))},
      names_{memory.carve<char>(bounds.topics_max * name_stride_of(bounds))},
      subscriptions_{memory.carve<subscription>(bounds.subscriptions_max)},
      name_bytes_max_{name_bytes_max_of(bounds)},
      head_bytes_max_{head_bytes_max_of(bounds)},
      name_stride_{name_stride_of(bounds)} {
  std::fill(buckets_.begin(), buckets_.end(), no_index);
  for (std::uint32_t i = topic_places(); i-- > 0;) {
    topics_[i].next = free_topic_;
    free_topic_ = i;
  }
  for (std::uint32_t i = subscription_places(); i-- > 0;) {
    subscriptions_[i].next_on_connection = free_subscription_;
    free_subscription_ = i;
  }
}

std::string_view router::name(std::uint32_t index) const noexcept {
  return {names(index), topics_[index].name_bytes};
}

std::string_view router::type(std::uint32_t index) const noexcept {
  return {names(index) + name_bytes_max_, topics_[index].type_bytes};
}

std::string_view router::head(std::uint32_t index) const noexcept {
  return {names(index) + 2 * name_bytes_max_, topics_[index].head_bytes};
}

std::uint32_t router::find(std::string_view wanted) const noexcept {
  wanted = without_slash(wanted);
  const std::uint64_t hash = hash_of(wanted);
  for (std::uint32_t i = bucket(hash); i != no_index; i = topics_[i].next) {
    if (topics_[i].hash == hash && without_slash(name(i)) == wanted) return i;
  }
  return no_index;
}

std::uint32_t router::find_or_add(std::string_view wanted) noexcept {
  const std::uint32_t found = find(wanted);
  const std::size_t slash = has_slash(wanted) ? 0 : 1;
  const std::size_t bytes = slash + wanted.size();
  if (found != no_index || free_topic_ == no_index || bytes > name_bytes_max_) return found;
  const std::uint32_t added = free_topic_;
  topic& fresh = topics_[added];
  free_topic_ = fresh.next;
  fresh = topic{};
  fresh.hash = hash_of(without_slash(wanted));
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

bool router::set_type(std::uint32_t index, std::string_view wanted) noexcept {
  if (wanted.empty() || same_type(wanted, type(index))) return true;
  if (topics_[index].type_bytes != 0 || wanted.size() > name_bytes_max_) return false;
  std::memcpy(names(index) + name_bytes_max_, wanted.data(), wanted.size());
  topics_[index].type_bytes = static_cast<std::uint16_t>(wanted.size());
  return true;
}

void router::replace_type(std::uint32_t index, std::string_view wanted) noexcept {
  assert(wanted.size() <= name_bytes_max_);
  std::memcpy(names(index) + name_bytes_max_, wanted.data(), wanted.size());
  topics_[index].type_bytes = static_cast<std::uint16_t>(wanted.size());
}

void router::hold_as_own(std::uint32_t index) noexcept {
  hold(index);
  if (topics_[index].own_holders++ == 0) ++own_topics_;
}

bool router::let_go_as_own(std::uint32_t index) noexcept {
  assert(topics_[index].own_holders > 0);
  if (--topics_[index].own_holders == 0) --own_topics_;
  return let_go(index);
}

bool router::let_go(std::uint32_t index) noexcept {
  topic& held = topics_[index];
  assert(held.holders > 0);
  if (--held.holders != 0) return false;
  assert(held.first_subscription == no_index && held.first_inbox == no_index);
  std::uint32_t* link = &bucket(held.hash);
  while (*link != index) link = &topics_[*link].next;
  *link = held.next;
  held = topic{};
  held.next = free_topic_;
  free_topic_ = index;
  --topic_count_;
  return true;
}

std::uint32_t router::find_subscription(std::uint32_t wanted,
                                        std::uint32_t first_on_connection) const noexcept {
  for (std::uint32_t i = first_on_connection; i != no_index; i = subscriptions_[i].next_on_connection) {
    if (subscriptions_[i].topic == wanted) return i;
  }
  return no_index;
}

std::uint32_t router::find_subscription(std::uint32_t wanted, std::uint32_t first_on_connection,
                                        bool unslashed) const noexcept {
  for (std::uint32_t i = first_on_connection; i != no_index; i = subscriptions_[i].next_on_connection) {
    if (subscriptions_[i].topic == wanted && subscriptions_[i].unslashed == unslashed) return i;
  }
  return no_index;
}

std::uint32_t router::add_subscription(std::uint32_t to, std::uint32_t connection,
                                       std::uint32_t& first_on_connection) noexcept {
  if (free_subscription_ == no_index) return no_index;
  const std::uint32_t added = free_subscription_;
  subscription& fresh = subscriptions_[added];
  free_subscription_ = fresh.next_on_connection;
  fresh = subscription{};
  fresh.topic = to;
  fresh.connection = connection;
  fresh.waiting.owner = queue_entries::owner_of(connection, queued_as::evictable);
  fresh.next_on_connection = first_on_connection;
  first_on_connection = added;
  topic& of = topics_[to];
  fresh.next_on_topic = of.first_subscription;
  if (of.first_subscription != no_index) subscriptions_[of.first_subscription].previous_on_topic = added;
  of.first_subscription = added;
  ++of.subscriptions;
  ++subscription_count_;
  hold(to);
  return added;
}

void router::remove_subscription(std::uint32_t index, std::uint32_t& first_on_connection) noexcept {
  subscription& gone = subscriptions_[index];
  assert(gone.waiting.empty() && !gone.ready && !gone.timed);
  std::uint32_t* link = &first_on_connection;
  while (*link != index) link = &subscriptions_[*link].next_on_connection;
  *link = gone.next_on_connection;
  topic& of = topics_[gone.topic];
  (gone.previous_on_topic == no_index ? of.first_subscription
                                      : subscriptions_[gone.previous_on_topic].next_on_topic) =
      gone.next_on_topic;
  if (gone.next_on_topic != no_index)
    subscriptions_[gone.next_on_topic].previous_on_topic = gone.previous_on_topic;
  --of.subscriptions;
  --subscription_count_;
  gone = subscription{};
  gone.next_on_connection = free_subscription_;
  free_subscription_ = index;
}

void router::merge(subscription& of, std::uint32_t depth_max) noexcept {
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
  // Without a queue, what comes within the throttle period is discarded.
  of.discards = of.throttle > rt::duration{0} && !stated;
  of.merges = topics_[of.topic].keep == keep::newest && !stated;
  if (of.discards || of.merges) of.depth = 1;
}

bool router::check() const noexcept {
  std::uint32_t held = 0;
  std::uint32_t own = 0;
  std::uint32_t subscriptions = 0;
  for (std::uint32_t b = 0; b < buckets_.size(); ++b) {
    for (std::uint32_t i = buckets_[b]; i != no_index; i = topics_[i].next) {
      if (++held > topics_.size() || topics_[i].holders == 0) return false;
      if (topics_[i].own_holders > topics_[i].holders) return false;
      own += topics_[i].own_holders != 0;
      subscriptions += topics_[i].subscriptions;
      std::uint32_t on_topic = 0;
      for (std::uint32_t s = topics_[i].first_subscription; s != no_index;
           s = subscriptions_[s].next_on_topic) {
        if (subscriptions_[s].topic != i || ++on_topic > topics_[i].subscriptions) return false;
      }
      if (on_topic != topics_[i].subscriptions) return false;
    }
  }
  return held == topic_count_ && own == own_topics_ && subscriptions == subscription_count_;
}

} // namespace rowe::service
