// SPDX-License-Identifier: Apache-2.0
// What peers whose protocol has requests for parameters ask about them, without a call: they get values, set
// them, and subscribe to changes. Who may call `/rosapi/get_param` may get all, and subscribe to them; to set
// one takes the right `set` for its name. Changes of the endpoint's own ones are not announced: counters
// change all the time. A peer that does not read gets each parameter later, once, with the value that it has
// then; so does one whose message was evicted. If another parameter takes the place of one that is gone
// before that, the peer does not learn that this is gone. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/incoming/access_control.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/parameters/parameters.hpp"
#include "service/state/announcement.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"
#include "json/reading/reader.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct parameter_requests_needs {
  core_state& state_;
  outbox& outbox_;
  refusals& refusals_;
  access_control& access_control_;
  parameters& parameters_;
};

class parameter_requests : parameter_requests_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<subscriber>(bounds.connections_max) +
           rt::arena::bytes_for<std::uint64_t>(std::size_t{bounds.connections_max} * bounds.parameters_max);
  }
  parameter_requests(rt::arena& memory, const parameter_requests_needs& parts) noexcept;

  // Requests of peers; a status says what is refused. Each names so many parameters at most as there are
  // numbers of them; to set, as handles may open.
  void get(connection& c, const wire::request& asked) noexcept;
  void set(connection& c, const wire::request& asked) noexcept;
  // The peer gets the values at once, so none is missed between a request for values and this.
  void subscribe(connection& c, const wire::request& asked) noexcept;
  void unsubscribe(connection& c, const wire::request& asked) noexcept;

  void forget(peer_index peer) noexcept { subscribers_[peer] = {}; }
  // Announces changes to subscribers: to a few of them in a cycle, because each gets its own message.
  enum class round : std::uint8_t {
    all_know,
    more_next,  // others have their turn in the next cycle
    some_later, // some did not read, or something has changed since
  };
  round announce_changes() noexcept;

 private:
  // A peer. It may name parameters that there are not yet.
  struct subscriber {
    bool to_all = false;
    std::uint32_t named = 0;        // names that it has in named_
    std::uint64_t announced_at = 0; // parameters::changes() before its last message
    std::uint64_t announcing = 0;   // likewise, of a round of several messages
    announcement message{};         // that waits to be written
    std::uint32_t from = 0;         // where the next one begins
    std::uint32_t then = 0;         // `from` when it is written; 0: it ends the round
    bool any() const noexcept { return to_all || named != 0; }
  };

  // Hashes of names.
  std::span<std::uint64_t> names_of(peer_index peer) const noexcept {
    const std::size_t most = state_.bounds().parameters_max;
    return named_.subspan(peer.value * most, most);
  }
  bool is_named(peer_index peer, std::string_view name) const noexcept;
  bool names_too_many(connection& c, const wire::request& asked, std::uint32_t most) noexcept;
  void set_one(connection& c, const wire::request& asked, const json::value& one) noexcept;
  void subscribe_to(connection& c, const wire::request& asked, std::string_view name) noexcept;
  void answer(connection& c, const wire::request& asked) noexcept;
  void write_named(json::writer& into, const wire::codec& codec, std::string_view list) const noexcept;
  void write_value(json::writer& into, const wire::codec& codec, parameter_id which) const noexcept;
  std::size_t bytes_of(parameter_id which) const noexcept;
  bool settle(peer_index peer) noexcept;
  static void go_on(subscriber& of) noexcept;
  void announce(connection& c) noexcept;
  bool needs_update(peer_index peer, parameter_id which) const noexcept;

  rows<peer_index, subscriber> subscribers_;
  std::span<std::uint64_t> named_;
  peer_index turn_{0}; // who has the next turn of a round
};

} // namespace rowe::service
