// SPDX-License-Identifier: Apache-2.0
// Numbers in a struct, by their addresses: read and written as bytes, because what is there is known by its
// description only. Pure functions, on any thread; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <cstring>
#include <limits>

#include <rowe/schema.hpp>

#include "json/reading/numbers.hpp"

namespace rowe::json {

template <class T>
void store(char* at, T x) noexcept {
  std::memcpy(at, &x, sizeof x);
}

template <class T>
T load(const char* at) noexcept {
  T x;
  std::memcpy(&x, at, sizeof x);
  return x;
}

template <class Integer>
bool store_if_it_fits(char* at, const whole_number& n) noexcept {
  if (n.negative && n.magnitude != 0) {
    if constexpr (std::numeric_limits<Integer>::is_signed) {
      const auto limit = std::uint64_t{1} << std::numeric_limits<Integer>::digits; // of the least
      if (n.magnitude > limit) return false;
      store(at, static_cast<Integer>(-n.magnitude));
      return true;
    }
    return false;
  }
  if (n.magnitude > static_cast<std::uint64_t>(std::numeric_limits<Integer>::max())) return false;
  store(at, static_cast<Integer>(n.magnitude));
  return true;
}

inline bool store_if_it_fits(char* at, value_kind kind, const whole_number& n) noexcept {
  switch (kind) {
  case value_kind::int8: return store_if_it_fits<std::int8_t>(at, n);
  case value_kind::int16: return store_if_it_fits<std::int16_t>(at, n);
  case value_kind::int32: return store_if_it_fits<std::int32_t>(at, n);
  case value_kind::int64: return store_if_it_fits<std::int64_t>(at, n);
  case value_kind::uint8: return store_if_it_fits<std::uint8_t>(at, n);
  case value_kind::uint16: return store_if_it_fits<std::uint16_t>(at, n);
  case value_kind::uint32: return store_if_it_fits<std::uint32_t>(at, n);
  default: return store_if_it_fits<std::uint64_t>(at, n);
  }
}

// Of an unsigned one of 64 bits: its bits.
inline std::int64_t load_integer(const char* at, value_kind kind) noexcept {
  switch (kind) {
  case value_kind::int8: return load<std::int8_t>(at);
  case value_kind::int16: return load<std::int16_t>(at);
  case value_kind::int32: return load<std::int32_t>(at);
  case value_kind::uint8: return load<std::uint8_t>(at);
  case value_kind::uint16: return load<std::uint16_t>(at);
  case value_kind::uint32: return load<std::uint32_t>(at);
  default: return load<std::int64_t>(at);
  }
}

inline void store_integer(char* at, value_kind kind, std::uint64_t bits) noexcept {
  switch (kind) {
  case value_kind::int8:
  case value_kind::uint8: return store(at, static_cast<std::uint8_t>(bits));
  case value_kind::int16:
  case value_kind::uint16: return store(at, static_cast<std::uint16_t>(bits));
  case value_kind::int32:
  case value_kind::uint32: return store(at, static_cast<std::uint32_t>(bits));
  default: return store(at, bits);
  }
}

} // namespace rowe::json
