// SPDX-License-Identifier: Apache-2.0
// A set of peers: one bit for each connection that there may be. Refers to its words, and owns nothing.
// Service thread only.
#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "service/base/ids.hpp"

namespace rowe::service {

class peer_set {
 public:
  static constexpr std::size_t words_for(std::uint32_t peers) noexcept {
    return (std::size_t{peers} + bits - 1) / bits;
  }
  explicit peer_set(std::span<std::uint64_t> words) noexcept : words_{words} {}

  void add(peer_index which) const noexcept { words_[which.value / bits] |= bit(which); }
  void remove(peer_index which) const noexcept { words_[which.value / bits] &= ~bit(which); }
  bool has(peer_index which) const noexcept { return (words_[which.value / bits] & bit(which)) != 0; }
  void clear() const noexcept { std::fill(words_.begin(), words_.end(), 0); }
  // Calls `take(peer)` with each, in their order.
  template <class Take>
  void for_each(const Take& take) const noexcept {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::uint64_t left = words_[i]; left != 0; left &= left - 1)
        take(peer_index{static_cast<std::uint32_t>(i * bits) +
                        static_cast<std::uint32_t>(std::countr_zero(left))});
    }
  }
  std::size_t words() const noexcept { return words_.size(); }

 private:
  static constexpr std::size_t bits = 64;
  static constexpr std::uint64_t bit(peer_index which) noexcept {
    return std::uint64_t{1} << (which.value % bits);
  }

  std::span<std::uint64_t> words_;
};

} // namespace rowe::service
