// SPDX-License-Identifier: Apache-2.0
// A robot's own types, with what a description has to tell of them.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include <rowe/ros.hpp>
#include <rowe/schema.hpp>

namespace robot {

enum class mode : std::uint8_t { off, manual, automatic = 7 };

struct place {
  double x = 0, y = 0;
};

struct state {
  std::chrono::sys_time<std::chrono::nanoseconds> stamp{};
  std::chrono::milliseconds uptime{};
  robot::mode mode = mode::off;
  robot::mode wanted = mode::off;
  std::uint64_t serial = 0;
  std::int16_t load = 0;
  bool moving = false;
  rowe::fixed_string<12> name;
  place where;
  std::array<float, 3> axes{};
  rowe::bounded_array<place, 4> path;
  std::uint8_t cells[8]{};
  std::uint16_t cell_count = 0;
  std::optional<place> goal;
  std::array<std::optional<std::int32_t>, 2> hits{};
  std::optional<std::chrono::duration<float, std::ratio<1, 30>>> frames;
  rowe::ros::vector3 speed;
};

// As much of it as ROS has.
struct report {
  rowe::ros::header header;
  robot::mode mode = mode::off;
  robot::mode wanted = mode::off;
  std::chrono::milliseconds uptime{};
  std::chrono::sys_time<std::chrono::nanoseconds> born{};
  std::uint64_t serial = 0;
  std::array<float, 3> axes{};
  rowe::bounded_array<rowe::ros::point, 4> path;
  bool moving = false;
};

} // namespace robot

// clang-format off
template <> inline constexpr auto rowe::names<robot::mode> =
    rowe::enumerators<robot::mode::off, robot::mode::manual, rowe::enumerator<robot::mode::automatic, "auto">>{};
template <> inline constexpr auto rowe::schema<robot::place> = rowe::fields<&robot::place::x, &robot::place::y>{};
template <> inline constexpr auto rowe::schema<robot::state> =
    rowe::fields<rowe::field<&robot::state::stamp>.as_seconds(), &robot::state::uptime,
                 rowe::field<&robot::state::mode>.by_name(), &robot::state::wanted,
                 rowe::field<&robot::state::serial>.as_string(), &robot::state::load, &robot::state::moving,
                 rowe::field<&robot::state::name, "a \"name\"">, &robot::state::where, &robot::state::axes,
                 &robot::state::path, rowe::counted<&robot::state::cells, &robot::state::cell_count>,
                 &robot::state::goal, &robot::state::hits, &robot::state::frames, &robot::state::speed>{};
template <> inline constexpr auto rowe::schema<robot::report> =
    rowe::fields<&robot::report::header, rowe::field<&robot::report::mode>.by_name(), &robot::report::wanted,
                 &robot::report::uptime, rowe::field<&robot::report::born>.as_seconds(),
                 rowe::field<&robot::report::serial>.as_string(), &robot::report::axes, &robot::report::path,
                 &robot::report::moving>{}.type("robot/Report");
// clang-format on
