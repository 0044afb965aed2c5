// SPDX-License-Identifier: Apache-2.0
#include "screen.hpp"

#include <unistd.h>

#include <algorithm>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "../interrupt.hpp"
#include "../output.hpp"
#include "../text/colour.hpp"

#define NCURSES_NOMACROS 1
#include <curses.h>

namespace rowe::tools {
namespace {
constexpr short good_pair = 1;
constexpr short bad_pair = 2;
} // namespace

bool screen::is_possible() noexcept {
  const char* const kind = std::getenv("TERM");
  return ::isatty(STDIN_FILENO) == 1 && ::isatty(STDOUT_FILENO) == 1 && kind != nullptr &&
         std::string_view{kind} != "dumb";
}

screen::screen() {
  hold_stderr(true);
  (void)std::setlocale(LC_CTYPE, "");          // so that ncurses knows UTF-8
  screen_ = ::newterm(nullptr, stdout, stdin); // initscr() would end the program
  if (screen_ == nullptr) return;
  ::cbreak();
  ::noecho();
  ::keypad(::stdscr, TRUE);
  (void)::curs_set(0);
  coloured_ = colour::is_on() && ::has_colors() == TRUE && ::start_color() == OK;
  if (coloured_) {
    (void)::use_default_colors();
    (void)::init_pair(good_pair, COLOR_GREEN, -1);
    (void)::init_pair(bad_pair, COLOR_RED, -1);
  }
}

screen::~screen() {
  if (screen_ != nullptr) {
    ::endwin();
    ::delscreen(screen_);
  }
  hold_stderr(false);
}

std::size_t screen::columns() const noexcept {
  return static_cast<std::size_t>(std::max(::getmaxx(::stdscr), 1));
}
std::size_t screen::rows() const noexcept {
  return static_cast<std::size_t>(std::max(::getmaxy(::stdscr), 1));
}

void screen::show(const std::vector<view_line>& lines, std::size_t first, std::string_view bottom) {
  ::erase();
  const int width = static_cast<int>(columns());
  const auto draw = [&](int row, std::string_view text, attr_t looks) {
    ::attrset(static_cast<int>(looks));
    ::mvaddnstr(row, 0, std::string{text}.c_str(), std::min(static_cast<int>(text.size()), 4 * width));
  };
  const std::size_t room = rows() - 1;
  for (std::size_t i = first; i < lines.size() && i - first < room; ++i) {
    const line_look look = lines[i].look;
    const attr_t good = coloured_ ? static_cast<attr_t>(COLOR_PAIR(good_pair)) : A_NORMAL;
    const attr_t bad = coloured_ ? static_cast<attr_t>(COLOR_PAIR(bad_pair)) | A_BOLD : A_BOLD;
    draw(static_cast<int>(i - first), lines[i].text,
         look == line_look::heading ? A_BOLD
         : look == line_look::good  ? good
         : look == line_look::bad   ? bad
                                    : A_NORMAL);
  }
  draw(static_cast<int>(room), bottom.substr(0, columns() - 1), A_REVERSE);
  ::attrset(A_NORMAL);
  ::refresh();
}

screen::key screen::read(rt::time_point until) {
  const auto left =
      std::clamp<rt::duration>(until - rt::monotonic_clock::now(), rt::duration{0}, interrupt::slice);
  ::timeout(static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(left).count()));
  switch (::getch()) {
  case 'q':
  case 'Q': return key::quit;
  case 's': return key::sort;
  case 'p':
  case ' ': return key::pause;
  case KEY_UP:
  case 'k': return key::up;
  case KEY_DOWN:
  case 'j': return key::down;
  case KEY_PPAGE: return key::page_up;
  case KEY_NPAGE: return key::page_down;
  case KEY_RESIZE: return key::resized;
  default: return key::none;
  }
}

} // namespace rowe::tools
