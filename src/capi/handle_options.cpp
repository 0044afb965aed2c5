// SPDX-License-Identifier: Apache-2.0
#include "capi/handle_options.hpp"

#include <chrono>

namespace rowe::capi {
namespace {

result<priority> priority_of(int of) noexcept {
  switch (of) {
  case rowe_priority_normal: return priority::normal;
  case rowe_priority_urgent: return priority::urgent;
  case rowe_priority_bulk: return priority::bulk;
  default: return error{errc::bad_argument, of, rowe_priority_bulk};
  }
}

} // namespace

result<lane_options> options_of(const rowe_lane_options& given) {
  const auto urgency = priority_of(given.priority);
  if (!urgency) return urgency.error();
  lane_options options;
  options.depth = or_default(given.depth, options.depth);
  options.inbox_depth = or_default(given.inbox_depth, options.inbox_depth);
  options.calls = or_default(given.calls, options.calls);
  options.text_bytes_max = or_default(given.text_bytes_max, options.text_bytes_max);
  options.priority = *urgency;
  options.receive = !given.only_sends;
  return options;
}

result<topic_options> options_of(const rowe_topic_options& given) {
  const auto urgency = priority_of(given.priority);
  if (!urgency) return urgency.error();
  topic_options options;
  if (given.ttl_ms != 0) options.ttl = duration_of(given.ttl_ms);
  if (given.newest) options.keep = keep::newest;
  options.depth = or_default(given.depth, options.depth);
  options.priority = *urgency;
  options.latched = given.latched;
  options.shared = given.shared;
  if (given.fill_missing != 0) options.fill_missing = given.fill_missing > 0;
  options.period = time_of_option<std::chrono::microseconds>(given.period_us);
  options.lease = time_of_option<std::chrono::milliseconds>(given.lease_ms);
  if (given.type != nullptr) options.type = given.type;
  options.text_bytes_max = or_default(given.text_bytes_max, options.text_bytes_max);
  return options;
}

result<latch_options> options_of(const rowe_latch_options& given) {
  latch_options options;
  if (given.name != nullptr) options.name = given.name;
  if (given.loop_timeout_ms != 0)
    options.loop_timeout = time_of_option<std::chrono::milliseconds>(given.loop_timeout_ms);
  return options;
}

result<service_options> options_of(const rowe_service_options& given) {
  service_options options;
  options.depth = given.depth;
  if (given.type != nullptr) options.type = given.type;
  options.text_bytes_max = or_default(given.text_bytes_max, options.text_bytes_max);
  options.replaces_own = given.replaces_own;
  return options;
}

} // namespace rowe::capi
