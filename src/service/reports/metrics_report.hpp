// SPDX-License-Identifier: Apache-2.0
// What the endpoint counts, as Prometheus reads it (text format 0.0.4): each counter of counters.hpp, and a
// few gauges. Topics and peers have no metrics of their own, because peers make up their names: the service
// /rowe/stats has those. So the size has a bound, which is known when this is compiled.
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>

#include <rowe/rt/clock.hpp>

#include "service/reports/statistics_report.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"

namespace rowe::service {

struct metrics_report_needs {
  const core_state& state_;
  const stop_rules& stop_rules_;
  const statistics_report& statistics_report_;
};

class metrics_report : metrics_report_needs {
 public:
  // Bytes that always suffice for write(); asserted in the .cpp.
  static constexpr std::size_t bytes_max = std::size_t{15} << 10;
  static constexpr std::string_view content_type = "text/plain; version=0.0.4; charset=utf-8";

  explicit metrics_report(const metrics_report_needs& parts) noexcept
      : metrics_report_needs{parts}, opened_at_{state_.cycle.now} {}

  std::string_view write(std::span<char, bytes_max> buffer) const noexcept;

 private:
  rt::time_point opened_at_;
};

} // namespace rowe::service
