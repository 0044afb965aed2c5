// SPDX-License-Identifier: Apache-2.0
// What came on a topic within a stretch of time: how many messages, how regularly, how many bytes, and how
// old they were. Allocates; one thread.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <rowe/rt/clock.hpp>

namespace rowe::tools {

class topic_window {
 public:
  // Gaps and ages beyond are counted, and not remembered one by one: a minute at 10 kHz.
  static constexpr std::size_t remembered_max = 600'000;

  void add(rt::time_point arrived, std::size_t bytes, std::optional<rt::duration> age = {}) {
    if (last_ != rt::time_point{}) remember(gaps_, arrived - last_);
    last_ = arrived;
    ++messages_;
    bytes_ += bytes;
    if (age) remember(ages_, *age);
  }
  // Begins anew. The gap to the message before counts.
  void clear() {
    gaps_.clear();
    ages_.clear();
    messages_ = bytes_ = 0;
  }

  std::uint64_t messages() const noexcept { return messages_; }
  std::uint64_t bytes() const noexcept { return bytes_; }
  // Messages a second, by the gaps between them; nothing: there is no gap.
  std::optional<double> hertz() const noexcept {
    if (gaps_.empty()) return std::nullopt;
    rt::duration all{};
    for (const rt::duration one : gaps_) all += one;
    if (all <= rt::duration{0}) return std::nullopt;
    return static_cast<double>(gaps_.size()) / std::chrono::duration<double>(all).count();
  }

  struct spread {
    rt::duration least{}, median{}, p99{}, most{};
  };
  std::optional<spread> gaps() const { return spread_of(gaps_); }
  std::optional<spread> ages() const { return spread_of(ages_); }

 private:
  static void remember(std::vector<rt::duration>& in, rt::duration one) {
    if (in.size() < remembered_max) in.push_back(one);
  }
  // By nearest rank.
  static std::optional<spread> spread_of(std::vector<rt::duration> all) {
    if (all.empty()) return std::nullopt;
    std::ranges::sort(all);
    const auto at = [&](std::size_t percent) { return all[(all.size() * percent + 99) / 100 - 1]; };
    return spread{all.front(), at(50), at(99), all.back()};
  }

  rt::time_point last_{};
  std::vector<rt::duration> gaps_;
  std::vector<rt::duration> ages_;
  std::uint64_t messages_ = 0;
  std::uint64_t bytes_ = 0;
};

} // namespace rowe::tools
