// SPDX-License-Identifier: Apache-2.0
// Announces parameters that have changed, once in a parameters_period at most: on the topic /rowe/parameters,
// with the values of all parameters of handles, and to peers that asked for it. The topic is latched, and
// exists from the first parameter on. Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <utility>

#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/parameters/parameter_requests.hpp"
#include "service/parameters/parameters.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/own_names.hpp"

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

  // Once a cycle: takes what handles did, and announces what has changed.
  void show() noexcept {
    parameters_.take();
    if (parameters_.changes() != announced_) [[unlikely]]
      show_if_due();
  }
  // When show() is needed at the latest, if nothing changes until then.
  rt::time_point due() const noexcept { return next_; }
  topic_id topic() const noexcept { return topic_; }

 private:
  void show_if_due() noexcept {
    using round = parameter_requests::round;
    const std::uint64_t changes = parameters_.changes();
    if (announced_so_far_ != round::more_next) {
      next_ = earliest_;
      if (state_.cycle.now < earliest_) return;
      earliest_ = state_.cycle.now + parameters_period;
      if (published_ != changes) publish();
      published_ = changes;
    }
    announced_so_far_ = parameter_requests_.announce_changes();
    next_ = announced_so_far_ == round::more_next ? state_.cycle.now : earliest_;
    if (announced_so_far_ != round::all_know || published_ != changes) return;
    announced_ = changes;
    next_ = rt::never;
  }
  void publish() noexcept {
    if (state_.options.ours == side::client) return; // what is below /rowe/ is its server's
    if (!topic_) {
      topic_ = state_.topics.find_or_add(wire::parameters_name);
      if (!topic_) {
        if (!std::exchange(warned_, true))
          state_.events.report(event::kind::warning, {}, "the topic /rowe/parameters has no place",
                               "raise `limits::topics_max`");
        return;
      }
      describe_own(state_.topics, topic_);
      state_.topics.hold_as_own(topic_);
      state_.topics.at(topic_).keep = keep::newest;
    }
    const latch_owner own{latch_owner::kind::handle, std::numeric_limits<std::uint32_t>::max()};
    broker_.publish(topic_, state_.cycle.now, rt::never, own, [&](json::writer& into) {
      std::array<char, parameters::name_bytes_max> buffer;
      into.begin_object();
      into.begin_object("values");
      for (const parameter_id which : parameters_.ids()) {
        if (parameters_.is_read_only(which)) break; // behind those of handles
        if (!parameters_.in_use(which)) continue;
        into.key(parameters_.name(which, buffer));
        parameters_.write_value(which, into);
      }
      into.end_object();
      into.end_object();
    });
  }

  topic_id topic_{};
  parameter_requests::round announced_so_far_ =
      parameter_requests::round::all_know; // in the last cycle that announced
  bool warned_ = false;                    // that the topic has no place
  rt::time_point earliest_{};              // of the next time
  rt::time_point next_ = rt::never;        // while something is to be announced
  std::uint64_t published_ = 0;            // changes()
  std::uint64_t announced_ = 0;            // likewise, when everyone had all
};

} // namespace rowe::service
