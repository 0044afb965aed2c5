// SPDX-License-Identifier: Apache-2.0
// Folder graph: what a peer may learn of others: lists, types, connections. It changes nothing.
// Announces to peers who publishes on each topic, subscribes to it, and provides each service, and then the
// changes. Names are those of graph_services. A peer learns only of what its role may see or call.
//
// Once in each period, while somebody has subscribed, the present state is compared with the last one
// (graph_record.hpp). So a holder that comes and goes all the time costs each peer one message in a period.
// Comparisons have numbers. A change has the number of the one that found it; a peer has that of the newest
// one of which it knows all. So a peer that does not read costs nothing, and learns later what is so then.
//
// Each message has some of the changes, and replaces what its peer knows of these topics and services. A
// cycle does a bounded amount of this. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/graph/graph_message.hpp"
#include "service/graph/graph_record.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/advertisement_table.hpp"
#include "service/state/announcement.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct connection_graph_needs {
  core_state& state_;
  outbox& outbox_;
  refusals& refusals_;
  const advertisement_table& advertisement_table_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const std::string_view endpoint_name_; // outlives this
};

class connection_graph : connection_graph_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return graph_record::footprint_bytes(bounds) + graph_message::footprint_bytes(bounds) +
           rt::arena::bytes_for<subscriber>(bounds.connections_max);
  }
  connection_graph(rt::arena& memory, const connection_graph_needs& parts) noexcept;

  // Requests of peers. A new subscriber gets all at once; one that subscribes again and again, as often as
  // others get changes.
  void subscribe(connection& c, const wire::request& asked) noexcept;
  void unsubscribe(peer_index peer) noexcept;
  void forget(peer_index peer) noexcept;
  // When the timer is due: compares, and announces changes to some peers. Arms it again.
  void show() noexcept;

  bool check() const noexcept;

 private:
  // A peer. Numbers of comparisons are never 0.
  struct subscriber {
    bool subscribed = false;
    bool anew = false;              // all rows are announced once more
    bool said = false;              // something, since `announcing`
    bool ends = false;              // the round ends with the message that waits
    std::uint32_t announced_at = 0; // all up to this comparison; 0: it knows nothing
    std::uint32_t announcing = 0;   // likewise, of the round that goes on, in several messages; 0: none
    std::uint32_t from = 0;         // then: the next row,
    std::uint32_t from_gone = 0;    // and the next place of a name that is gone
    rt::time_point earliest{};      // when the next round may begin
    announcement message{};         // that waits to be written
    std::uint32_t then = 0;         // `from` and `from_gone` when it was written
    std::uint32_t then_gone = 0;
    bool knows_some() const noexcept { return subscribed && (announced_at != 0 || announcing != 0); }
  };

  void announce_again_if_rights_changed() noexcept;
  void compare() noexcept;
  std::uint32_t least_announced() const noexcept;
  void leave_behind() noexcept;
  rt::time_point announce_some() noexcept;
  rt::time_point due(peer_index peer) const noexcept;
  rt::time_point announce(peer_index peer) noexcept;
  void settle(peer_index peer) noexcept;
  void go_on(subscriber& to) noexcept;
  graph_part gather(const connection& c, const subscriber& to) noexcept;
  bool add_gone(const connection& c, const subscriber& to, graph_part& into) noexcept;
  bool add_row(const connection& c, const subscriber& to, graph_part& into) noexcept;
  std::size_t part_bytes_max(peer_index peer) const noexcept;
  bool sees(const connection& c, std::string_view name, bool topic) noexcept;

  graph_record record_;
  graph_message message_;
  rows<peer_index, subscriber> subscribers_;
  std::uint32_t count_ = 0;      // of subscribers
  std::uint32_t policy_version_; // when it was looked at last
  rt::time_point held_up_since_ = rt::never;
  peer_index turn_{0}; // whose turn is next
  graph_work work_;
  unsigned messages_left_ = 0; // in this cycle
};

} // namespace rowe::service
