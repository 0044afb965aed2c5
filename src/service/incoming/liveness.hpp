// SPDX-License-Identifier: Apache-2.0
// Whether peers are alive and read. A silent peer is pinged. A peer is closed if it stays silent, does not
// answer pings, or does not finish a message that it began. Each peer is checked every half a second, and
// gets a report then if messages for it were dropped. Service thread only; nothing waits or allocates.
#pragma once
#include <algorithm>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/timer_wheel.hpp>

#include "service/base/service_limits.hpp"
#include "service/incoming/fragment_ingress.hpp"
#include "service/incoming/ingress.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct liveness_needs {
  core_state& state_;
  const outbox& outbox_;
  sender& sender_;
  refusals& refusals_;
  const ingress& ingress_;
  fragment_ingress& fragment_ingress_;
};

class liveness : liveness_needs {
 public:
  explicit liveness(const liveness_needs& parts) noexcept : liveness_needs{parts} {}

  // A peer has connected, and is checked from now on.
  void open(peer_index peer) noexcept { check_later(peer); }
  // Its timer is due.
  void check(peer_index peer) noexcept {
    connection& c = state_.peers[peer];
    if (!c.open()) return;
    check_later(peer);
    refusals_.report_missed(c);
    if (c.protocol->can.losses) report_losses(c);
    if (c.unheard) ++state_.cycle.places_freed; // a receiver may have become absent meanwhile
    const rt::time_point began = ingress_.unfinished_since(peer);
    if (began != rt::never && state_.cycle.waited_since(began) > state_.options.message_time_max) {
      state_.counts.add(counter::unfinished_messages);
      return state_.peers.close_later(c, "a message was not finished in time");
    }
    fragment_ingress_.check_time(c);
    if (!c.protocol->can.control_frames) return; // it answers no pings
    c.unheard ? check_unread(c) : check_silent(c);
  }
  // Once a second. Peers are looked at twice a second, so where some are connected a cycle that came much
  // later than the one before shows that this process did not run: a debugger, SIGSTOP, a suspended machine.
  // That time does not count against peers.
  void note_gap(rt::duration since_last_cycle) noexcept {
    if (since_last_cycle <= pause_min || state_.peers.count() == 0 || ROWE_MUTANT(pause)) return;
    state_.cycle.awake_since = state_.cycle.now;
    state_.counts.add(counter::pauses);
  }

 private:
  void check_later(peer_index peer) noexcept {
    const rt::duration when = state_.cycle.now.time_since_epoch() + liveness_period;
    state_.due.arm(peer, rt::time_point{when / liveness_step * liveness_step});
  }

  // Always in the same words, because its programs keep a list of what is reported, by the words. Not while
  // it has other answers to read.
  void report_losses(connection& c) noexcept {
    const peer_queues& its = outbox_.of({c.id.index});
    if (its.dropped == c.losses_reported || !its.replies.empty() || state_.cycle.now < c.losses_next) return;
    c.losses_reported = its.dropped;
    c.losses_next = state_.cycle.now + losses_period;
    refusals_.send_status(c, {}, losses_diagnostic, wire::severity::warning);
  }

  // We do not read it, so its silence means nothing. But it must know that we are alive.
  void check_unread(connection& c) noexcept {
    if (state_.cycle.now - c.heard_at <= state_.options.ping_period) return;
    c.heard_at = state_.cycle.now;
    sender_.send_control({c.id.index}, wire::opcode::pong, {});
  }
  void check_silent(connection& c) noexcept {
    const peer_index peer{c.id.index};
    const rt::duration silence = state_.cycle.waited_since(c.heard_at);
    if (silence > state_.options.silence_max) {
      // It does not read: it answers no ping, and messages wait for it.
      const bool unread = sender_.urgent().unresponsive(peer) && outbox_.of(peer).out_of_credit;
      state_.counts.add(unread ? counter::stalled_peers : counter::silent_peers);
      return state_.peers.close_later(c,
                                      unread ? "the peer does not read" : "nothing was heard for too long");
    }
    // A peer that goes on sending is not silent, but it may have stopped reading.
    const rt::time_point waits_since = std::max(sender_.urgent().waits_for_pong_since(peer), c.unheard_until);
    if (state_.cycle.waited_since(waits_since) > silences_unanswered_max * state_.options.silence_max) {
      state_.counts.add(counter::stalled_peers);
      return state_.peers.close_later(c, "the peer does not answer pings");
    }
    if (silence > state_.options.ping_period) sender_.urgent().request_ping(peer);
    sender_.urgent().check_responsive(peer);
  }
};

} // namespace rowe::service
