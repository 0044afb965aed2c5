// SPDX-License-Identifier: Apache-2.0
// Counts the messages of each topic and the gaps between them, over the periods of the topic /rowe/stats and
// of the service of that name. Service thread only; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <array>

#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct topic_rates_needs {
  core_state& state_;
  const topic_id statistics_topic_; // none in a client
};

class topic_rates : topic_rates_needs {
 public:
  explicit topic_rates(const topic_rates_needs& parts) noexcept
      : topic_rates_needs{parts}, marked_{state_.cycle.now, state_.cycle.now} {}

  // One more message of a topic.
  static void note(topic& on, rt::time_point published) noexcept {
    if (on.newest_at != rt::time_point{}) on.gap_max = std::max(on.gap_max, published - on.newest_at);
    on.newest_at = published;
    ++on.messages;
  }

  // Somebody subscribes to a topic. If it is the topic of the statistics, the first report covers the time
  // from now on.
  void begin_for(topic_id topic) noexcept {
    if (topic != statistics_topic_ || state_.due.armed(timer::statistics)) return;
    end_period();
    state_.due.arm(timer::statistics, state_.cycle.now + state_.options.stats_period);
  }
  // A report was made, or will be the first one: the next one covers the time from now on.
  void end_period() noexcept {
    period_began_ = state_.cycle.now;
    for (const topic_id i : state_.topics.topic_ids()) {
      topic& t = state_.topics.at(i);
      t.messages_before = t.messages;
      t.gap_marked[0] = std::max(t.gap_marked[0], t.gap_max);
      t.gap_max = rt::duration{0};
    }
  }
  rt::time_point period_began() const noexcept { return period_began_; }
  topic_id statistics_topic() const noexcept { return statistics_topic_; }

  // The service may be called at any time, whether or not somebody listens to the topic. Its rates cover the
  // last one to two seconds: a full period, and the current one. True if one has ended.
  bool mark_if_due() noexcept {
    if (state_.cycle.now - marked_[0] < rates_period) return false;
    mark();
    return true;
  }
  rt::time_point marks_began() const noexcept { return marked_[1]; }

 private:
  void mark() noexcept {
    marked_ = {state_.cycle.now, marked_[0]};
    const bool reported = statistics_topic_ && state_.topics.at(statistics_topic_).has_audience();
    for (const topic_id i : state_.topics.topic_ids()) {
      topic& t = state_.topics.at(i);
      if (t.holders == 0) continue; // it begins anew
      t.messages_marked = {t.messages, t.messages_marked[0]};
      t.gap_marked = {rt::duration{0}, std::max(t.gap_marked[0], t.gap_max)};
      if (!reported) t.gap_max = rt::duration{0}; // otherwise end_period() does
    }
  }

  rt::time_point period_began_{};
  // When the newest period of the service's rates began, and the one before.
  std::array<rt::time_point, 2> marked_;
};

} // namespace rowe::service
