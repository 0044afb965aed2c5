// SPDX-License-Identifier: Apache-2.0
// Keys that are read one by one where stdin is a terminal. The terminal is as it was before when the object
// is gone, when a signal ends the program, and while the program is suspended.
#pragma once
#include <cstdint>
#include <string>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

enum class key : std::uint8_t { none, space, left, right, other };

class keys {
 public:
  // `wanted`: otherwise there are none, and the terminal is left alone.
  explicit keys(bool wanted);
  keys(const keys&) = delete;
  keys& operator=(const keys&) = delete;
  ~keys();

  // Whether keys can be read now: the program may be in the background.
  bool readable() const noexcept;

  // What was pressed: `letter` is it, of a printable one. Waits for it until then; not at all, and returns
  // none, where keys cannot be read. Main thread.
  key read(rt::time_point until, char& letter);

 private:
  // Takes a key out of pending_; none: there is no whole one.
  key take(char& letter);

  bool on_ = false;
  bool ended_ = false;
  std::string pending_;
};

} // namespace rowe::tools
