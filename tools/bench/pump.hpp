// SPDX-License-Identifier: Apache-2.0
// The measuring loop, the same for all that is sent and comes back: sends what is due, takes what has come,
// waits for the earlier of the two. Runs on the measuring thread; clock and target are passed in, so that
// tests run it in no time.
//
// A message that cannot be sent at its time, because there is no room or because the thread was held up, is
// sent as soon as it can be, and measured from its intended time all the same. One that never comes back is
// recorded with the time that it was waited for, and counted as unfinished: leaving it out would make a
// system look the better the more it loses.
#pragma once
#include <algorithm>
#include <atomic>
#include <concepts>
#include <cstdint>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "recording.hpp"
#include "schedule.hpp"

namespace rowe::tools::bench {

enum class ending : std::uint8_t { well, failed, timed_out };

// How a message came to its end.
struct arrival {
  std::uint64_t number;
  rt::time_point at;
  ending how;
};

// What is measured. `send` hands message `number` over, or says false because there is no room yet. `take`
// calls its argument with each arrival there is. `wait` returns at the latest at the deadline, and should
// when something has come. `over`: nothing will come any more, whatever is sent.
template <class Target>
concept measurable = requires(Target target, std::uint64_t number, rt::time_point t, void (*sink)(arrival)) {
  { target.send(number, t) } -> std::same_as<bool>;
  target.take(sink);
  target.wait(t);
  { target.over() } -> std::convertible_to<bool>;
};

struct pump_counts {
  std::uint64_t intended = 0;   // messages that were due
  std::uint64_t finished = 0;   // came back well
  std::uint64_t failed = 0;     // came back as an error; recorded with the time this took
  std::uint64_t unfinished = 0; // timed out, or were not even sent; recorded with the time waited
};

inline constexpr rt::duration timeout_after_stop = std::chrono::milliseconds{200};
inline constexpr rt::duration wait_max = std::chrono::milliseconds{100}; // how late a stop is seen

// A mark for each message that has come to its end; taken and touched before the run.
using marks = std::vector<std::uint8_t>;

// Messages are numbered from `first` on, so that a late one of an earlier run is known for what it is.
// `timeout`: how long is waited for what is missing once the schedule is over. `stop` ends the schedule
// early. Never allocates.
template <class Clock, measurable Target>
pump_counts pump(schedule when, std::uint64_t first, Target& target, recording& into, marks& ended,
                 rt::duration timeout, const std::atomic<bool>& stop, Clock& clock) {
  pump_counts counts;
  std::uint64_t next = 0;
  std::uint64_t back = 0;
  const rt::time_point over_at = when.start() + static_cast<std::int64_t>(when.count()) * when.period();
  rt::time_point give_up = rt::deadline_after(over_at, timeout);
  bool stopping = false;
  const auto note = [&](const arrival& one) {
    const std::uint64_t index = one.number - first;
    if (one.number < first || index >= next || ended[index] != 0) return;
    ended[index] = 1;
    ++back;
    into.record(when.time_of(index), one.at);
    ++(one.how == ending::well     ? counts.finished
       : one.how == ending::failed ? counts.failed
                                   : counts.unfinished);
  };
  for (;;) {
    const rt::time_point now = clock.now();
    // relaxed: nothing but the flag itself is handed over
    if (!stopping && stop.load(std::memory_order_relaxed)) {
      stopping = true;
      when.cut(when.due_by(now));
      give_up = std::min(give_up, rt::deadline_after(now, timeout_after_stop));
    }
    target.take(note); // before sending: it makes room
    if ((next == when.count() && back == next) || target.over() || now >= give_up) break;
    if (when.time_of(next) <= now && target.send(first + next, now)) {
      ++next;
      continue; // another one may be due
    }
    const rt::time_point due = when.time_of(next);
    const rt::time_point try_again = now + when.period(); // there was no room
    target.wait(std::min({due > now ? due : try_again, give_up, now + wait_max}));
  }
  const rt::time_point end = clock.now();
  counts.intended = when.due_by(end);
  for (std::uint64_t index = 0; index < counts.intended; ++index) {
    if (ended[index] != 0) continue;
    into.record(when.time_of(index), end);
    ++counts.unfinished;
  }
  return counts;
}

} // namespace rowe::tools::bench
