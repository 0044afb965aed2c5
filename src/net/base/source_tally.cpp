// SPDX-License-Identifier: Apache-2.0
#include "net/base/source_tally.hpp"

#include <sys/random.h>

#include <algorithm>

namespace rowe::net {

namespace {

// If the kernel has none, what a source's buckets are can be guessed. Counting goes on.
std::uint64_t random_number() noexcept {
  std::uint64_t number = 0;
  if (::getrandom(&number, sizeof number, 0) == sizeof number) return number;
  return static_cast<std::uint64_t>(rt::monotonic_clock::now().time_since_epoch().count());
}

// The last step of splitmix64 (Steele, Lea and Flood, 2014): each bit of its input changes half of the
// result.
constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

} // namespace

source_tally::source_tally(rt::duration forgiven_after, std::uint32_t most)
    : forgiven_after_{forgiven_after}, most_{most}, key_{random_number()}, rows_(rows * row_buckets) {}

source_tally::buckets source_tally::of(const socket_address& from) noexcept {
  static_assert(row_buckets == 1U << 11U);
  std::uint64_t bits = mixed(mixed(source_number(from) ^ key_) + key_);
  buckets found;
  for (std::size_t row = 0; row < rows; ++row, bits >>= 11U)
    found[row] = &rows_[row * row_buckets + bits % row_buckets];
  return found;
}

rt::time_point source_tally::least(const buckets& in, rt::time_point now) noexcept {
  return std::max(now, **std::min_element(in.begin(), in.end(), [](auto* a, auto* b) { return *a < *b; }));
}

std::uint32_t source_tally::note(const socket_address& from, rt::time_point now) noexcept {
  const buckets mine = of(from);
  const rt::duration left = least(mine, now) - now;
  const auto before =
      static_cast<std::uint32_t>((left + forgiven_after_ - rt::duration{1}) / forgiven_after_);
  const rt::time_point then = now + std::min(left + forgiven_after_, forgiven_after_ * most_);
  for (rt::time_point* const bucket : mine) *bucket = std::max(*bucket, then);
  return std::min(before, most_);
}

void source_tally::forgive(const socket_address& from, rt::time_point now) noexcept {
  const buckets mine = of(from);
  const rt::time_point then = least(mine, now);
  for (rt::time_point* const bucket : mine)
    if (*bucket == then) *bucket = then - forgiven_after_;
}

} // namespace rowe::net
