// SPDX-License-Identifier: Apache-2.0
// The policy through which rings, windows and every other structure share words between threads, so that one
// source runs on std::atomic, under the interleaving explorer of tests/model (which knows stale reads and
// reports races on plain data) and under ThreadSanitizer. There are no stand-alone fences: TSan cannot model
// them.
#pragma once
#include <atomic>

#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

#if defined(__GNUC__) && !defined(__clang__) // gcc 12 sees words at null in functions that it has inlined
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wstringop-overflow"
#endif
struct std_atomics {
  // A word that threads share.
  template <class T>
  class variable {
   public:
    constexpr variable() noexcept = default;
    explicit constexpr variable(T value) noexcept : word_{value} {}
    T load(std::memory_order order) const noexcept { return word_.load(order); }
    void store(T value, std::memory_order order) noexcept { word_.store(value, order); }
    T exchange(T value, std::memory_order order) noexcept { return word_.exchange(value, order); }
    T fetch_add(T value, std::memory_order order) noexcept { return word_.fetch_add(value, order); }

   private:
    static_assert(std::atomic<T>::is_always_lock_free);
    std::atomic<T> word_{};
  };

  // Data that threads hand to each other; never touched by two at once, which the explorer checks.
  template <class T>
  class plain {
   public:
    constexpr plain() noexcept = default;
    explicit constexpr plain(const T& data) noexcept : data_{data} {}
    const T& load() const noexcept { return data_; }
    void store(const T& data) noexcept { data_ = data; }

   private:
    T data_{};
  };
};
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

} // namespace rowe::rt
