// SPDX-License-Identifier: Apache-2.0
#include "service/topic_rates.hpp"

namespace rowe::service {

void topic_rates::begin_for(topic_id topic) noexcept {
  if (topic != statistics_topic_ || timers_.armed(timer::statistics)) return;
  end_period();
  timers_.arm(timer::statistics, cycle_.now + period_);
}

void topic_rates::end_period() noexcept {
  period_began_ = cycle_.now;
  for (const topic_id i : topics_.topic_ids()) {
    topic& t = topics_.at(i);
    t.messages_before = t.messages;
    t.gap_marked[0] = std::max(t.gap_marked[0], t.gap_max);
    t.gap_max = rt::duration{0};
  }
}

void topic_rates::mark() noexcept {
  marked_ = {cycle_.now, marked_[0]};
  const bool reported = statistics_topic_ && topics_.at(statistics_topic_).has_audience();
  for (const topic_id i : topics_.topic_ids()) {
    topic& t = topics_.at(i);
    if (t.holders == 0) continue; // it begins anew
    t.messages_marked = {t.messages, t.messages_marked[0]};
    t.gap_marked = {rt::duration{0}, std::max(t.gap_marked[0], t.gap_max)};
    if (!reported) t.gap_max = rt::duration{0}; // otherwise end_period() does
  }
}

} // namespace rowe::service
