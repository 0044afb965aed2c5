// SPDX-License-Identifier: Apache-2.0
// The topic /rowe/stats: published periodically while somebody listens. Service thread only; nothing
// waits or allocates.
#pragma once
#include "service/reports/statistics_report.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/topic_rates.hpp"

namespace rowe::service {

struct statistics_feed_needs {
  core_state& state_;
  topic_rates& topic_rates_;
  broker& broker_;
  statistics_report& statistics_report_;
};

class statistics_feed : statistics_feed_needs {
 public:
  explicit statistics_feed(const statistics_feed_needs& parts) noexcept : statistics_feed_needs{parts} {}

  // Its timer is due. Without listeners it is armed again by the next subscription.
  void publish() noexcept {
    const topic_id topic = topic_rates_.statistics_topic();
    if (!state_.topics.at(topic).has_audience()) return;
    state_.due.arm(timer::statistics, state_.cycle.now + state_.options.stats_period);
    if (state_.cycle.now <= topic_rates_.period_began()) return;
    broker_.publish(topic, state_.cycle.now, rt::never, {},
                    [&](json::writer& into) { statistics_report_.write_for_topic(into); });
    topic_rates_.end_period();
  }

 private:
};

} // namespace rowe::service
