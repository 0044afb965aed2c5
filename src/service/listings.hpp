// SPDX-License-Identifier: Apache-2.0
// Numbers in place of names, and the peers that are told them. If its protocol has lists, a client learns at
// once who we are, and which topics and services there are. Later it learns what has changed. Of what
// its role may not subscribe to or call it is told nothing. A topic's
// number is its channel. The endpoint's own services have fixed numbers; those in the directory get theirs as
// they come. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/advertisement_table.hpp"
#include "service/core_state.hpp"
#include "service/outbox.hpp"
#include "service/rate_limit.hpp"
#include "service/service_directory.hpp"
#include "service/service_limits.hpp"
#include "service/stop_rules.hpp"
#include "wire/codec.hpp"
#include "wire/request.hpp"

namespace rowe::service {

// A number in a request that names nothing which its peer may have.
struct unknown_number {
  std::string_view why{}; // before the number; empty: all are known
  std::uint32_t number = wire::no_number;
};

class listings {
 public:
  struct needs {
    core_state& state;
    const class service_directory& service_directory;
    const class stop_rules& stop_rules;
    const class advertisement_table& advertisement_table;
    class outbox& outbox;
    std::string_view endpoint_name; // outlives this
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint32_t>(std::size_t{bounds.connections_max} * rows_of_peer(bounds)) +
           rt::arena::bytes_for<std::uint32_t>(words_for(bounds.connections_max * rows_of_peer(bounds))) +
           rt::arena::bytes_for<reader>(bounds.connections_max);
  }
  listings(rt::arena& memory, const needs& parts) noexcept;

  // A peer that wants lists has connected: it is told who we are, and what there is.
  void greet(connection& c) noexcept;
  void forget(peer_index peer) noexcept;
  // The peer may see more than before.
  void tell_again(peer_index peer) noexcept;
  // Once a cycle: tells peers what is gone and what is new. A peer that has not read the last part waits.
  // Later it is told what differs then. If changes never pause, all peers are told at most every
  // listings_period.
  void tell_changes() noexcept {
    if (readers_count_ != 0) tell_readers();
  }
  // When tell_changes() is needed at the latest.
  rt::time_point due() const noexcept { return due_; }
  // Replaces the numbers in a request by names, unless one is unknown.
  unknown_number put_names(const connection& c, wire::request& asked) const noexcept;

 private:
  // A peer that is told.
  struct reader {
    bool reads = false;
    std::uint64_t told_at = 0; // after how many changes it was told all that there was
  };
  struct part;
  static std::size_t rows_of_peer(const limits& bounds) noexcept {
    return std::size_t{bounds.topics_max} + first_service_number + bounds.services_max;
  }
  static constexpr std::size_t words_for(std::size_t bits) noexcept { return (bits + 31) / 32; }
  // Whether a number in told_ is that of something which its peer may not see.
  bool is_unseen(const std::uint32_t& number) const noexcept;
  void set_unseen(const std::uint32_t& number, bool to) noexcept;
  void forget_unseen(std::uint32_t& number) noexcept;
  std::span<std::uint32_t> told(peer_index peer) const noexcept {
    const std::size_t count = rows_of_peer(state_.bounds());
    return told_.subspan(peer.value * count, count);
  }
  void tell_readers() noexcept;
  void tell(connection& c) noexcept;
  bool tell(connection& c, bool topics, bool added) noexcept;
  bool takes_more(peer_index peer) const noexcept;
  bool send(connection& c, part& of) noexcept;
  std::size_t part_bytes_max(peer_index) const noexcept;
  bool sees(const connection& c, const wire::listed& one, bool topic) const noexcept;
  wire::listed topic_in(topic_id row) const noexcept;
  wire::listed service_in(std::uint32_t row) const noexcept;
  std::string_view service_numbered(std::uint32_t number) const noexcept;
  topic_id topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept;
  std::uint64_t changes() const noexcept {
    return state_.topics.changes().listed + service_directory_.changes() + (stop_rules_.in_use() ? 1 : 0);
  }

  core_state& state_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const advertisement_table& advertisement_table_;
  outbox& outbox_;
  const std::string_view name_;
  const topic_id stop_topic_; // shown only where there is a stop
  rows<peer_index, reader> readers_;
  std::uint32_t readers_count_ = 0;
  std::span<std::uint32_t> told_; // by peer, the numbers that it was told: topics by row, then services
  // Of each of these numbers, whether the peer may not see what has it. Then it was not told, but its role's
  // patterns were compared, which is done once.
  std::span<std::uint32_t> unseen_; // 32 in each word
  std::uint64_t listed_at_ = 0;     // after how many changes peers are told
  rate_limit tells_{listings_period, listings_burst};
  rt::time_point due_ = rt::never;
};

} // namespace rowe::service
