// SPDX-License-Identifier: Apache-2.0
// Numbers in place of names, and the peers that get them. If its protocol has lists, a client learns at once
// who we are, and which topics and services there are; later it learns what has changed. It learns nothing of
// what its role may not subscribe to or call. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/rate_limit.hpp"
#include "service/base/service_limits.hpp"
#include "service/graph/announced_numbers.hpp"
#include "service/graph/numbered.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/announcement.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

// A number in a request that names nothing which its peer may have.
struct unknown_number {
  std::string_view why{}; // before the number; empty: all are known
  std::uint32_t number = wire::no_number;
};

struct listings_needs {
  core_state& state_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const advertisement_table& advertisement_table_;
  outbox& outbox_;
  const std::string_view endpoint_name_; // outlives this
};

class listings : listings_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return announced_numbers::footprint_bytes(bounds) + rt::arena::bytes_for<reader>(bounds.connections_max);
  }
  listings(rt::arena& memory, const listings_needs& parts) noexcept;

  // A peer that wants lists has connected: it gets who we are, and what there is.
  void greet(connection& c) noexcept;
  void forget(peer_index peer) noexcept;
  // The peer may see more than before.
  void announce_again(peer_index peer) noexcept;
  // Once a cycle: announces to some peers what is gone and what is new. Nothing is queued for a peer that
  // does not read; later it gets what differs then. If changes never pause, each peer gets them once in a
  // listings_period at most.
  void announce_changes() noexcept {
    if (readers_count_ != 0) announce_to_readers();
  }
  // When announce_changes() is needed at the latest.
  rt::time_point due() const noexcept { return due_; }
  // Replaces the numbers in a request by names, unless one is unknown.
  unknown_number put_names(const connection& c, wire::request& asked) const noexcept;

 private:
  // The steps of a round, in order. What is gone comes first, for a name may have got another number.
  enum class step : std::uint8_t { hello, topics_gone, topics_new, services_gone, services_new, none };
  // A peer that gets lists, in rounds. A round announces what is so when it begins, and takes as many
  // messages as that needs, one after the other. What comes later is for the next round, so that each ends.
  struct reader {
    bool reads = false;
    step next = step::none;      // of this round; none: it has ended
    step announced = step::none; // of the message that waits to be written
    announcement message{};      // that
    std::uint32_t from = 0;      // the next row of this step
    std::uint32_t newest = 0;    // the newest number of a topic when the round began,
    std::uint32_t newest_of_services = 0;
    std::uint64_t announced_at = 0; // after how many changes the round began
  };
  struct part;
  static constexpr bool is_of_topics(step of) noexcept {
    return of == step::topics_gone || of == step::topics_new;
  }
  static constexpr bool is_of_new(step of) noexcept {
    return of == step::topics_new || of == step::services_new;
  }
  void announce_to_readers() noexcept;
  bool is_up_to_date(peer_index peer) const noexcept;
  rt::time_point take_turn(connection& c) noexcept;
  void begin_round(reader& of) noexcept;
  static void end_round(reader& of) noexcept;
  bool settle(peer_index peer) noexcept;
  bool announce(connection& c) noexcept;
  bool say_hello(connection& c) noexcept;
  void gather(const connection& c, reader& to, part& into) noexcept;
  bool send(connection& c, const part& of) noexcept;

  const numbered numbered_;
  rows<peer_index, reader> readers_;
  std::uint32_t readers_count_ = 0;
  announced_numbers announced_;
  std::uint64_t listed_at_ = 0; // after how many changes peers get them
  rate_limit rate_{listings_period, listings_burst};
  bool all_up_to_date_ = true;
  peer_index turn_{0};                       // whose turn is next
  unsigned turns_left_ = listings_per_cycle; // in this cycle
  rt::time_point due_ = rt::never;
};

} // namespace rowe::service
