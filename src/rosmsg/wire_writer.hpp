// SPDX-License-Identifier: Apache-2.0
// Writes numbers as ROS 1 and CDR have them: little-endian and packed, or in either order and aligned.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "rosmsg/definition.hpp"
#include "rosmsg/output.hpp"

namespace rowe::rosmsg {

// What returns a bool returns false where it does not fit.
class wire_writer {
 public:
  wire_writer(ros_encoding in, output& to) noexcept
      : to_{to}, is_cdr_{in != ros_encoding::ros1}, swaps_{in == ros_encoding::cdr_big_endian} {}

  bool is_cdr() const noexcept { return is_cdr_; }
  wire how() const noexcept { return is_cdr_ ? wire::cdr : wire::ros1; }
  output& to() noexcept { return to_; }

  // Before all else.
  bool head() {
    constexpr std::size_t bytes = 4;
    const char text[bytes] = {0, swaps_ ? '\0' : '\1', 0, 0};
    if (!is_cdr_) return true;
    base_ = bytes;
    return to_.append({text, bytes});
  }

  bool align(std::size_t bytes) {
    const std::size_t padding = (base_ - to_.bytes()) & (bytes - 1);
    return !is_cdr_ || padding == 0 || to_.zeros(padding);
  }

  template <class T>
  bool put(T x) {
    char* const to = align(sizeof x) ? to_.room(sizeof x) : nullptr;
    if (to == nullptr) return false;
    store(to, x);
    to_.advance_to(to + sizeof x);
    return true;
  }

  // A count that is known later only. `place`: where it stands.
  bool begin_count(std::size_t& place) {
    if (!put(std::uint32_t{0})) return false;
    place = to_.bytes() - sizeof(std::uint32_t);
    return true;
  }
  void set_count(std::size_t place, std::uint32_t count) noexcept { store(to_.written(place), count); }

 private:
  template <class T>
  void store(char* to, T x) const noexcept {
    std::memcpy(to, &x, sizeof x);
    if (swaps_) std::reverse(to, to + sizeof x);
  }

  output& to_;
  const bool is_cdr_;
  const bool swaps_;
  std::size_t base_ = 0; // from where numbers are aligned
};

} // namespace rowe::rosmsg
