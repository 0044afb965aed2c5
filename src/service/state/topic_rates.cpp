// SPDX-License-Identifier: Apache-2.0
#include "service/state/topic_rates.hpp"

namespace rowe::service {

void topic_rates::begin_for(topic_id topic) noexcept {
  if (topic != statistics_topic_ || state_.due.armed(timer::statistics)) return;
  end_period();
  state_.due.arm(timer::statistics, state_.cycle.now + state_.options.stats_period);
}

void topic_rates::end_period() noexcept {
  period_began_ = state_.cycle.now;
  for (const topic_id i : state_.topics.topic_ids()) {
    topic& t = state_.topics.at(i);
    t.messages_before = t.messages;
    t.gap_marked[0] = std::max(t.gap_marked[0], t.gap_max);
    t.gap_max = rt::duration{0};
  }
}

void topic_rates::mark() noexcept {
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

} // namespace rowe::service
