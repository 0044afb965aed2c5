// SPDX-License-Identifier: Apache-2.0
// The topic /rowe/control/state: who drives, and a tick for those who want to. It is published at once when
// that changes, and otherwise periodically. There is no such topic until a handle has a lease. Service thread
// only; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <limits>
#include <utility>

#include <rowe/rt/clock.hpp>

#include "service/control/command_gate.hpp"
#include "service/control/control_service.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/own_types.hpp"

namespace rowe::service {

struct control_feed_needs {
  core_state& state_;
  broker& broker_;
  command_gate& command_gate_;
  const control_service& control_service_;
};

class control_feed : control_feed_needs {
 public:
  explicit control_feed(const control_feed_needs& parts) noexcept : control_feed_needs{parts} {}

  // At the end of each cycle.
  void show() noexcept {
    if (command_gate_.any() || (topic_ && shown_ != command_gate_.version())) show_if_due();
  }
  topic_id topic() const noexcept { return topic_; } // none: there was no lease yet

 private:
  void show_if_due() noexcept {
    command_gate_.update();
    if (state_.options.ours == side::server) publish(); // what is below /rowe/ is a client's server's
    state_.due.arm(timer::control, std::min(due_, command_gate_.next_update())); // it wakes this thread
  }
  void publish() noexcept {
    const bool changed = shown_ != command_gate_.version();
    if (!changed && state_.cycle.now < due_) return;
    due_ = state_.cycle.now + (driven() ? control_period_driven : control_period);
    shown_ = command_gate_.version();
    if (!topic_) find_topic();
    if (!topic_ || (!changed && !state_.topics.at(topic_).has_audience())) return;
    const latch_owner own{latch_owner::kind::handle, std::numeric_limits<std::uint32_t>::max()};
    broker_.publish(topic_, state_.cycle.now, rt::never, own,
                    [&](json::writer& into) { control_service_.write_state(into); });
  }
  bool driven() const noexcept {
    return std::ranges::any_of(command_gate_.places(), [](const auto& one) { return one.rules.driven(); });
  }
  void find_topic() noexcept {
    topic_ = state_.topics.find_or_add(wire::control_state_name);
    if (!topic_) {
      if (!std::exchange(warned_, true))
        state_.events.report(event::kind::warning, {}, "the topic /rowe/control/state has no place",
                             "raise `limits::topics_max`");
      return;
    }
    describe_own(state_.topics, topic_);
    state_.topics.hold_as_own(topic_);
    state_.topics.at(topic_).keep = keep::newest;
  }

  topic_id topic_{};
  std::uint64_t shown_ = 0;
  rt::time_point due_ = rt::never; // in a client it stays so
  bool warned_ = false;            // that the topic has no place
};

} // namespace rowe::service
