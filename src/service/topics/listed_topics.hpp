// SPDX-License-Identifier: Apache-2.0
// Which topics are listed for whoever asks. Service thread only.
#pragma once
#include <cstdint>

#include "service/state/topic_table.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {

class listed_topics {
 public:
  listed_topics(const topic_table& topics, const stop_rules& stop) noexcept
      : topics_{topics}, unused_{stop.in_use() ? topic_id{} : topics.find(wire::stop_state_name)} {}

  bool operator()(topic_id topic) const noexcept {
    const std::uint32_t holders = topics_.at(topic).holders;
    return topic == unused_ ? holders > 1 : holders != 0;
  }

 private:
  const topic_table& topics_;
  // The topic of the stop's state where there is no stop: listed only if somebody subscribes.
  const topic_id unused_;
};

} // namespace rowe::service
