// SPDX-License-Identifier: Apache-2.0
// How findings are written: lines for people, wrapped to a terminal's width, or JSON for programs.
#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "check.hpp"

namespace rowe::tools::fitness {

struct report_options {
  std::size_t columns = 0; // 0: nothing is wrapped
  bool json = false;
  bool commands = false; // what would change it, in letters
  bool reasons = false;  // also of what is ok or for information
  bool only_bad = false; // leaves out what neither fails nor warns; not in JSON
};

class report {
 public:
  explicit report(const report_options& how) : how_{how} {}

  // What is examined: the kernel and the cores.
  static std::string heading(const machine& on);

  // Counts a finding and writes it, line breaks and all.
  std::string text_of(const group& in, const check& about, const finding& found);

  std::size_t count(level of) const { return counts_[static_cast<std::size_t>(of)]; }

  // How many there were of each kind, and what follows from it: two lines without their ends.
  std::string summary() const;
  std::string_view verdict() const;

 private:
  std::string lines_of(const group& in, const check& about, const finding& found);

  report_options how_;
  std::array<std::size_t, 4> counts_{};
  std::size_t unseen_ = 0;
  std::size_t vital_unseen_ = 0;
  std::string_view group_; // whose heading was written last
};

} // namespace rowe::tools::fitness
