// SPDX-License-Identifier: Apache-2.0
#include "service/state/topic_table.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

namespace rowe::service {
namespace {

std::size_t topic_buckets(const limits& bounds) noexcept {
  return std::bit_ceil(std::size_t{bounds.topics_max} * 2);
}
// The longest name, with the slash that may be added here.
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
  return arena::bytes_for<topic>(bounds.topics_max) + arena::bytes_for<topic_id>(topic_buckets(bounds)) +
         arena::bytes_for(bounds.topics_max * name_stride_of(bounds));
}

topic_table::topic_table(rt::arena& memory, const limits& bounds, const wire::codec& envelope) noexcept
    : envelope_{envelope},
      topics_{memory.carve<topic>(bounds.topics_max)},
      buckets_{memory.carve<topic_id>(topic_buckets(bounds))},
      names_{memory.carve<char>(bounds.topics_max * name_stride_of(bounds))},
      name_bytes_max_{name_bytes_max_of(bounds)},
      head_bytes_max_{head_bytes_max_of(bounds)},
      name_stride_{name_stride_of(bounds)},
      free_{topics_} {}

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
  if (found || free_.empty() || bytes > name_bytes_max_) return found;
  const topic_id added = free_.take();
  *names(added) = '/';
  std::memcpy(names(added) + slash, wanted.data(), wanted.size());
  json::writer head{{names(added) + 2 * name_bytes_max_, head_bytes_max_}};
  envelope_.write_topic_head(head, {names(added), bytes});
  if (head.overflowed()) { // it has control characters, or is no UTF-8
    free_.give_back(added);
    return {};
  }
  topic& fresh = topics_[added];
  fresh = topic{};
  fresh.hash = hash_of(without_slash(wanted));
  fresh.channel = next_channel();
  fresh.publishers_at = fresh.subscribers_at = ++changes_.holders;
  ++changes_.listed;
  fresh.name_bytes = static_cast<std::uint16_t>(bytes);
  fresh.head_bytes = static_cast<std::uint16_t>(head.bytes());
  fresh.next = bucket(fresh.hash);
  bucket(fresh.hash) = added;
  return added;
}

std::uint32_t topic_table::next_channel() noexcept {
  return changes_.channels.take([this](std::uint32_t n) { return static_cast<bool>(find_channel(n)); });
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
  topics_[index].aside |= topic::recorders_unknown;
  if (topics_[index].holders == 0) return; // it was not announced
  topics_[index].channel = next_channel(); // a peer that knows it by number also knows its type
  ++changes_.listed;
}

// A topic that its first holder is about to describe was not announced yet.
void topic_table::set_schema(topic_id index, const schema_description* schema) noexcept {
  topic& its = topics_[index];
  if (its.schema == schema) return;
  its.schema = schema;
  its.aside |= topic::recorders_unknown;
  if (its.holders <= 1) return;
  its.channel = next_channel();
  ++changes_.listed;
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
  assert(held.subscriptions.empty() && held.inboxes.empty() && !held.asked); // who records holds no topic
  topic_id* link = &bucket(held.hash);
  while (*link != index) link = &topics_[*link].next;
  *link = held.next;
  held = topic{};
  free_.give_back(index);
  ++changes_.holders;
  ++changes_.listed;
  return true;
}

bool topic_table::check() const noexcept {
  std::uint32_t held = 0;
  std::uint32_t own = 0;
  for (const topic_id first : buckets_) {
    for (topic_id i = first; i; i = topics_[i].next) {
      if (++held > topics_.size() || topics_[i].holders == 0) return false;
      if (topics_[i].own_holders > topics_[i].holders) return false;
      own += topics_[i].own_holders != 0;
    }
  }
  return held == count() && own == own_topics_ &&
         free_.check([](const topic& one) { return one.holders == 0 && !one.has_audience(); });
}

} // namespace rowe::service
