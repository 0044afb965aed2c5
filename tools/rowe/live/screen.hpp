// SPDX-License-Identifier: Apache-2.0
// The terminal as a whole, by ncurses: lines that are drawn anew, and keys. It is as it was before when the
// object is gone. What is written to stderr meanwhile appears then. Main thread.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "robot_view.hpp"

struct screen; // of ncurses: SCREEN

namespace rowe::tools {

class screen {
 public:
  // Whether stdin and stdout are a terminal.
  static bool is_possible() noexcept;

  screen();
  screen(const screen&) = delete;
  screen& operator=(const screen&) = delete;
  ~screen();

  // False: ncurses does not know the terminal that $TERM names. The rest may not be called then.
  explicit operator bool() const noexcept { return screen_ != nullptr; }

  std::size_t columns() const noexcept;
  std::size_t rows() const noexcept;
  // Lines from `first` on, and one at the bottom.
  void show(const std::vector<view_line>& lines, std::size_t first, std::string_view bottom);

  enum class key : unsigned char { none, quit, sort, pause, up, down, page_up, page_down, resized };
  // Waits for one until then, and not long after a signal.
  key read(rt::time_point until);

 private:
  ::screen* screen_ = nullptr; // of ncurses
  bool coloured_ = false;
};

} // namespace rowe::tools
