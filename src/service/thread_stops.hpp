// SPDX-License-Identifier: Apache-2.0
// What threads of this process that have no loop ask of the stop (local_stop.hpp), and what they are told.
// Service thread only; nothing waits or allocates; whoever sleeps is woken, which enters the kernel.
#pragma once
#include <cstdint>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "service/cycle_state.hpp"
#include "service/local_stop.hpp"
#include "service/stop_switch.hpp"
#include "service/submission_queue.hpp"

namespace rowe::service {

class thread_stops {
 public:
  struct needs {
    const cycle_state& cycle;
    stop_switch& main;
    local_stop<>& words;
    submission_queue& queue; // where they sleep
    rt::duration observe_timeout;
  };
  explicit thread_stops(const needs& parts) noexcept
      : cycle_{parts.cycle},
        switch_{parts.main},
        words_{parts.words},
        queue_{parts.queue},
        observe_timeout_{parts.observe_timeout} {}

  // Whether one has asked for a stop since the last look.
  bool look() noexcept {
    const bool asked = words_.take(); // before looking: then the words are there
    wordless_ = false;
    words_.look(asked_);
    return asked;
  }
  bool wants_reset() const noexcept { return asked_.resets != answered_.resets; }
  // Those who wait have been told what they are to know before either (tell_acknowledged).
  void carry_out_stop() noexcept;
  void carry_out_reset() noexcept;
  // Those who wait for the loops are told once they have acknowledged. When they have waited in vain they
  // know it.
  void tell_acknowledged() noexcept {
    if (waited_for_until_ != rt::time_point{}) tell_if_acknowledged();
  }

  bool waits() const noexcept { return waited_for_until_ != rt::time_point{} || wants_reset(); }
  rt::time_point waits_since() const noexcept { return waits_since_; } // the newest of them

 private:
  void tell_if_acknowledged() noexcept;
  void answer_reset(const status& outcome) noexcept;
  void tell() noexcept;

  const cycle_state& cycle_;
  stop_switch& switch_;
  local_stop<>& words_;
  submission_queue& queue_;
  const rt::duration observe_timeout_;
  local_stop_asked asked_;            // as of the last look,
  local_stop_answered answered_;      // and as they were told last
  std::uint64_t stops_done_ = 0;      // of those that were asked for,
  bool wordless_ = false;             // as of the last look: one whose words are on their way
  std::uint64_t stop_number_ = 0;     // as peers know the last of them,
  rt::time_point waited_for_until_{}; // for whose answer somebody waits so long; 0: nobody does
  std::uint64_t reset_ = 0;           // the one that is being carried out,
  std::uint64_t reset_number_ = 0;    // the stop that it is to end,
  std::uint64_t reset_requests_ = 0;  // and how many requests to stop there had been by then
  rt::time_point waits_since_{};
};

} // namespace rowe::service
