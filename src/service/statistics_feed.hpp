// SPDX-License-Identifier: Apache-2.0
// The topic /rowe/stats: published periodically while somebody listens. Service thread only; nothing
// waits or allocates.
#pragma once
#include "service/broker.hpp"
#include "service/cycle_state.hpp"
#include "service/statistics_report.hpp"
#include "service/timers.hpp"
#include "service/topic_rates.hpp"
#include "service/topic_table.hpp"

namespace rowe::service {

class statistics_feed {
 public:
  struct needs {
    const cycle_state& cycle;
    timers& due;
    const topic_table& topics;
    topic_rates& rates;
    broker& values;
    statistics_report& report;
    rt::duration period;
  };
  explicit statistics_feed(const needs& parts) noexcept
      : cycle_{parts.cycle},
        timers_{parts.due},
        topics_{parts.topics},
        rates_{parts.rates},
        broker_{parts.values},
        report_{parts.report},
        period_{parts.period} {}

  // Its timer is due. Without listeners it is armed again by the next subscription.
  void publish() noexcept {
    const topic_id topic = rates_.statistics_topic();
    if (!topics_.at(topic).has_audience()) return;
    timers_.arm(timer::statistics, cycle_.now + period_);
    if (cycle_.now <= rates_.period_began()) return;
    broker_.publish(topic, cycle_.now, rt::never, {},
                    [&](json::writer& into) { report_.write_for_topic(into); });
    rates_.end_period();
  }

 private:
  const cycle_state& cycle_;
  timers& timers_;
  const topic_table& topics_;
  topic_rates& rates_;
  broker& broker_;
  statistics_report& report_;
  const rt::duration period_;
};

} // namespace rowe::service
