// SPDX-License-Identifier: Apache-2.0
// Topics and who wants them. A topic exists while something holds it: a subscription of a peer, an
// advertisement of a peer, or a handle of this process; the last one to let go frees its place. Those that
// only peers hold are counted apart, so that peers that make up names cannot take the places of this process.
// Everything is an index into memory taken at open. Service thread only.
//
// "odom" and "/odom" are one topic, which is called "/odom" here. A peer that subscribes to "odom" is sent
// its messages under that name: the same slot, but for the byte of the slash, which is left out as it is
// written.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/latch_store.hpp"
#include "service/names.hpp"
#include "service/queues.hpp"
#include "service/wire_slots.hpp"
#include "wire/codec.hpp"

namespace rowe::service {

struct topic {
  std::uint64_t hash = 0;
  std::uint32_t next = no_index; // in its bucket, or in the free list
  std::uint32_t holders = 0;     // subscriptions, advertisements and handles
  std::uint32_t own_holders = 0; // those of this process
  std::uint32_t charged_in = 0;  // the count of core::claims_to_topics() in which its place was charged
  std::uint32_t first_subscription = no_index;
  std::uint32_t subscriptions = 0;
  std::uint32_t first_inbox = no_index; // handles of this process that subscribe
  std::uint16_t name_bytes = 0;
  std::uint16_t type_bytes = 0;
  std::uint16_t head_bytes = 0;
  rowe::priority priority = rowe::priority::normal;
  rowe::keep keep = rowe::keep::all;
  // As a client: how the server is told what we subscribe to and publish; as the first handle calls it.
  bool asked_unslashed = false;
  bool offered_unslashed = false;
  latched_value last; // for those who come late

  // For /rowe/stats.
  std::uint64_t messages = 0;
  std::uint64_t messages_before = 0; // at the last report
  std::size_t bytes = 0;             // of the newest body
  rt::time_point newest_at{};        // zero: nobody listened until now
  rt::duration gap_max{0};           // since the last report

  // For the service of that name, which has periods of its own (core::mark_rates).
  std::array<std::uint64_t, 2> messages_marked{}; // when the newest period began, and the one before
  std::array<rt::duration, 2> gap_marked{};       // in these, but for gap_max
};

// What one subscribe request asked for; a peer's requests for one topic are merged.
struct subscribe_request {
  std::uint64_t id_hash = 0;
  rt::duration throttle{0};
  std::uint32_t queue_length = 0; // 0: not stated
};

struct subscription {
  std::uint32_t topic = no_index;
  std::uint32_t connection = no_index;
  std::uint32_t next_on_topic = no_index;
  std::uint32_t previous_on_topic = no_index;
  std::uint32_t next_on_connection = no_index; // or in the free list
  subscription_id next_ready{};
  queue waiting;
  std::uint32_t depth = 0;
  std::uint32_t type_hash = 0;                      // of the type that the peer expects, hash_of_type()
  rowe::priority ready_as = rowe::priority::normal; // on which of its connection's lists, while ready
  bool ready = false;     // on its connection's list of those that may be written now
  bool served = false;    // something of it was written in the batch that is being settled
  bool timed = false;     // on the wheel until next_due
  bool unslashed = false; // the peer calls the topic by its name without the slash
  bool merges = false;    // a newer value takes the place of an older one
  bool owes_last = false; // the latched value is to be queued in front of what comes
  bool discards = false;  // what comes within the throttle period is not even queued
  rt::duration throttle{0};
  rt::time_point sent_at{}; // the throttle counts from here; zero: nothing was sent
  rt::time_point next_due{};
  std::uint8_t request_count = 0;
  std::array<subscribe_request, 4> requests;
};

class router {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  router(rt::arena& memory, const limits& bounds, const wire::codec& envelope) noexcept;

