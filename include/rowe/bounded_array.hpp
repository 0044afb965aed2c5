// SPDX-License-Identifier: Apache-2.0
// A sequence inside a struct: up to `Capacity` elements, in place, trivially copyable if the elements are.
// For a laser scan or a list of joints. Only the elements in use are written to JSON.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>

#include <rowe/rt/attributes.hpp>

namespace rowe {

template <class T, std::size_t Capacity>
class bounded_array {
  static_assert(Capacity >= 1 && Capacity <= UINT32_MAX);

 public:
  using value_type = T;

  // Adds an element. False, and nothing changed, if the array is full.
  ROWE_RT [[nodiscard]] constexpr bool push_back(const T& element) noexcept {
    if (count_ == Capacity) return false;
    elements_[count_++] = element;
    return true;
  }
  // Sets the number of elements in use, so they can be written in place; their values stay. False, and
  // nothing changed, if `count` exceeds the capacity.
  ROWE_RT [[nodiscard]] constexpr bool resize(std::size_t count) noexcept {
    if (count > Capacity) return false;
    count_ = static_cast<std::uint32_t>(count);
    return true;
  }
  ROWE_RT constexpr void clear() noexcept { count_ = 0; }

  ROWE_RT constexpr T& operator[](std::size_t index) noexcept {
    assert(index < count_);
    return elements_[index];
  }
  ROWE_RT constexpr const T& operator[](std::size_t index) const noexcept {
    assert(index < count_);
    return elements_[index];
  }

  ROWE_RT constexpr std::size_t size() const noexcept { return count_; }
  ROWE_RT constexpr bool empty() const noexcept { return count_ == 0; }
  ROWE_RT constexpr bool full() const noexcept { return count_ == Capacity; }
  ROWE_RT static constexpr std::size_t capacity() noexcept { return Capacity; }

  ROWE_RT constexpr T* data() noexcept { return elements_; }
  ROWE_RT constexpr const T* data() const noexcept { return elements_; }
  ROWE_RT constexpr T* begin() noexcept { return elements_; }
  ROWE_RT constexpr T* end() noexcept { return elements_ + count_; }
  ROWE_RT constexpr const T* begin() const noexcept { return elements_; }
  ROWE_RT constexpr const T* end() const noexcept { return elements_ + count_; }

 private:
  std::uint32_t count_ = 0;
  T elements_[Capacity] = {};
};

} // namespace rowe
