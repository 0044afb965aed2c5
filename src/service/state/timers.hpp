// SPDX-License-Identifier: Apache-2.0
// The timer wheel. Each row that can have a deadline has a node, and each single timer has one. A row is
// armed by its number. A due timer comes back as its kind and number. Service thread only; nothing waits or
// allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/timer_wheel.hpp>

#include "service/base/ids.hpp"
#include "service/base/slot_pool.hpp"

namespace rowe::service {

enum class timer : std::uint8_t {
  slot,
  subscription,
  deadline, // of a subscription
  peer,
  call,
  statistics,
  reconnect,
  partial_frames,
  graph,
  clock,
  control,
  recording, // of long values
};

class timers {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<rt::timer_node>(first_nodes{bounds}.count);
  }
  timers(rt::arena& memory, const limits& bounds, rt::time_point start) noexcept
      : first_{bounds}, wheel_{memory.carve<rt::timer_node>(first_.count), start} {}

  // Arms a timer, or moves one that is armed already.
  void arm(slot_id which, rt::time_point when) noexcept { wheel_.insert(node_of(which), when); }
  void arm(subscription_id which, rt::time_point when) noexcept { wheel_.insert(node_of(which), when); }
  void arm(deadline_id which, rt::time_point when) noexcept { wheel_.insert(node_of(which), when); }
  void arm(peer_index which, rt::time_point when) noexcept { wheel_.insert(node_of(which), when); }
  void arm(call_index which, rt::time_point when) noexcept { wheel_.insert(node_of(which), when); }
  void arm(timer which, rt::time_point when) noexcept { wheel_.insert(node_of(which), when); }

  // Disarms a timer. Does nothing if it is not armed.
  void disarm(slot_id which) noexcept { wheel_.cancel(node_of(which)); }
  void disarm(subscription_id which) noexcept { wheel_.cancel(node_of(which)); }
  void disarm(deadline_id which) noexcept { wheel_.cancel(node_of(which)); }
  void disarm(peer_index which) noexcept { wheel_.cancel(node_of(which)); }
  void disarm(call_index which) noexcept { wheel_.cancel(node_of(which)); }
  void disarm(timer which) noexcept { wheel_.cancel(node_of(which)); }

  bool armed(subscription_id which) const noexcept { return wheel_.contains(node_of(which)); }
  bool armed(timer which) const noexcept { return wheel_.contains(node_of(which)); }

  struct due {
    timer what;
    std::uint32_t index; // of the row; 0 for a single timer
  };
  // Takes a due timer; it is not armed any more. Nothing: no timer is due.
  std::optional<due> take_due(rt::time_point now) noexcept {
    const std::uint32_t node = wheel_.expire(now);
    if (node == rt::timer_wheel::none) return std::nullopt;
    if (node >= first_.single) return due{static_cast<timer>(first_single + (node - first_.single)), 0};
    if (node >= first_.call) return due{timer::call, node - first_.call};
    if (node >= first_.peer) return due{timer::peer, node - first_.peer};
    if (node >= first_.deadline) return due{timer::deadline, node - first_.deadline};
    if (node >= first_.subscription) return due{timer::subscription, node - first_.subscription};
    return due{timer::slot, node};
  }
  rt::time_point next_wake() const noexcept { return wheel_.next_wake(); }

  bool check() const noexcept { return wheel_.check() == nullptr; }

 private:
  static constexpr std::uint32_t first_single = static_cast<std::uint32_t>(timer::statistics);
  static constexpr std::uint32_t singles = 1 + static_cast<std::uint32_t>(timer::recording) - first_single;

  // Where the nodes of each kind begin. A slot's node has its number.
  struct first_nodes {
    explicit first_nodes(const limits& bounds) noexcept
        : subscription{static_cast<std::uint32_t>(slot_pool::count(bounds))},
          deadline{subscription + bounds.subscriptions_max},
          peer{deadline + bounds.subscriptions_max},
          call{peer + bounds.connections_max},
          single{call + bounds.calls_max},
          count{single + singles} {}
    std::uint32_t subscription;
    std::uint32_t deadline;
    std::uint32_t peer;
    std::uint32_t call;
    std::uint32_t single;
    std::uint32_t count;
  };

  std::uint32_t node_of(slot_id which) const noexcept { return which.value; }
  std::uint32_t node_of(subscription_id which) const noexcept { return first_.subscription + which.value; }
  std::uint32_t node_of(deadline_id which) const noexcept { return first_.deadline + which.value; }
  std::uint32_t node_of(peer_index which) const noexcept { return first_.peer + which.value; }
  std::uint32_t node_of(call_index which) const noexcept { return first_.call + which.value; }
  std::uint32_t node_of(timer which) const noexcept {
    return first_.single + static_cast<std::uint32_t>(which) - first_single;
  }

  const first_nodes first_;
  rt::timer_wheel wheel_;
};

} // namespace rowe::service