  // Topics.
  std::uint32_t find(std::string_view name) const noexcept;  // no_index when there is none
  std::uint32_t find_or_add(std::string_view name) noexcept; // no_index when topics_max are taken
  topic& at(std::uint32_t index) noexcept { return topics_[index]; }
  const topic& at(std::uint32_t index) const noexcept { return topics_[index]; }
  std::string_view name(std::uint32_t index) const noexcept; // with its slash
  std::string_view type(std::uint32_t index) const noexcept;
  // The type a topic is first given stays, in that spelling. False when it has another one, or the name is
  // too long.
  bool set_type(std::uint32_t index, std::string_view type) noexcept;
  // For a handle of this process: its type takes the place of another one.
  void replace_type(std::uint32_t index, std::string_view type) noexcept;
  // What stands in front of the body of each of its messages, made once, with the slash; and behind it.
  std::string_view head(std::uint32_t index) const noexcept;
  std::string_view tail() const noexcept { return tail_; }
  const wire::codec& envelope() const noexcept { return envelope_; }
  void hold(std::uint32_t index) noexcept { ++topics_[index].holders; }
  void hold_as_own(std::uint32_t index) noexcept;
  // True when nobody holds the topic any more and its place is free; the caller clears `last` first.
  bool let_go(std::uint32_t index) noexcept;
  bool let_go_as_own(std::uint32_t index) noexcept;
  std::uint32_t topic_count() const noexcept { return topic_count_; }
  // Those that no handle of this process holds.
  bool of_peers(std::uint32_t index) const noexcept { return topics_[index].own_holders == 0; }
  std::uint32_t topics_of_peers() const noexcept { return topic_count_ - own_topics_; }
  // Places, for walking all topics: those in use have holders.
  std::uint32_t topic_places() const noexcept { return static_cast<std::uint32_t>(topics_.size()); }

  // Subscriptions: on a topic's list and on a connection's, whose head the caller keeps.
  subscription& subscription_at(std::uint32_t index) noexcept { return subscriptions_[index]; }
  const subscription& subscription_at(std::uint32_t index) const noexcept { return subscriptions_[index]; }
  rows<subscription_id, subscription> subscriptions() const noexcept { return {subscriptions_}; }
  // A peer may hold two to a topic: one for each of its spellings. The first found of either, or that of one.
  std::uint32_t find_subscription(std::uint32_t topic, std::uint32_t first_on_connection) const noexcept;
  std::uint32_t find_subscription(std::uint32_t topic, std::uint32_t first_on_connection,
                                  bool unslashed) const noexcept;
  std::uint32_t add_subscription(std::uint32_t topic, std::uint32_t connection,
                                 std::uint32_t& first_on_connection) noexcept;
  void remove_subscription(std::uint32_t index, std::uint32_t& first_on_connection) noexcept;
  std::uint32_t subscription_count() const noexcept { return subscription_count_; }
  std::uint32_t subscription_places() const noexcept {
    return static_cast<std::uint32_t>(subscriptions_.size());
  }

  // Merges the requests of a subscription into what it does: the smallest throttle, the smallest queue.
  void merge(subscription& of, std::uint32_t depth_max) noexcept;

  bool check() const noexcept;

 private:
  char* names(std::uint32_t index) const noexcept { return names_.data() + index * name_stride_; }
  std::uint32_t& bucket(std::uint64_t hash) const noexcept { return buckets_[hash & (buckets_.size() - 1)]; }

  const wire::codec& envelope_;
  const std::string_view tail_ = envelope_.topic_tail();
  std::span<topic> topics_;
  std::span<std::uint32_t> buckets_;
  std::span<char> names_; // name, type and head of each topic
  std::span<subscription> subscriptions_;
  std::size_t name_bytes_max_;
  std::size_t head_bytes_max_;
  std::size_t name_stride_;
  std::uint32_t free_topic_ = no_index;
  std::uint32_t free_subscription_ = no_index;
  std::uint32_t topic_count_ = 0;
  std::uint32_t own_topics_ = 0;
  std::uint32_t subscription_count_ = 0;
};

} // namespace rowe::service
