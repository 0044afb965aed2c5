// SPDX-License-Identifier: Apache-2.0
#include "service/stop/thread_stops.hpp"

#include <string_view>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/stop/stop_gate.hpp"

namespace rowe::service {

// The rules must store a thread's whole source.
static_assert(stop_source_bytes_max <= stop_rules::source_bytes_max);

// A stop may be seen before its source and reason. These come with a second call then.
void thread_stops::carry_out_stop() noexcept {
  const bool with_reason = std::exchange(stops_done_, asked_.stops) != asked_.stops;
  const std::string_view source = with_reason ? asked_.source.view() : std::string_view{};
  stop_switch_.request(source.empty() ? "this process" : source, key_of_this_process);
  stop_switch_.show(with_reason ? asked_.reason.view() : std::string_view{}, {}); // before anything else
  if (stops_done_ == answered_.stops) return;                                     // nobody waits
  stop_number_ = stop_switch_.rules().number();
  waited_for_until_ = state_.cycle.now + state_.options.stop.observe_timeout;
  waits_since_ = state_.cycle.now;
}

void thread_stops::answer_if_acknowledged() noexcept {
  const stop_rules& rules = stop_switch_.rules();
  // If loops may move again, they have acknowledged just now: a reset needs that.
  const rt::time_point observed = rules.running() ? state_.cycle.now : rules.observed();
  if (observed == rt::never && state_.cycle.now < waited_for_until_) return;
  waited_for_until_ = {};
  if (observed == rt::never) return;
  answered_.stops = stops_done_;
  answered_.stop_number = stop_number_;
  answered_.acknowledged = observed;
  write_answers();
}

// Waits for what must come before the reset: stops of this process that were asked for earlier, the loops'
// acknowledgments, and a tick that is newer than the stop. If a request to stop comes meanwhile, also a
// repeat, the reset is refused, because whoever resets did not know of it. When the endpoint closes, the
// loops stay stopped.
void thread_stops::carry_out_reset() noexcept {
  if (state_.cycle.closing) return answer_reset(errc::closed);
  // Signed, because the count wraps around.
  const auto later = static_cast<std::int32_t>(state_.shared.stops.taken() - asked_.count_before_reset);
  if (later < 0) return;
  stop_rules& rules = stop_switch_.rules();
  if (std::exchange(reset_, asked_.resets) != asked_.resets) {
    reset_number_ = asked_.number != 0 ? asked_.number : rules.number();
    reset_requests_ = stop_switch_.requests();
    waits_since_ = state_.cycle.now;
  }
  if (rules.running()) return answer_reset({});
  const bool outdated = later > 0 || stop_switch_.requests() != reset_requests_;
  if (outdated && !ROWE_MUTANT(thread_reset)) return refuse_reset();
  if (state_.cycle.now >= asked_.until) return answer_reset(errc::timed_out);
  const auto number = static_cast<std::int64_t>(reset_number_);
  switch (
      rules.reset(number, static_cast<std::int64_t>(rules.tick(state_.cycle.now)), true, state_.cycle.now)) {
  case stop_rules::refusal::none: return answer_reset({});
  case stop_rules::refusal::loops:
  case stop_rules::refusal::tick: return;
  default: return refuse_reset();
  }
}

void thread_stops::refuse_reset() noexcept {
  stop_switch_.count_refusal();
  answer_reset(errc::refused);
}

// The permit and the event come before the answer.
void thread_stops::answer_reset(const status& outcome) noexcept {
  stop_switch_.show();
  answered_.resets = asked_.resets;
  answered_.reset_number = stop_switch_.rules().number();
  answered_.reset_outcome = outcome;
  write_answers();
}

void thread_stops::write_answers() noexcept {
  state_.shared.stops.write_answers(answered_);
  state_.submissions.notify_room();
}

} // namespace rowe::service
