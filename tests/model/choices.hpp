// SPDX-License-Identifier: Apache-2.0
// A run of a scenario is decided by a row of small choices: which thread goes on, which store a load returns,
// where in the modification order a store lands. This file makes them: all rows, depth first, by replaying
// the row of the last run with its last undecided choice raised by one; or random rows from a seed; or one
// given row again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace rowe::model {

class choices {
 public:
  using row = std::vector<std::size_t>;

  // Every row, depth first.
  choices() = default;
  // Random rows, the same ones for the same seed.
  explicit choices(std::uint64_t seed) : mode_{mode::random}, generator_{seed} {}
  // The one row given; choices beyond its end are 0.
  explicit choices(const row& given) : mode_{mode::replay} {
    for (const std::size_t choice : given) row_.push_back({choice, 0});
  }

  // One of `count` ways to go on, 0 being the plainest: no preemption, the newest value, the end of the
  // modification order. A single way is no choice and leaves no mark.
  std::size_t pick(std::size_t count) {
    if (count == 1) return 0;
    if (depth_ == row_.size()) row_.push_back({fresh(count), count});
    entry& e = row_[depth_++];
    if (mode_ == mode::replay) e.count = count;
    if (e.count != count || e.taken >= count) diverged_ = true;
    return e.taken < count ? e.taken : 0;
  }

  // Prepares the next run; false when every row has been taken. Random rows never end.
  bool next_run() {
    depth_ = 0;
    if (mode_ == mode::replay) return false;
    if (mode_ == mode::random) {
      row_.clear();
      return true;
    }
    while (!row_.empty() && row_.back().taken + 1 == row_.back().count) row_.pop_back();
    if (row_.empty()) return false;
    ++row_.back().taken;
    return true;
  }

  // At the end of a run: it did not follow the row it was to replay, so it depends on something other than
  // its choices.
  bool diverged() const noexcept { return diverged_ || (mode_ == mode::exhaustive && depth_ != row_.size()); }

  // What the present run has chosen so far.
  row taken() const {
    row r;
    for (std::size_t i = 0; i != depth_; ++i) r.push_back(row_[i].taken);
    return r;
  }

 private:
  enum class mode : std::uint8_t { exhaustive, random, replay };
  struct entry {
    std::size_t taken;
    std::size_t count;
  };

  // Half of the random picks are the plain way: a uniform pick would preempt at nearly every step, and the
  // defects that are hard to find need long undisturbed stretches beside one odd event.
  std::size_t fresh(std::size_t count) {
    if (mode_ != mode::random || generator_() % 2 == 0) return 0;
    return generator_() % count;
  }

  mode mode_ = mode::exhaustive;
  bool diverged_ = false;
  std::size_t depth_ = 0;
  std::vector<entry> row_;
  std::mt19937_64 generator_;
};

inline std::string text_of(const choices::row& row) {
  std::string text = "{";
  for (const std::size_t choice : row) {
    if (text.size() > 1) text += ", ";
    text += std::to_string(choice);
  }
  return text + "}";
}

} // namespace rowe::model
