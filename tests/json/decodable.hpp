// SPDX-License-Identifier: Apache-2.0
// Structs with something of everything that a schema can have, for the decoder's tests and its fuzzer.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <rowe/schema.hpp>

namespace rowe::tests {

enum class gear : std::int8_t { reverse = -1, neutral, first };

enum class stance : std::int16_t { lying = -3, sitting, standing = 200 };
enum class rank : std::uint64_t { least, most = 0xffff'ffff'ffff'ffff };

struct point {
  double x = 1, y = 2;
};

struct numbers {
  bool yes = false;
  std::int8_t i8 = 0;
  std::int16_t i16 = 0;
  std::int32_t i32 = 0;
  std::int64_t i64 = 0;
  std::uint8_t u8 = 0;
  std::uint16_t u16 = 0;
  std::uint32_t u32 = 0;
  std::uint64_t u64 = 0;
  float f = 0;
  double d = 0;
  gear g = gear::neutral;
};

struct everything {
  rowe::tests::numbers numbers;
  std::int64_t serial = 0;
  std::uint64_t ids[2]{};
  rowe::fixed_string<12> text;
  point where;
  std::array<double, 3> covariance{};
  std::array<std::array<float, 2>, 2> matrix{};
  rowe::bounded_array<point, 3> path;
  rowe::bounded_array<rowe::fixed_string<8>, 2> names;
  std::optional<double> real;
  std::optional<point> goal;
  std::optional<rowe::bounded_array<std::int32_t, 2>> list;
  std::array<std::optional<std::int32_t>, 2> holes{};
  float ranges[4]{};
  std::uint16_t intensities[4]{};
  std::int8_t count = 0;
  double much[300]{};
  std::uint8_t much_count = 0; // cannot count as far
  std::optional<rowe::bounded_array<std::uint8_t, 7>> bytes;
  std::optional<std::array<std::byte, 4>> raw;
  std::optional<rowe::bounded_array<std::uint8_t, 3>> plain;
  std::optional<std::array<rowe::bounded_array<std::byte, 2>, 2>> rows;
};

// Whatever is there is read; nothing need be.
struct anything {
  std::optional<bool> yes;
  std::optional<std::int8_t> i8;
  std::optional<std::int64_t> i64;
  std::optional<std::uint64_t> u64;
  std::optional<float> f;
  std::optional<double> d;
  std::optional<std::int32_t> s;
  std::optional<rowe::fixed_string<5>> text;
  std::optional<rowe::bounded_array<double, 3>> list;
  std::optional<std::array<std::uint8_t, 2>> two;
  std::optional<std::optional<std::int16_t>> twice;
  std::optional<rowe::tests::stance> stance;
  std::optional<rowe::bounded_array<rowe::tests::stance, 3>> stances;
  std::optional<rowe::tests::rank> rank;
  std::optional<std::chrono::milliseconds> age;
  std::optional<std::chrono::nanoseconds> age_s;
  std::optional<std::array<std::chrono::duration<std::uint16_t, std::deci>, 2>> laps;
  std::optional<std::chrono::duration<std::int8_t>> whole;
  std::optional<std::chrono::sys_time<std::chrono::microseconds>> born;
  std::optional<std::chrono::duration<float, std::milli>> wait;
};

} // namespace rowe::tests

namespace rowe {

template <>
inline constexpr auto names<tests::stance> =
    enumerators<tests::stance::standing, tests::stance::sitting,
                enumerator<tests::stance::lying, "on the \"ground\"">>{};
template <>
inline constexpr auto names<tests::rank> = enumerators<tests::rank::least, tests::rank::most>{};
template <>
inline constexpr auto schema<tests::point> = fields<&tests::point::x, &tests::point::y>{};
template <>
inline constexpr auto schema<tests::numbers> =
    fields<&tests::numbers::yes, &tests::numbers::i8, &tests::numbers::i16, &tests::numbers::i32,
           &tests::numbers::i64, &tests::numbers::u8, &tests::numbers::u16, &tests::numbers::u32,
           &tests::numbers::u64, &tests::numbers::f, &tests::numbers::d, &tests::numbers::g>{};
template <>
inline constexpr auto schema<tests::everything> =
    fields<&tests::everything::numbers, field<&tests::everything::serial>.as_string(),
           field<&tests::everything::ids>.as_string(), field<&tests::everything::text, "the \"text\"">,
           &tests::everything::where, &tests::everything::covariance,
           field<&tests::everything::matrix, "a matrix of two rows">, &tests::everything::path,
           &tests::everything::names, &tests::everything::real, &tests::everything::goal,
           field<&tests::everything::list, "exactly_16_bytes">, &tests::everything::holes,
           counted<&tests::everything::ranges, &tests::everything::count>,
           counted<&tests::everything::intensities, &tests::everything::count>, &tests::everything::count,
           counted<&tests::everything::much, &tests::everything::much_count, "\u00fc">,
           &tests::everything::bytes, &tests::everything::raw, field<&tests::everything::plain>.as_numbers(),
           &tests::everything::rows>{};
template <>
inline constexpr auto schema<tests::anything> =
    fields<&tests::anything::yes, &tests::anything::i8, &tests::anything::i64, &tests::anything::u64,
           &tests::anything::f, &tests::anything::d, field<&tests::anything::s>.as_string(),
           &tests::anything::text, &tests::anything::list, &tests::anything::two, &tests::anything::twice,
           field<&tests::anything::stance>.by_name(), field<&tests::anything::stances>.by_name(),
           field<&tests::anything::rank>.by_name(), &tests::anything::age,
           field<&tests::anything::age_s>.as_seconds(), field<&tests::anything::laps>.as_seconds(),
           field<&tests::anything::whole>.as_seconds(), field<&tests::anything::born>.as_seconds(),
           &tests::anything::wait>{};

} // namespace rowe
