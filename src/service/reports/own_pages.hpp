// SPDX-License-Identifier: Apache-2.0
// What the endpoint answers over HTTP besides its page: /metrics for Prometheus, /healthz for whoever
// restarts it, and below /api/v1/ the statistics and the last values of topics for scripts. A transport takes
// what it is given before it asks for the next page, so one buffer is enough. Service thread only; nothing
// waits or allocates but for the hash of a token, as in access_control.
#pragma once
#include <algorithm>
#include <cstddef>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/service_limits.hpp"
#include "service/incoming/access_control.hpp"
#include "service/reports/metrics_report.hpp"
#include "service/reports/statistics_report.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/topic_pages.hpp"

namespace rowe::service {

struct own_pages_needs {
  core_state& state_;
  access_control& access_control_;
  metrics_report& metrics_report_;
  statistics_report& statistics_report_;
  topic_pages& topic_pages_;
};

class own_pages : own_pages_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<char>(buffer_bytes(bounds));
  }
  own_pages(rt::arena& memory, const own_pages_needs& parts) noexcept
      : own_pages_needs{parts}, buffer_{memory.carve<char>(buffer_bytes(state_.bounds()))} {}

  // Once a second, in a cycle that begins at `now`, so long after the one before. The service thread never
  // sleeps longer than idle_rest; a longer gap means that a cycle took long, or that the thread did not run.
  void end_period(rt::duration gap, rt::time_point now) noexcept {
    topic_pages_.end_unasked();
    if (gap <= cycle_gap_max) [[likely]]
      return;
    gap_ = gap;
    gap_ended_ = now;
  }

  // Whether somebody who presents this may have the page of that path.
  admit_answer may_read(const credentials& shown) noexcept;
  // The body is valid until the next call.
  http_answer answer(const http_request& request) noexcept;

 private:
  // For the longest answer, with a line feed behind a message.
  static std::size_t buffer_bytes(const limits& bounds) noexcept {
    return std::max<std::size_t>(metrics_report::bytes_max, bounds.message_bytes_max) + 1;
  }
  http_answer health() noexcept;
  http_answer statistics(const access::subject& who) noexcept;

  std::span<char> buffer_;
  rt::duration gap_{}; // the last one that was too long
  rt::time_point gap_ended_{};
};

} // namespace rowe::service
