// SPDX-License-Identifier: Apache-2.0
// How long data takes to arrive over TCP on a bad link. The delays were recorded (tests/impair/record_trace;
// the files in tests/sim/traces say how), and are replayed here.
//
//   const sim::trace robot = sim::trace::read("robot_20ms");
//   on.net.link_of(peer.id()).to_peer = sim::delays{robot, seed};
//
// TCP delivers in order, so a lost segment delays all that is sent until it has been retransmitted. The trace
// has that, since messages were sent all the time while it was recorded. A message sent now takes as long as
// the message that was sent next in the trace, counted from where the trace began. It never arrives before
// what was sent earlier. So each of a row of messages as far apart as those of the trace has the delay of one
// of them; messages closer together share a delay. The seed chooses where in the trace to begin; after its
// end it begins again.
#pragma once
#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim_base.hpp"

namespace sim {

struct trace {
  duration period{};           // between two messages
  std::vector<duration> taken; // by each of them, in the order they were sent

  // tests/sim/traces/NAME.txt: after lines of comment, `period_ms N`, then delays in ms; 3x17 is 17 times 3.
  static trace read(const std::string& name) {
    std::ifstream file{std::string{ROWE_TRACES} + "/" + name + ".txt"};
    trace result;
    for (std::string line; std::getline(file, line);) {
      std::istringstream words{line.starts_with('#') ? std::string{} : line};
      if (line.starts_with("period_ms ")) {
        std::int64_t ms = 0;
        words.ignore(10) >> ms;
        result.period = ms * 1ms;
      }
      for (std::int64_t ms = 0; words >> ms;) {
        std::size_t times = 1;
        if (words.peek() == 'x') words.ignore() >> times;
        result.taken.insert(result.taken.end(), times, ms * 1ms);
      }
    }
    if (result.period <= 0s || result.taken.empty()) throw std::runtime_error{"no trace: " + name};
    return result;
  }
};

class delays {
 public:
  // `of` must outlive it.
  delays(const trace& of, std::uint64_t seed)
      : of_{&of}, first_{static_cast<std::size_t>(random_source{seed}.below(of.taken.size()))} {}

  // When a message that is sent at `now` arrives: not before what was sent earlier. `now` must not go back.
  time_point next(time_point now) {
    if (begin_ == time_point::min()) begin_ = now;
    // The message sent then or next.
    const auto periods = static_cast<std::size_t>((now - begin_ + of_->period - 1ns) / of_->period);
    last_ = std::max(last_, now + of_->taken[(first_ + periods) % of_->taken.size()]);
    return last_;
  }
  time_point operator()(time_point now) { return next(now); }

 private:
  const trace* of_;
  std::size_t first_; // the message of the trace with which it begins
  time_point begin_ = time_point::min();
  time_point last_{};
};

} // namespace sim
