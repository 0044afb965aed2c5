// SPDX-License-Identifier: Apache-2.0
// Lets commands pass to the handles whose topic has a lease. driver_rules.hpp has the rules; here is what
// they are told: who a peer is, and when it sent what it sent.
//
// Clocks are not compared. A command that sends back a tick was sent after the tick was issued. A command
// without a tick was sent after the newest ping that its peer answered before it: both come in the order in
// which they were sent. On a new connection this says nothing of commands that were queued before, so those
// that came before the first such answer do not count. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/control/driver_rules.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct command_gate_needs {
  core_state& state_;
  const stop_rules& stop_rules_;
  sender& sender_;
  refusals& refusals_;
};

class command_gate : command_gate_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(bounds.connections_max);
  }
  command_gate(rt::arena& memory, const command_gate_needs& parts) noexcept;

  void open(peer_index peer) noexcept { rows_[peer] = {}; }
  // A peer has left, or is not read any more: it drives no more.
  void leave(const connection& c) noexcept;

  // A handle with a lease was attached to its topic, or is about to leave it. Errors: too_many_leases.
  status attach(pair_index pair) noexcept;
  void detach(pair_index pair) noexcept;

  // ---- commands. What does not pass is counted, and reported to its sender.

  struct passed {
    rt::time_point sent;  // not before
    rt::time_point until; // when it is not in force any more
  };
  // A peer's command; none: it does not pass.
  std::optional<passed> admit(connection& from, const wire::request& command, topic_id topic) noexcept;
  // The same for what this process publishes itself, on a topic that it drives as any peer does.
  std::optional<passed> admit_own(topic_id topic, rt::time_point published) noexcept;
  // A handle with a lease has got what passed, so it counts: whoever sent it drives. `by` none: this process.
  void count(topic_id topic, detail::peer_ref by, rt::time_point sent) noexcept;

  // ---- state

  // A driven topic.
  struct place {
    topic_id topic{}; // none: free
    std::uint32_t handles = 0;
    driver_rules rules;
  };
  bool any() const noexcept { return count_ != 0; }
  std::span<const place> places() const noexcept { return places_; }
  const place& at(driven_index of) const noexcept { return places_[of.value]; }
  // By a topic's name; empty: the only one that there is. None: there is no such driven topic.
  driven_index find(std::string_view topic) const noexcept;
  // Raised when something that peers see changes, except ages.
  std::uint64_t version() const noexcept;

  // Changes who drives, by `change(driver_rules&)`.
  template <class Change>
  void change(driven_index of, Change&& change) noexcept {
    change(places_[of.value].rules);
    publish_turn(of);
  }

  // Ends the control of who is silent.
  void update() noexcept;
  rt::time_point next_update() const noexcept;
  // Before loops may move or must stop: what was sent before counts no more. The first loop with a latch
  // stops the robot, too, and that stop has no new number.
  void note_stop() noexcept {
    if (stop_rules_.number() != stop_number_ || stop_rules_.in_use() != stop_in_use_) void_commands();
  }

  // Each driven topic has handles with its lease, and each turn is theirs.
  bool check() const noexcept;

 private:
  // Of a peer that sends commands without ticks.
  struct row {
    rt::time_point commanded_at{}; // when its first command came; zero: none has come
  };

  driver_rules& rules_of(driven_index of) noexcept { return places_[of.value].rules; }
  rt::time_point sent_at(const connection& from, const wire::request& command, rt::duration lease) noexcept;
  void refuse(connection& from, const wire::request& command, driven_index of, driver_rules::verdict why,
              rt::time_point sent) noexcept;
  void publish_turn(driven_index of) noexcept;
  void settle_lease(driven_index of) noexcept;
  void void_commands() noexcept;

  std::array<place, driven_topics_max> places_{};
  std::uint32_t count_ = 0;
  std::uint64_t stop_number_ = 0; // as of the last void_commands(), likewise the next
  bool stop_in_use_ = false;
  rows<peer_index, row> rows_;
};

} // namespace rowe::service
