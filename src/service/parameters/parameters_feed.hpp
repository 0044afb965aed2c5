// SPDX-License-Identifier: Apache-2.0
// Tells of parameters that have changed, but not oftener than each parameters_period: on the topic
// /rowe/parameters, with the values of all parameters of handles, and peers that asked for it. The topic is
// latched, and exists from the first parameter on. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/parameters/parameter_requests.hpp"
#include "service/parameters/parameters.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/broker.hpp"

namespace rowe::service {

struct parameters_feed_needs {
  core_state& state_;
  broker& broker_;
  parameters& parameters_;
  parameter_requests& parameter_requests_;
};

class parameters_feed : parameters_feed_needs {
 public:
  explicit parameters_feed(const parameters_feed_needs& parts) noexcept : parameters_feed_needs{parts} {}

  // Once a cycle: takes what handles did, and tells what has changed.
  void show() noexcept {
    parameters_.take();
    if (parameters_.changes() != told_) [[unlikely]]
      show_if_due();
  }
  // When show() is needed at the latest, if nothing changes until then.
  rt::time_point due() const noexcept { return next_; }
  topic_id topic() const noexcept { return topic_; }

 private:
  void show_if_due() noexcept;
  void publish() noexcept;

  topic_id topic_{};
  parameter_requests::round told_so_far_ = parameter_requests::round::all_know; // in the last cycle that told
  bool warned_ = false;                                                         // that the topic has no place
  rt::time_point earliest_{};                                                   // of the next time
  rt::time_point next_ = rt::never; // while something is to be told
  std::uint64_t published_ = 0;     // changes()
  std::uint64_t told_ = 0;          // likewise, when everyone was told
};

} // namespace rowe::service
