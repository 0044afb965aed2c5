// SPDX-License-Identifier: Apache-2.0
// What became of stops that were asked for, and the sentence that says so, which must not be read in two
// ways.
//
// A robot tells when it accepted the stop and when the last loop acknowledged, by its own clock. Where both
// lie between our asking and the answer, that clock is ours (clocks that count from the starts of two
// machines do not agree to a millisecond by chance), and the way there and the way back are known apart.
// Otherwise only the time it took inside is known.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/rt/clock.hpp>
#include <rowe/rt/histogram.hpp>

#include "../exit_code.hpp"

namespace rowe::tools {

// How one request ended.
struct stop_outcome {
  enum class end { acknowledged, accepted, timed_out, no_stop, lost, unreachable, failed };
  end how = end::failed;
  std::optional<std::int64_t> number{}; // of the stop
  rt::duration took{};
  std::optional<rt::duration> service{};      // from accepted to acknowledged; nothing: acknowledged before
  std::optional<rt::duration> send{}, home{}; // where the robot's clock is ours

  static stop_outcome of_answer(std::string_view answer, rt::time_point asked, rt::time_point answered);
  bool answered() const noexcept { return how <= end::accepted; }
};

// How it is told.
struct stop_story {
  std::string robot{}; // its name; empty: it is not known
  std::string url;
  rt::duration limit{}; // what the answer had, or the connection
  std::string more{};   // accepted: the loops that did not acknowledge; failed: why
};
std::string sentence_of(const stop_outcome& is, const stop_story& told);
std::string json_of(const stop_outcome& is, const stop_story& told); // a line

// What many come to.
class stop_tally {
 public:
  // `limit`: --max.
  void count(const stop_outcome& is, std::optional<rt::duration> limit);
  exit_code verdict() const noexcept;
  bool empty() const noexcept { return asked_ == 0; }

  std::string line(std::string_view robot) const;
  std::string json(std::string_view robot) const;
  // "3 of 200 took longer than 5.0 ms; the worst, number 57, 7.3 ms at ..."; empty: none did.
  std::string beyond() const;

 private:
  std::uint64_t of(stop_outcome::end how) const noexcept { return ends_[static_cast<std::size_t>(how)]; }

  std::uint64_t ends_[7] = {};
  std::uint64_t asked_ = 0;
  std::optional<rt::duration> limit_;
  std::uint64_t over_ = 0;
  std::uint64_t worst_ = 0;       // which one took longest, from 1
  std::string worst_at_;          // and when it had been answered
  rt::inline_histogram<7> times_; // of those that were answered
};

} // namespace rowe::tools
