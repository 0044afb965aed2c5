// SPDX-License-Identifier: Apache-2.0
// Odometry that says which one it is and when its publish() began, and what a peer reads of that: in JSON, in
// CBOR, and in what a client of Foxglove gets. The robot and its peers read the same clock.
#pragma once
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>

#include <rowe/rt/clock.hpp>
#include <rowe/schema.hpp>

namespace rowe::bench {
struct stamped {
  std::uint64_t sequence = 0;
  std::uint64_t begun_ns = 0;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{};
  std::array<double, 2> velocity{};
  std::array<double, 3> spread{};
};
} // namespace rowe::bench
template <>
inline constexpr auto rowe::schema<rowe::bench::stamped> =
    rowe::fields<&rowe::bench::stamped::sequence, &rowe::bench::stamped::begun_ns,
                 &rowe::bench::stamped::position, &rowe::bench::stamped::orientation,
                 &rowe::bench::stamped::velocity, &rowe::bench::stamped::spread>{};

namespace rowe::bench {

inline stamped odometry_at(std::uint64_t sequence, rt::time_point now) {
  const double at = 0.001 * static_cast<double>(sequence);
  return {sequence,
          static_cast<std::uint64_t>(rt::nanoseconds_of(now)),
          {at / 3, at / 7, 0.1},
          {0.0, 0.0, at / 11, 0.7},
          {0.5 + at / 13, at / 17},
          {0.01, 0.02, 0.03}};
}

// The whole number that stands behind a name: as JSON, else as CBOR. Nothing where there is none.
inline std::optional<std::uint64_t> number_behind(std::string_view message, std::string_view name) {
  const std::size_t at = message.find(name);
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view rest = message.substr(at + name.size());
  if (rest.starts_with("\":")) {
    rest.remove_prefix(2);
    std::uint64_t value = 0;
    const auto done = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    return done.ec == std::errc{} ? std::optional{value} : std::nullopt;
  }
  if (rest.empty()) return std::nullopt;
  const auto byte = [&](std::size_t i) {
    return static_cast<std::uint64_t>(static_cast<unsigned char>(rest[i]));
  };
  if (byte(0) < 24) return byte(0);
  if (byte(0) > 27) return std::nullopt; // no unsigned number
  const std::size_t bytes = std::size_t{1} << (byte(0) - 24);
  if (rest.size() <= bytes) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = 1; i <= bytes; ++i) value = value << 8 | byte(i);
  return value;
}

struct arrival {
  std::uint64_t sequence = 0;
  double took_ns = 0; // since publish() began
};

// Nothing of a message that is no such odometry.
inline std::optional<arrival> arrival_of(std::string_view message, rt::time_point now) {
  const auto sequence = number_behind(message, "sequence");
  const auto begun = number_behind(message, "begun_ns");
  if (!sequence || !begun) return std::nullopt;
  return arrival{*sequence, static_cast<double>(rt::nanoseconds_of(now)) - static_cast<double>(*begun)};
}

} // namespace rowe::bench
