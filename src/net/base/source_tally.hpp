// SPDX-License-Identifier: Apache-2.0
// How often each source has done something lately. What it did is forgiven by and by. Made at set-up; then
// one thread, never waits, never allocates.
//
// A sketch (count-min with conservative update: Estan and Varghese, 2002), so that as many sources as come
// are counted in the same memory, and none pushes another out. In each of three rows a source has a bucket,
// and shares it with others; its own count is the least of the three. It is never too low, and too high only
// where others hit all three. With 200 others that is one source of 1500. Where a source's buckets are
// depends on a random number, so nobody can choose to hit those of another.
//
// A bucket is the time at which all of it is forgiven.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "net/base/address.hpp"

namespace rowe::net {

class source_tally {
 public:
  // One time is forgiven after each such period. No source is counted beyond `most`. Allocates 48 KiB.
  source_tally(rt::duration forgiven_after, std::uint32_t most);

  // The source does it again. Returns how often it did so before, as far as that is not forgiven.
  std::uint32_t note(const socket_address& from, rt::time_point now) noexcept;
  // One of those times does not count, after all.
  void forgive(const socket_address& from, rt::time_point now) noexcept;

 private:
  static constexpr std::size_t rows = 3;
  static constexpr std::size_t row_buckets = 2048;
  using buckets = std::array<rt::time_point*, rows>;
  buckets of(const socket_address& from) noexcept;
  static rt::time_point least(const buckets& in, rt::time_point now) noexcept;

  const rt::duration forgiven_after_;
  const std::uint32_t most_;
  const std::uint64_t key_;
  std::vector<rt::time_point> rows_;
};

// Of handshakes that have not, or not yet, led to a connection or a page.
inline source_tally handshakes_begun() {
  constexpr rt::duration forgiven_after = std::chrono::seconds{2};
  constexpr std::uint32_t most = 64;
  return {forgiven_after, most};
}

} // namespace rowe::net
