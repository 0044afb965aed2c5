// SPDX-License-Identifier: Apache-2.0
// A peer's subscription to a topic, and a topic. Service thread only.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <rowe/options.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/ids.hpp"
#include "service/base/index_list.hpp"
#include "service/base/listed_numbers.hpp"
#include "service/base/message_queue.hpp"
#include "service/base/service_limits.hpp"
#include "service/state/latched_values.hpp"
#include "service/state/pair_table.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

// What one subscribe request asked for; a peer's requests for one topic are merged.
struct subscribe_request {
  std::uint64_t id_hash = 0;
  rt::duration throttle{0};
  std::uint32_t queue_length = 0; // 0: not stated
  wire::codec_id codec{};         // of the messages
};

// The id of a request as it was written: where it is (stored_ids.hpp).
struct stored_id {
  id_block_id first{}; // none: there is none, or it was not stored
  std::uint16_t bytes = 0;
};

struct subscription {
  topic_id topic{};
  peer_index peer{};
  subscription_id next_on_topic{};
  subscription_id previous_on_topic{};
  subscription_id next_on_peer{}; // or in the free list
  subscription_id next_ready{};
  queue pending;
  std::uint32_t depth = 0;
  std::uint32_t type_hash = 0;                      // of the type that the peer expects, hash_of_type()
  rowe::priority ready_as = rowe::priority::normal; // on which of its peer's lists, while ready
  bool ready = false;           // on its peer's list of subscriptions that may be written now
  bool served = false;          // the batch that is being committed has a message of it
  bool timed = false;           // on the wheel until next_due
  bool unslashed = false;       // the peer calls the topic by its name without the slash
  bool own_head = false;        // it is sent with a head of its own, not the shared text of the slot
  bool merges = false;          // a newer value takes the place of an older one
  bool latched_pending = false; // latched values are still to be queued, before newer ones
  bool discards = false;        // a value within the throttle period is dropped, not queued
  bool whole = false;           // its codec writes whole messages;
  bool of_types = false;        // and needs no JSON of structs
  bool missed = false;          // its deadline, and that was reported
  wire::codec_id codec{};
  std::uint8_t request_count = 0;
  std::uint32_t tag = wire::no_number; // the peer's number for the subscription
  rt::duration throttle{0};
  rt::time_point sent_at{}; // the throttle counts from here; zero: nothing was sent
  rt::time_point next_due{};
  std::int64_t lifespan_ns = wire::unlimited; // a message that was published longer ago is not written
  std::int64_t deadline_ns = wire::unlimited; // the most time between two messages, watched
  rt::time_point watched_at{};                // since when; or, behind a miss, when that was
  std::array<subscribe_request, subscribe_requests_max> requests;
  latched_place latched_delivered{}; // the last latched value that was queued,
  std::uint64_t latched_until = 0;   // and the number of the last one that is to be
  stored_id deadline_of;             // of the newest request that asked for a deadline
};

struct topic {
  std::uint64_t hash = 0;
  topic_id next{};               // in its bucket, or in the free list
  std::uint32_t holders = 0;     // subscriptions, advertisements and handles
  std::uint32_t own_holders = 0; // those of this process
  std::uint32_t own_alone = 0;   // publishers of this process that do not share the topic with peers
  std::uint32_t channel = 0;     // its number, for codecs that number their topics
  driven_index driven{};         // where its commands are judged; none: it has no lease
  std::uint32_t charged_in = 0;  // the count of topic_places::claims_now() in which its place was charged
  index_list<subscription_id, subscription, &subscription::next_on_topic, &subscription::previous_on_topic>
      subscriptions;
  std::uint32_t whole = 0;    // subscriptions to which the same word of theirs applies
  std::uint32_t of_types = 0; // likewise
  index_queue<pair_index, pair_row, &pair_row::next_inbox> inboxes; // handles of this process that subscribe
  const schema_description* schema = nullptr; // of a typed handle of this process; null: there is none
  std::uint32_t audience_changes = 0;         // how often a subscriber came or went
  std::uint32_t publishers_at = 0;            // when one came or went last: topic_changes::holders then,
  std::uint32_t subscribers_at = 0;           // likewise
  std::uint16_t name_bytes = 0;
  std::uint16_t type_bytes = 0;
  std::uint16_t head_bytes = 0;
  rowe::priority priority = rowe::priority::normal;
  rowe::keep keep = rowe::keep::all;
  // In a client: whether `subscribe`, and `advertise`, have the name without its slash, as the first handle
  // wrote it.
  bool asked_unslashed = false;
  bool offered_unslashed = false;
  latched_list latched; // for late subscribers
  rt::time_point
      loss_reported_at{}; // when it was reported here that a value of ours is too long, or not retained
  last_value_id asked{};  // for who asks over HTTP, where somebody did lately
  // Who gets its values besides subscribers: a bit for each that records it (recordings.hpp), one that says
  // that others may, and one for `asked`.
  static constexpr std::uint8_t recorders = 0x3f;
  static constexpr std::uint8_t recorders_unknown = 0x80;
  static constexpr std::uint8_t asked_over_http = 0x40;
  std::uint8_t aside = recorders_unknown;

  // Returns what `asked` was before.
  last_value_id set_asked(last_value_id now) noexcept {
    aside = static_cast<std::uint8_t>((aside & ~asked_over_http) | (now ? asked_over_http : 0));
    return std::exchange(asked, now);
  }
  bool has_audience() const noexcept {
    return !subscriptions.empty() || !inboxes.empty() || asked || is_recorded();
  }
  bool is_recorded() const noexcept { return (aside & recorders) != 0; }

  // For /rowe/stats.
  std::uint64_t messages = 0;
  std::uint64_t messages_before = 0; // at the last report
  std::size_t bytes = 0;             // of the newest body
  rt::time_point newest_at{};        // zero: nobody has subscribed so far
  rt::duration gap_max{0};           // since the last report

  // For the service /rowe/stats, which has its own periods (topic_rates::mark_if_due).
  std::array<std::uint64_t, 2> messages_marked{}; // when the newest period began, and the one before
  std::array<rt::duration, 2> gap_marked{};       // in these two periods, without gap_max
};

// How often topics have changed.
struct topic_changes {
  std::uint64_t listed = 0; // one was added or removed, or got another type or schema
  listed_numbers channels{1, 0};
  std::uint32_t holders = 0; // a publisher or a subscriber came or went, or a topic. Wraps around

  void note_publishers(topic& of) noexcept { of.publishers_at = ++holders; }
  void note_subscribers(topic& of) noexcept { of.subscribers_at = ++holders; }
};

} // namespace rowe::service
