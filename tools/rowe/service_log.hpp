// SPDX-License-Identifier: Apache-2.0
// The events of an endpoint as lines of a log, for `rowe serve`. What repeats is folded (event_folder.hpp).
#pragma once
#include <array>
#include <cstdint>

#include <rowe/endpoint.hpp>
#include <rowe/rt/clock.hpp>

#include "console.hpp"
#include "event_folder.hpp"

namespace rowe::tools {

class service_log {
 public:
  explicit service_log(const console& to);
  service_log(const service_log&) = delete;
  service_log& operator=(const service_log&) = delete;

  // Writes what has happened since the last call. To be called some times a second.
  void report(endpoint& of, rt::time_point now);
  // Writes what was held back, and how many events got no line in all.
  void finish();

 private:
  event_folder& folder_of(event::kind what) noexcept;
  void write(const event& happened, std::uint64_t more);
  void write_rest(std::uint64_t left_out);

  const console& to_;
  std::uint64_t left_out_ = 0;
  event_folder strangers_, stops_, own_;
};

} // namespace rowe::tools
