// SPDX-License-Identifier: Apache-2.0
// How often each source has done something lately. What it did is forgiven by and by, once it pauses. The
// sources that did it last are remembered. One thread; never waits, never allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "net/address.hpp"

namespace rowe::net {

class source_tally {
 public:
  static constexpr std::size_t sources_max = 64;

  // One time is forgiven for each such period since the last one. No source is counted beyond `most`.
  source_tally(rt::duration forgiven_after, std::uint32_t most) noexcept
      : forgiven_after_{forgiven_after}, most_{most} {}

  // The source does it again. Returns how often it did so before, as far as that is not forgiven.
  std::uint32_t note(const socket_address& from, rt::time_point now) noexcept;

 private:
  struct source {
    socket_address address;
    std::uint32_t times = 0; // that are not forgiven yet; 0: the place is free
    rt::time_point since{};  // as of then
  };
  source& place_of(const socket_address& from) noexcept;

  const rt::duration forgiven_after_;
  const std::uint32_t most_;
  std::array<source, sources_max> sources_{};
};

} // namespace rowe::net
