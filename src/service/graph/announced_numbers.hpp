// SPDX-License-Identifier: Apache-2.0
// Which numbers of topics and services were announced to each peer: of topics by row, then of services.
// Service thread only.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/service_limits.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

class announced_numbers {
 public:
  // Two bits for each number.
  enum class mark : std::uint8_t {
    unseen, // not announced: the peer may not see what has it. The role's patterns are compared once
    waits   // it is in the message that waits to be written to the peer
  };

  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint32_t>(count(bounds)) +
           2 * rt::arena::bytes_for<std::uint32_t>(words_for(count(bounds)));
  }
  announced_numbers(rt::arena& memory, const limits& bounds) noexcept
      : topics_max_{bounds.topics_max},
        of_peer_{of_peer(bounds)},
        numbers_{memory.carve<std::uint32_t>(count(bounds))},
        unseen_{memory.carve<std::uint32_t>(words_for(count(bounds)))},
        waits_{memory.carve<std::uint32_t>(words_for(count(bounds)))} {
    std::fill(numbers_.begin(), numbers_.end(), wire::no_number);
  }

  std::span<std::uint32_t> of(peer_index peer) const noexcept {
    return numbers_.subspan(peer.value * of_peer_, of_peer_);
  }
  std::span<std::uint32_t> of(peer_index peer, bool topics) const noexcept {
    return topics ? of(peer).first(topics_max_) : of(peer).subspan(topics_max_);
  }
  // Of a number in there.
  bool is(mark what, const std::uint32_t& number) const noexcept {
    const std::size_t at = place(number);
    return (bits(what)[at / 32] >> at % 32 & 1) != 0;
  }
  void set(mark what, const std::uint32_t& number, bool to) noexcept {
    const std::size_t at = place(number);
    const std::uint32_t bit = std::uint32_t{1} << at % 32;
    std::uint32_t& word = bits(what)[at / 32];
    word = to ? word | bit : word & ~bit;
  }
  void forget(std::uint32_t& number) noexcept {
    set(mark::unseen, number, false);
    number = wire::no_number;
  }

 private:
  static std::size_t of_peer(const limits& bounds) noexcept {
    return std::size_t{bounds.topics_max} + first_service_number + bounds.services_max;
  }
  static std::size_t count(const limits& bounds) noexcept { return bounds.connections_max * of_peer(bounds); }
  static constexpr std::size_t words_for(std::size_t bits) noexcept { return (bits + 31) / 32; }
  std::size_t place(const std::uint32_t& number) const noexcept {
    return static_cast<std::size_t>(&number - numbers_.data());
  }
  std::span<std::uint32_t> bits(mark what) const noexcept { return what == mark::unseen ? unseen_ : waits_; }

  std::size_t topics_max_;
  std::size_t of_peer_;
  std::span<std::uint32_t> numbers_; // by peer
  std::span<std::uint32_t> unseen_;  // 32 in each word
  std::span<std::uint32_t> waits_;   // likewise
};

} // namespace rowe::service
