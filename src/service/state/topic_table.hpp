// SPDX-License-Identifier: Apache-2.0
// Topics. A topic exists while something holds it: a subscription of a peer, an advertisement of a peer, or a
// handle of this process. When the last holder leaves, its row is free. Topics that only peers hold are
// counted apart, so peers that make up names cannot take the rows of this process. Everything is an index
// into memory taken at open. Service thread only.
//
// "odom" and "/odom" are one topic, which is called "/odom" here. A peer that subscribes to "odom" gets its
// messages under that name. They come from the same slot; only the byte of the slash is skipped when they are
// written.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/base/names.hpp"
#include "service/state/topic_rows.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

class topic_table {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  topic_table(rt::arena& memory, const limits& bounds, const wire::codec& envelope) noexcept;

  topic_id find(std::string_view name) const noexcept;  // none: there is none
  topic_id find_or_add(std::string_view name) noexcept; // none: topics_max are taken
  topic& at(topic_id index) noexcept { return topics_[index]; }
  const topic& at(topic_id index) const noexcept { return topics_[index]; }
  std::string_view name(topic_id index) const noexcept; // with its slash
  // Finds a topic by its number; none: there is none. A number is never used for another topic or type.
  topic_id find_channel(std::uint32_t channel) const noexcept;
  std::string_view type(topic_id index) const noexcept;
  // A topic has the type that it is given first, in that spelling. False: it has another type already, or the
  // name is too long.
  bool set_type(topic_id index, std::string_view type) noexcept;
  // For a handle of this process: its type replaces another one.
  void replace_type(topic_id index, std::string_view type) noexcept;
  // The schema of its messages, or null. As with another type, peers that know the topic by number learn of
  // it anew.
  void set_schema(topic_id index, const schema_description* schema) noexcept;
  // The text in front of the body of each message of the topic, and the text behind it. The head is encoded
  // once, with the slash.
  std::string_view head(topic_id index) const noexcept;
  std::string_view tail() const noexcept { return tail_; }
  const wire::codec& envelope() const noexcept { return envelope_; }
  void hold(topic_id index) noexcept { ++topics_[index].holders; }
  void hold_as_own(topic_id index) noexcept;
  // One holder less. True: that was the last holder, and the row is free. The caller clears `last` first.
  bool let_go(topic_id index) noexcept;
  bool let_go_as_own(topic_id index) noexcept;
  std::uint32_t count() const noexcept { return free_.in_use(); }
  // Whether no handle of this process holds the topic.
  bool of_peers(topic_id index) const noexcept { return topics_[index].own_holders == 0; }
  std::uint32_t topics_of_peers() const noexcept { return count() - own_topics_; }
  topic_changes& changes() noexcept { return changes_; }
  // All rows, for a walk; those in use have holders.
  auto topic_ids() const noexcept { return topics_.ids(); }

  bool check() const noexcept;

 private:
  char* names(topic_id index) const noexcept { return names_.data() + index.value * name_stride_; }
  std::uint32_t next_channel() noexcept;
  topic_id& bucket(std::uint64_t hash) const noexcept { return buckets_[hash & (buckets_.size() - 1)]; }

  const wire::codec& envelope_;
  const std::string_view tail_ = envelope_.topic_tail();
  rows<topic_id, topic> topics_;
  std::span<topic_id> buckets_;
  std::span<char> names_; // name, type and head of each topic
  std::size_t name_bytes_max_;
  std::size_t head_bytes_max_;
  std::size_t name_stride_;
  indexed_pool<topic_id, topic, &topic::next> free_;
  std::uint32_t own_topics_ = 0;
  topic_changes changes_;
};

} // namespace rowe::service
