// SPDX-License-Identifier: Apache-2.0
// Folder stop: the emergency stop. What is here takes no slot and no queue.
// The services of the stop: carries out and answers what peers and this process ask. stop_rules.hpp has the
// rules. A stop is carried out when it is read: no slot, queue or table is in its way, and the permit is
// withdrawn before the next message is looked at. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/calls/call_completion.hpp"
#include "service/incoming/access_control.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/core_state.hpp"
#include "service/stop/stop_gate.hpp"
#include "service/stop/stop_switch.hpp"
#include "service/stop/thread_stops.hpp"
#include "wire/codec/request.hpp"
#include "wire/protocols/protocols.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

struct stop_service_needs {
  core_state& state_;
  sender& sender_;
  access_control& access_control_;
  call_completion& call_completion_;
  command_gate& command_gate_;
  stop_rules& stop_rules_;
};

class stop_service : stop_service_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<waiter>(waiters_of(bounds)) +
           rt::arena::bytes_for<row>(bounds.connections_max);
  }
  stop_service(rt::arena& memory, const stop_service_needs& parts) noexcept;

  void open(peer_index peer) noexcept {
    rows_[peer] = {};
    command_gate_.open(peer);
  }
  // A peer has left, or is not read any more: the loops that it guarded stop, and it
  // drives no more.
  void leave(const connection& c) noexcept;

  // Attaches the handle of a loop. Errors: too_many_latches.
  status attach(pair_index pair) noexcept;
  void detach(pair_index pair) noexcept;

  // There is something that can be stopped.
  bool in_use() const noexcept { return stop_rules_.in_use(); }
  // `args`: a JSON object, or nothing. The asker is answered, now or in a later update().
  void carry_out(stop_verb which, const stop_asker& asker, std::string_view args) noexcept;
  // A peer's call of one of these services. An id that is too long is not repeated in the answer.
  void carry_out_call(const connection& c, const wire::request& asked, stop_verb which) noexcept {
    const bool too_long = asked.id_raw.size() > call_id_bytes_max;
    carry_out(
        which,
        {.who = call_endpoint::of(c.id, asked.codec), .id_raw = too_long ? std::string_view{} : asked.id_raw},
        asked.body_raw);
  }
  // A stop for which a peer wants no answer: it was published, or is a plain message without an id.
  void carry_out_unanswered(const connection& c, std::string_view args) noexcept {
    carry_out(stop_verb::stop, {.who = call_endpoint::of(c.id, c.spoke_last), .silent = true}, args);
  }
  // Stops the loops: the endpoint is about to close.
  void stop_all() noexcept;

  // In each cycle, after reading: looks at loops, guards, threads and the clock, and sends the answers.
  void update() noexcept {
    if (in_use()) look();
  }
  // When update() is needed at the latest.
  rt::time_point next_update() const noexcept;

  // Whether a peer on stop_path may lose its place to the next one. A peer that stopped a robot that could
  // move holds its place for a second, so it gets the answer and sees the state. Stopping a robot that has
  // stopped already protects no place, however often it is done.
  bool may_displace(const connection& c) const noexcept {
    return state_.cycle.now - rows_[{c.id.index}].stopped_at >= stop_place_protected_for;
  }

  // Each waiter has an asker, and is counted with its peer.
  bool check() const noexcept;

 private:
  // Who waits for the answer to a stop.
  struct waiter {
    call_endpoint who{};
    detail::call_ref call{};
    rt::time_point accepted{};
    rt::time_point until{};
    std::uint16_t id_bytes = 0;
    std::array<char, call_id_bytes_max> id{};
  };
  // Of one peer.
  struct row {
    rt::time_point stopped_at{}; // when it last stopped a robot that was free to move
    std::uint8_t awaited = 0;    // how many of its stops the loops have not acknowledged
  };
  // What became of a request.
  struct decision {
    rt::time_point accepted{};
    stop_rules::refusal refused = stop_rules::refusal::none;
    access::right needed = access::right::reset; // refused for want of it: role
  };
  // How many stops may wait for the loops: one for each peer, and some of this process.
  static std::size_t waiters_of(const limits& bounds) noexcept {
    return bounds.connections_max + stops_awaited_of_process;
  }

  connection* peer_of(const call_endpoint& who) const noexcept {
    return who.who == call_endpoint::kind::peer ? state_.peers.find(who.connection()) : nullptr;
  }
  void look() noexcept;
  void await_loops(const stop_asker& asker) noexcept;
  void answer_acknowledged() noexcept;
  void answer(stop_verb which, const stop_asker& asker, const decision& made) noexcept;
  void write_answer(json::writer& into, stop_verb which, const decision& made) noexcept;

  stop_switch switch_;
  thread_stops threads_;
  rows<peer_index, row> rows_;
  std::span<waiter> waiters_; // a ring: first come, first answered
  std::uint32_t first_waiter_ = 0;
  std::uint32_t waiting_ = 0;
  rt::time_point waits_since_{}; // when the newest waiter came
};

} // namespace rowe::service
