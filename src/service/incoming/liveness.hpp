// SPDX-License-Identifier: Apache-2.0
// Whether peers are alive and read. A silent peer is pinged. A peer is closed if it stays silent, does not
// answer pings, or does not finish a message that it began. Each peer is checked every half a second, and
// told then if messages for it were dropped. Service thread only; nothing waits or allocates.
#pragma once
#include <rowe/rt/clock.hpp>
#include <rowe/rt/timer_wheel.hpp>

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
  void check(peer_index peer) noexcept;
  // Once a second. Peers are looked at twice a second, so where some are connected a cycle that came much
  // later than the one before tells that this process did not run: a debugger, SIGSTOP, a suspended machine.
  // Nobody is judged by that time.
  void note_gap(rt::duration since_last_cycle) noexcept;

 private:
  void check_later(peer_index peer) noexcept;
  void tell_losses(connection& c) noexcept;
  void check_unread(connection& c) noexcept;
  void check_silent(connection& c) noexcept;
};

} // namespace rowe::service
