// SPDX-License-Identifier: Apache-2.0
#include "gaps.hpp"

#include <algorithm>
#include <bit>

namespace rowe::tools {
namespace {

bool is_longer(const gap& one, const gap& other) noexcept { return one.length_ns() > other.length_ns(); }

} // namespace

std::size_t gap_finder::bucket_of(std::uint64_t ns) noexcept {
  constexpr std::uint64_t parts = 1U << parts_bits;
  if (ns < parts) return static_cast<std::size_t>(ns);
  const auto shift = static_cast<unsigned>(std::bit_width(ns)) - parts_bits - 1;
  return static_cast<std::size_t>((shift + 1) * parts + (ns >> shift) - parts);
}

std::uint64_t gap_finder::end_of_bucket(std::size_t bucket) noexcept {
  constexpr std::uint64_t parts = 1U << parts_bits;
  if (bucket < parts) return bucket;
  const std::size_t shift = bucket / parts - 1;
  return ((bucket % parts + parts + 1) << shift) - 1;
}

void gap_finder::add(std::int64_t time_ns) {
  const gap pause{last_ns_, time_ns};
  last_ns_ = time_ns;
  if (!began_) {
    began_ = true;
    return;
  }
  ++pauses_;
  ++buckets_[bucket_of(static_cast<std::uint64_t>(std::max<std::int64_t>(pause.length_ns(), 0)))];
  if (longest_.size() == kept_max) {
    if (!is_longer(pause, longest_.front())) return;
    std::pop_heap(longest_.begin(), longest_.end(), is_longer);
    longest_.pop_back();
  }
  longest_.push_back(pause);
  std::push_heap(longest_.begin(), longest_.end(), is_longer);
}

std::int64_t gap_finder::usual_ns() const noexcept {
  const std::uint64_t wanted = pauses_ - pauses_ / 10;
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket < buckets_.size(); ++bucket) {
    seen += buckets_[bucket];
    if (seen >= wanted) return static_cast<std::int64_t>(end_of_bucket(bucket));
  }
  return last_ns_;
}

std::vector<gap> gap_finder::gaps() const {
  std::vector<gap> found;
  if (pauses_ < pauses_min) return found;
  const std::int64_t usual = usual_ns();
  for (const gap& one : longest_) {
    const std::int64_t length = one.length_ns();
    if (length >= gap_ns_min && length / pauses_in_a_gap > usual) found.push_back(one);
  }
  std::sort(found.begin(), found.end(),
            [](const gap& one, const gap& other) { return one.begin_ns < other.begin_ns; });
  return found;
}

} // namespace rowe::tools
