// SPDX-License-Identifier: Apache-2.0
// Stops and resets by threads of this process that have no loop (local_stop.hpp), and their answers. Service
// thread only; nothing waits or allocates. A thread that sleeps is woken, which enters the kernel.
#pragma once
#include <cstdint>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "service/state/core_state.hpp"
#include "service/stop/stop_switch.hpp"
#include "service/threads/local_stop.hpp"

namespace rowe::service {

struct thread_stops_needs {
  core_state& state_;
  stop_switch& stop_switch_;
};

class thread_stops : thread_stops_needs {
 public:
  explicit thread_stops(const thread_stops_needs& parts) noexcept : thread_stops_needs{parts} {}

  // Whether a thread has asked for a stop since the last look.
  bool read_requests() noexcept {
    const bool asked = state_.shared.stops.take(); // first: then the source and the reason are there
    state_.shared.stops.read_requests(asked_);
    return asked;
  }
  bool wants_reset() const noexcept { return asked_.resets != answered_.resets; }
  // Call answer_acknowledged() before either: it raises the stop's number, and the loops acknowledge numbers.
  void carry_out_stop() noexcept;
  void carry_out_reset() noexcept;
  // Answers threads that wait for the loops, when all loops have acknowledged. A thread that waited in vain
  // needs no answer: its own deadline has come.
  void answer_acknowledged() noexcept {
    if (waited_for_until_ != rt::time_point{}) answer_if_acknowledged();
  }

  bool waits() const noexcept { return waited_for_until_ != rt::time_point{} || wants_reset(); }
  rt::time_point waits_since() const noexcept { return waits_since_; } // the newest of them

 private:
  void answer_if_acknowledged() noexcept;
  void refuse_reset() noexcept;
  void answer_reset(const status& outcome) noexcept;
  void write_answers() noexcept;

  local_stop_asked asked_;            // as of the last read_requests()
  local_stop_answered answered_;      // the last answers
  std::uint64_t stops_done_ = 0;      // how many requested stops were carried out
  std::uint64_t stop_number_ = 0;     // by which peers know the last of them
  rt::time_point waited_for_until_{}; // until when threads wait for the loops; 0: none does
  std::uint64_t reset_ = 0;           // the reset that is being carried out
  std::uint64_t reset_number_ = 0;    // the stop that it is to end
  std::uint64_t reset_requests_ = 0;  // how often a stop was asked for before it
  rt::time_point waits_since_{};
};

} // namespace rowe::service
