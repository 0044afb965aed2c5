// SPDX-License-Identifier: Apache-2.0
// Tells peers who publishes on each topic, subscribes to it, and provides each service, and what of that has
// changed since. Names are those of graph_services. A peer is told only of what its role may see or call.
//
// What was found of each topic and service is kept here, and compared with what there is once in each period,
// while somebody has subscribed. So a holder that comes and goes all the time costs each peer one message in a
// period. A change has the number of the comparison that found it, and a peer that of the newest one of which
// it was told all. So a peer that does not read costs nothing, and is told later what is so then. Only names
// that are gone have to be kept until everyone was told.
//
// Each message has some of the changes, and replaces what its peer knows of these topics and services. A cycle
// does a bounded amount of this. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/advertisement_table.hpp"
#include "service/core_state.hpp"
#include "service/gone_names.hpp"
#include "service/outbox.hpp"
#include "service/peer_set.hpp"
#include "service/refusals.hpp"
#include "service/service_directory.hpp"
#include "service/service_limits.hpp"
#include "service/stop_rules.hpp"
#include "wire/codec.hpp"
#include "wire/request.hpp"

namespace rowe::service {

class connection_graph {
 public:
  struct needs {
    core_state& state;
    class outbox& outbox;
    class refusals& refusals;
    const class advertisement_table& advertisement_table;
    const class service_directory& service_directory;
    const class stop_rules& stop_rules;
    std::string_view endpoint_name; // outlives this
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(rows_of(bounds)) +
           rt::arena::bytes_for(rows_of(bounds) * gone_names::name_bytes_max(bounds)) +
           gone_names::footprint_bytes(bounds) + rt::arena::bytes_for<subscriber>(bounds.connections_max) +
           rt::arena::bytes_for<std::uint64_t>(peer_set::words_for(bounds.connections_max));
  }
  connection_graph(rt::arena& memory, const needs& parts) noexcept;

  // A request of the peer. It is told all at once, and again if it asks anew later.
  void subscribe(connection& c, const wire::request& asked) noexcept;
  void unsubscribe(peer_index peer) noexcept;
  void forget(peer_index peer) noexcept;
  // The peer may see more than before.
  void tell_again(peer_index peer) noexcept;
  // When the timer is due: compares, and tells some peers. Arms it again.
  void show() noexcept;

  bool check() const noexcept;

 private:
  // What was found of a topic, or of a service: those of the topics come first.
  struct row {
    std::uint32_t publishers = 0; // topic::publishers_at; of a service its number
    std::uint32_t subscribers = 0;
    std::uint32_t published_at = 0;  // the comparison in which that changed; of a service, the provider
    std::uint32_t subscribed_at = 0; // likewise
    std::uint16_t name_bytes = 0;    // 0: there is none
  };
  // A peer. Numbers of comparisons are never 0.
  struct subscriber {
    bool subscribed = false;
    bool anew = false;           // it is told of all rows once more
    bool said = false;           // since `telling`
    std::uint32_t told_at = 0;   // all up to this comparison; 0: it knows nothing
    std::uint32_t telling = 0;   // likewise, while it is told in several messages; 0: it is not
    std::uint32_t from = 0;      // then: the next row,
    std::uint32_t from_gone = 0; // and the next place of a name that is gone
    rt::time_point earliest{};   // when the next round may begin
    bool knows_some() const noexcept { return subscribed && (told_at != 0 || telling != 0); }
  };
  // Of one message: a row, or the place of a name that is gone.
  struct entry {
    std::uint32_t at = 0;
    bool gone = false;
    bool published = false; // of a row: whether this is told, and this
    bool subscribed = false;
  };
  struct part {
    std::uint32_t to = 0; // the first row, and the first place, for a later message
    std::uint32_t to_gone = 0;
    std::size_t count = 0;
    std::size_t bytes = graph_envelope_bytes;
    std::size_t bytes_max = 0;
    std::array<entry, listed_max> which{};
  };

  static std::size_t rows_of(const limits& bounds) noexcept {
    return std::size_t{bounds.topics_max} + bounds.services_max;
  }
  bool is_topic(std::uint32_t of) const noexcept { return of < state_.bounds().topics_max; }
  service_index service_of(std::uint32_t of) const noexcept { return {of - state_.bounds().topics_max}; }
  std::string_view name(std::uint32_t of) const noexcept;
  void set_name(std::uint32_t of, std::string_view name) noexcept;
  std::uint64_t changes() const noexcept;
  void use_work(std::size_t more) noexcept;

  void compare() noexcept;
  void begin_comparison() noexcept;
  void compare_topic(std::uint32_t of, bool listed) noexcept;
  void compare_service(std::uint32_t of) noexcept;
  bool replace(std::uint32_t of, std::string_view now) noexcept;
  bool is_elsewhere(std::uint32_t of) const noexcept;
  void drop_told_names() noexcept;
  void end_comparison() noexcept;
  void leave_behind() noexcept;

  rt::time_point tell_some() noexcept;
  rt::time_point due(peer_index peer) const noexcept;
  rt::time_point tell(peer_index peer) noexcept;
  part gather(const connection& c, const subscriber& to) noexcept;
  bool add_gone(const connection& c, const subscriber& to, part& into) noexcept;
  bool add_row(const connection& c, const subscriber& to, part& into) noexcept;
  bool add(part& into, const entry& one, std::size_t bytes) const noexcept;
  bool send(connection& c, const part& what) noexcept;
  std::size_t part_bytes_max(peer_index peer) const noexcept;
  bool sees(const connection& c, std::string_view name, bool topic) noexcept;
  bool holds(std::uint32_t of) const noexcept;
  std::size_t measure(std::uint32_t of, wire::graph_list which, bool& says) noexcept;
  template <class Take>
  bool for_each_told(std::uint32_t of, wire::graph_list which, const Take& take) const noexcept;
  template <class Take>
  void for_each_holder(std::uint32_t of, wire::graph_list which, const Take& take) const noexcept;

  core_state& state_;
  outbox& outbox_;
  refusals& refusals_;
  const advertisement_table& advertisement_table_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const std::string_view endpoint_name_;
  std::span<row> rows_;
  std::span<char> names_;
  gone_names gone_;
  rows<peer_index, subscriber> subscribers_;
  const peer_set marked_; // scratch
  std::uint32_t count_ = 0; // of subscribers
  std::uint32_t version_ = 0; // of the newest comparison that found a change
  std::uint32_t row_;         // the next one to compare
  bool changed_ = false;      // a row, in the comparison that is under way
  bool nobody_knows_ = true;  // so names that are gone are not kept
  bool held_up_ = false;      // they found no place
  bool stop_in_use_ = false;
  std::uint64_t comparing_ = 0; // changes() when it began,
  std::uint64_t compared_ = 0;  // and when the one before did
  rt::time_point compare_at_{}; // the next one at the earliest
  rt::time_point held_up_since_ = rt::never;
  peer_index turn_{0}; // who is told next
  std::uint32_t work_left_ = 0; // in this cycle
  unsigned messages_left_ = 0;
};

} // namespace rowe::service
