// SPDX-License-Identifier: Apache-2.0
#include "service/parameters/parameters_feed.hpp"

#include <array>
#include <limits>
#include <utility>

#include "service/base/service_limits.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {

void parameters_feed::show_if_due() noexcept {
  using round = parameter_requests::round;
  const std::uint64_t changes = parameters_.changes();
  if (told_so_far_ != round::more_next) {
    next_ = earliest_;
    if (state_.cycle.now < earliest_) return;
    earliest_ = state_.cycle.now + parameters_period;
    if (published_ != changes) publish();
    published_ = changes;
  }
  told_so_far_ = parameter_requests_.tell_changes();
  next_ = told_so_far_ == round::more_next ? state_.cycle.now : earliest_;
  if (told_so_far_ != round::all_know || published_ != changes) return;
  told_ = changes;
  next_ = rt::never;
}

void parameters_feed::publish() noexcept {
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

} // namespace rowe::service
