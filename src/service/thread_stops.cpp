// SPDX-License-Identifier: Apache-2.0
#include "service/thread_stops.hpp"

#include <string_view>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/stop_gate.hpp"

namespace rowe::service {

// Where the words are still on their way, they come with another one.
void thread_stops::carry_out_stop() noexcept {
  const bool with_words = std::exchange(stops_done_, asked_.stops) != asked_.stops;
  wordless_ = !with_words;
  const std::string_view source = with_words ? asked_.source.view() : std::string_view{};
  switch_.request(source.empty() ? "this process" : source, stop_key_of_this_process);
  switch_.show(with_words ? asked_.reason.view() : std::string_view{}); // before anything else
  if (stops_done_ == answered_.stops) return;                           // nobody waits
  stop_number_ = switch_.rules().number();
  waited_for_until_ = cycle_.now + observe_timeout_;
  waits_since_ = cycle_.now;
}

void thread_stops::tell_if_acknowledged() noexcept {
  const stop_rules& rules = switch_.rules();
  // Where they may move again they have acknowledged, just now: no reset comes before that.
  const rt::time_point observed = rules.running() ? cycle_.now : rules.observed();
  if (observed == rt::never && cycle_.now < waited_for_until_) return;
  waited_for_until_ = {};
  if (observed == rt::never) return;
  answered_.stops = stops_done_;
  answered_.stop_number = stop_number_;
  answered_.acknowledged = observed;
  tell();
}

// What may yet come, the loops' answers and a tick that is newer than the stop, is waited for. A request to
// stop that comes meanwhile is newer than the reset, which ends nothing then, also where it is a repeat.
void thread_stops::carry_out_reset() noexcept {
  stop_rules& rules = switch_.rules();
  if (std::exchange(reset_, asked_.resets) != asked_.resets) {
    reset_number_ = asked_.number != 0 ? asked_.number : rules.number();
    // A stop that came with it, and says nothing yet, may have been asked for later.
    reset_requests_ = switch_.requests() - (wordless_ ? 1 : 0);
    waits_since_ = cycle_.now;
  }
  if (rules.running()) return answer_reset({});
  if (cycle_.now >= asked_.until) return answer_reset(errc::timed_out);
  const bool outdated = asked_.stops != asked_.stops_before_reset || switch_.requests() != reset_requests_;
  if (outdated && !ROWE_MUTANT(thread_reset)) {
    switch_.count_refusal();
    return answer_reset(errc::refused);
  }
  const auto number = static_cast<std::int64_t>(reset_number_);
  switch (rules.reset(number, static_cast<std::int64_t>(rules.tick(cycle_.now)), true, cycle_.now)) {
  case stop_rules::refusal::none: return answer_reset({});
  case stop_rules::refusal::loops:
  case stop_rules::refusal::tick: return;
  default: switch_.count_refusal(); return answer_reset(errc::refused);
  }
}

// What follows from it comes first: the permit, the event.
void thread_stops::answer_reset(const status& outcome) noexcept {
  switch_.show();
  answered_.resets = asked_.resets;
  answered_.reset_number = switch_.rules().number();
  answered_.reset_outcome = outcome;
  tell();
}

void thread_stops::tell() noexcept {
  words_.tell(answered_);
  queue_.tell_room();
}

} // namespace rowe::service
