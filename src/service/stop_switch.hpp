// SPDX-License-Identifier: Apache-2.0
// The rules of the stop with what follows from them at once: the permit of the loops, before anything else,
// and the event. Service thread only; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include <rowe/detail/stop_permit.hpp>

#include "service/counters.hpp"
#include "service/cycle_state.hpp"
#include "service/event_log.hpp"
#include "service/stop_rules.hpp"

namespace rowe::service {

class stop_switch {
 public:
  stop_switch(const cycle_state& cycle, counters& counts, event_log& events, stop_rules& rules,
              detail::permit_word<>& permit) noexcept
      : cycle_{cycle}, counts_{counts}, events_{events}, rules_{rules}, permit_{permit} {}

  const stop_rules& rules() const noexcept { return rules_; }
  stop_rules& rules() noexcept { return rules_; } // show() afterwards

  // Looks at loops, guards and the clock.
  void turn() noexcept { rules_.turn(cycle_.now); }
  // Somebody asks for a stop.
  void request(std::string_view source, std::uint64_t key) noexcept {
    counts_.add(counter::stops);
    ++requests_;
    rules_.request(source, key, cycle_.now);
  }
  // How many requests there were, repeats included.
  std::uint64_t requests() const noexcept { return requests_; }
  // What the rules say now: to the loops, and to the log where it has changed.
  void show(std::string_view reason = {}) noexcept {
    rules_.write_permit(permit_);
    if (rules_.running() != reported_running_) report(reason);
  }
  // To the loops alone: a loop or a peer has come or gone, and the next show() tells the log.
  void write_permit() noexcept { rules_.write_permit(permit_); }
  void count_refusal() noexcept { counts_.add(counter::stop_refusals); }

 private:
  void report(std::string_view reason) noexcept {
    reported_running_ = rules_.running();
    std::array<char, event_log::text_bytes_max> text;
    auto put = [at = std::size_t{0}, &text](std::string_view piece) mutable {
      at += piece.copy(text.data() + at, std::min(piece.size(), text.size() - at));
      return std::string_view{text.data(), at};
    };
    (void)put(rules_.running() ? "reset: loops may move" : "stopped: ");
    if (!rules_.running()) (void)put(rules_.cause_name());
    if (!reason.empty()) (void)put(", ");
    events_.report(event::kind::stop, rules_.source(), put(reason));
  }

  const cycle_state& cycle_;
  counters& counts_;
  event_log& events_;
  stop_rules& rules_;
  detail::permit_word<>& permit_;
  std::uint64_t requests_ = 0;
  bool reported_running_ = false; // as of the last event
};

} // namespace rowe::service
