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
           2 * rt::arena::bytes_for<std::uint32_t>(words_for(bounds.connections_max * rows_of_peer(bounds))) +
           rt::arena::bytes_for<reader>(bounds.connections_max);
  }
  listings(rt::arena& memory, const needs& parts) noexcept;

  // A peer that wants lists has connected: it is told who we are, and what there is.
  void greet(connection& c) noexcept;
  void forget(peer_index peer) noexcept;
  // The peer may see more than before.
  void tell_again(peer_index peer) noexcept;
  // Once a cycle: tells some peers what is gone and what is new. Nothing is queued for a peer that does not
  // read; later it is told what differs then. If changes never pause, all peers are told at most every
  // listings_period.
  void tell_changes() noexcept {
    if (readers_count_ != 0) tell_readers();
  }
  // When tell_changes() is needed at the latest.
  rt::time_point due() const noexcept { return due_; }
  // Replaces the numbers in a request by names, unless one is unknown.
  unknown_number put_names(const connection& c, wire::request& asked) const noexcept;

 private:
  // In which order a peer is told. What is gone comes first, for a name may have got another number.
  enum class step : std::uint8_t { hello, topics_gone, topics_new, services_gone, services_new, none };
  // A peer that is told, in rounds. A round tells what is so when it begins, and takes as many messages as
  // that needs, one after the other. What comes later is for the next round, so that each ends.
  struct reader {
    bool reads = false;
    step next = step::none;   // of this round; none: it has ended
    step told = step::none;   // of the message that waits to be written
    slot_ref waits{};         // that message; no index: there is none
    std::uint32_t from = 0;   // the next row of this step
    std::uint32_t newest = 0; // the newest number of a topic when the round began,
    std::uint32_t newest_of_services = 0;
    std::uint64_t told_at = 0; // after how many changes the round began
  };
  struct part;
  static std::size_t rows_of_peer(const limits& bounds) noexcept {
    return std::size_t{bounds.topics_max} + first_service_number + bounds.services_max;
  }
  static constexpr std::size_t words_for(std::size_t bits) noexcept { return (bits + 31) / 32; }
  // A bit for each number in told_.
  bool is_set(std::span<const std::uint32_t> bits, const std::uint32_t& number) const noexcept;
  void set(std::span<std::uint32_t> bits, const std::uint32_t& number, bool to) noexcept;
  void forget_unseen(std::uint32_t& number) noexcept;
  std::span<std::uint32_t> told(peer_index peer) const noexcept {
    const std::size_t count = rows_of_peer(state_.bounds());
    return told_.subspan(peer.value * count, count);
  }
  std::span<std::uint32_t> told(peer_index peer, step of) const noexcept {
    const std::size_t topics_max = state_.bounds().topics_max;
    const bool topics = of == step::topics_gone || of == step::topics_new;
    return topics ? told(peer).first(topics_max) : told(peer).subspan(topics_max);
  }
  void tell_readers() noexcept;
  bool is_told(peer_index peer) const noexcept;
  rt::time_point take_turn(connection& c) noexcept;
  void begin_round(reader& of) noexcept;
  static void end_round(reader& of) noexcept;
  bool settle(peer_index peer) noexcept;
  bool tell(connection& c) noexcept;
  bool say_hello(connection& c) noexcept;
  void gather(const connection& c, reader& to, part& into) noexcept;
  bool send(connection& c, const part& of) noexcept;
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
  // Likewise, whether it is in the message that waits to be written to the peer.
  std::span<std::uint32_t> waits_;
  std::uint64_t listed_at_ = 0; // after how many changes peers are told
  rate_limit tells_{listings_period, listings_burst};
  bool all_told_ = true;
  peer_index turn_{0};                       // who is told next
  unsigned turns_left_ = listings_per_cycle; // in this cycle
  rt::time_point due_ = rt::never;
};

} // namespace rowe::service
