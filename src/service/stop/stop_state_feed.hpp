// SPDX-License-Identifier: Apache-2.0
// Sends the state of the stop to peers and handles that subscribe to its topic, and to peers that take it as
// a message. They get it at once when it changes, and otherwise periodically: guards at every tick, others at
// every tenth. It needs no slot and no queue. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/broker.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

struct stop_state_feed_needs {
  core_state& state_;
  sender& sender_;
  broker& broker_;
  const stop_rules& stop_rules_;
  const topic_id topic_; // of the state
};

class stop_state_feed : stop_state_feed_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<rt::time_point>(bounds.connections_max);
  }
  stop_state_feed(rt::arena& memory, const stop_state_feed_needs& parts) noexcept;

  void open(peer_index peer) noexcept { shown_at_[peer] = {}; }

  // At the end of each cycle: sends the state to those who are due.
  void show() noexcept {
    if (stop_rules_.in_use()) show_if_due();
  }
  // When show() is needed at the latest.
  rt::time_point due() const noexcept { return stop_rules_.in_use() ? due_ : rt::never; }

 private:
  // The state as the topic's message. It is written when the first peer needs it.
  struct message {
    std::array<char, stop_answer_bytes_max> buffer;
    std::size_t bytes = 0; // 0: not written
    std::size_t body_at = 0;
    std::size_t body_bytes = 0;

    std::span<const char> whole() const noexcept { return {buffer.data(), bytes}; }
    std::span<const char> body() const noexcept { return whole().subspan(body_at, body_bytes); }
  };

  void show_if_due() noexcept;
  void show_subscribers(message& state, bool changed) noexcept;
  void show_takers_of_messages(bool changed) noexcept;
  void show_handles(message& state, bool changed) noexcept;
  void write(message& state) noexcept;
  void send(const subscription& to, const message& state) noexcept;

  rows<peer_index, rt::time_point> shown_at_;
  rt::time_point delivered_at_{}; // to handles of this process, and to who records
  rt::time_point due_ = rt::never;
  std::uint64_t version_shown_ = 0;
  std::uint32_t audience_seen_ = 0; // audience_changes of the topic, as of the last look,
  std::uint32_t opened_seen_ = 0;   // and how many peers had come
};

} // namespace rowe::service
