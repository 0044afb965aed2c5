// SPDX-License-Identifier: Apache-2.0
// The types of members that a table can name (rowe/struct.h), as they lie in memory: read and written as
// bytes, by the address of the member.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include <rowe/schema.hpp>
#include <rowe/struct.h>

namespace rowe::capi {

inline const void* itself(const void* at) noexcept { return at; }

template <class Integer>
std::size_t count_at(const void* at) noexcept {
  Integer count;
  std::memcpy(&count, at, sizeof count);
  if constexpr (std::numeric_limits<Integer>::is_signed) {
    if (count < 0) return 0;
  }
  return static_cast<std::size_t>(count);
}
template <class Integer>
void set_count_at(void* at, std::size_t to) noexcept {
  const auto count = static_cast<Integer>(to);
  std::memcpy(at, &count, sizeof count);
}

// How a scalar lies in memory, and how it counts.
struct scalar {
  value_kind kind{};
  std::size_t bytes = 0;
  std::size_t most = 0;   // of an integer, what it can count
  std::int64_t least = 0; // what names may stand for; 64 bits without a sign: their bits
  std::int64_t greatest = 0;
  std::size_t (*count)(const void*) noexcept = nullptr;
  void (*set_count)(void*, std::size_t) noexcept = nullptr;
};
template <class Integer>
constexpr scalar integer(value_kind kind) noexcept {
  using bits = std::numeric_limits<std::int64_t>;
  constexpr bool wide = sizeof(Integer) == sizeof(std::int64_t);
  return {kind,
          sizeof(Integer),
          static_cast<std::size_t>(std::numeric_limits<Integer>::max()),
          wide ? bits::min() : static_cast<std::int64_t>(std::numeric_limits<Integer>::min()),
          wide ? bits::max() : static_cast<std::int64_t>(std::numeric_limits<Integer>::max()),
          &count_at<Integer>,
          &set_count_at<Integer>};
}
inline constexpr std::array<scalar, rowe_member_double> scalars{
    scalar{value_kind::boolean, sizeof(bool)},  integer<std::int8_t>(value_kind::int8),
    integer<std::int16_t>(value_kind::int16),   integer<std::int32_t>(value_kind::int32),
    integer<std::int64_t>(value_kind::int64),   integer<std::uint8_t>(value_kind::uint8),
    integer<std::uint16_t>(value_kind::uint16), integer<std::uint32_t>(value_kind::uint32),
    integer<std::uint64_t>(value_kind::uint64), scalar{value_kind::float32, sizeof(float)},
    scalar{value_kind::float64, sizeof(double)}};

inline bool is_integer(int type) noexcept { return type >= rowe_member_int8 && type <= rowe_member_uint64; }
inline bool is_time(int type) noexcept { return type == rowe_member_time || type == rowe_member_duration; }
inline bool is_real(int type) noexcept { return type == rowe_member_float || type == rowe_member_double; }

// Null: not the type of a scalar.
inline const scalar* scalar_of(int type) noexcept {
  if (is_time(type)) type = rowe_member_int64;
  return type >= rowe_member_bool && type <= rowe_member_double ? &scalars[static_cast<std::size_t>(type - 1)]
                                                                : nullptr;
}

} // namespace rowe::capi
