// SPDX-License-Identifier: Apache-2.0
// Decides which events become lines of a log, so that nobody can flood it. An event that is like one of the
// last second, by its kind, its peer without the port, and its words, is folded: what came of it is written
// as one line a second. Events that are like no other are written at once, so many a second; beyond that
// they are counted, and the count is written. In all, a folder writes at most lines_per_second_max.
//
// Strangers bring about most kinds of events. So each class of kinds has a folder of its own: refusals do not
// keep a stop or a warning out of the log.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include <rowe/event.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::tools {

class event_folder {
 public:
  static constexpr rt::duration period = std::chrono::seconds{1};
  static constexpr std::size_t rows_max = 10;            // of events that are folded at one time
  static constexpr std::uint32_t new_lines_max = 10;     // in a period, of events that are like no other
  static constexpr std::size_t lines_per_second_max = rows_max + new_lines_max + 1;

  // `more`: how many like it there were since the line of it before, besides this one.
  using line_writer = std::function<void(const event&, std::uint64_t more)>;
  // So many others were left out.
  using rest_writer = std::function<void(std::uint64_t)>;

  event_folder(line_writer line, rest_writer rest) : line_{std::move(line)}, rest_{std::move(rest)} {}

  void take(const event& happened, rt::time_point now);
  // Writes what is due. To be called now and then, also when nothing happens.
  void flush(rt::time_point now);
  // Writes all that was held back.
  void finish();

 private:
  struct row {
    std::string key; // empty: free
    event last;
    std::uint64_t held = 0; // since the last line
    rt::time_point due{};
  };

  void write(row& one);
  void end_period(rt::time_point now);

  line_writer line_;
  rest_writer rest_;
  std::array<row, rows_max> rows_;
  rt::time_point period_began_{};
  std::uint32_t new_lines_ = 0;
  std::uint64_t left_out_ = 0;
};

} // namespace rowe::tools
