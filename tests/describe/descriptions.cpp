// SPDX-License-Identifier: Apache-2.0
// For others_test.py: a line of JSON for each type, with its descriptions, and with values that the encoder
// wrote.
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include <rowe/ros.hpp>
#include <rowe/types.hpp>

#include "describe/robot.hpp"
#include "describe/words.hpp"
#include "json/decodable.hpp"
#include "json/structs/encoder.hpp"
#include "json/writing/writer.hpp"

namespace {

template <class T>
std::string encoded(const T& x) {
  const rowe::json::encoder e = rowe::json::encoder::compile(rowe::describe<T>()).value();
  std::string buffer(e.bytes_max(), '\0');
  rowe::json::writer w{buffer};
  e.encode(&x, w);
  return std::string{w.text()};
}

template <class T>
void print(const char* name, const std::vector<T>& values) {
  std::string texts;
  for (const T& x : values) texts += (texts.empty() ? "" : ",") + encoded(x);
  const rowe::ros_text ros = rowe::ros_message<T>();
  std::printf(R"({"name":"%s","schema":%s,"values":[%s],"ros":%s,"reason":%s})"
              "\n",
              name, rowe::json_schema<T>().c_str(), texts.c_str(),
              rowe::describe_words::quoted(ros.text).c_str(),
              rowe::describe_words::quoted(ros.reason).c_str());
}

std::vector<robot::state> states() {
  robot::state full;
  full.stamp = decltype(full.stamp){std::chrono::nanoseconds{1'700'000'000'123'456'789}};
  full.uptime = std::chrono::milliseconds::max();
  full.mode = robot::mode::automatic;
  full.wanted = robot::mode::manual;
  full.serial = std::numeric_limits<std::uint64_t>::max();
  full.load = -32768;
  full.moving = true;
  full.name = "äöüäöü";
  full.axes = {0.1F, -0.0F, 3e38F};
  while (full.path.push_back({1.5, -2})) {
  }
  full.cells[7] = 255;
  full.cell_count = 1000; // means all
  full.goal.emplace();
  full.hits = {7, std::nullopt};
  full.frames.emplace(0.5F);
  return {{}, full};
}

std::vector<rowe::tests::numbers> numbers() {
  using limits64 = std::numeric_limits<std::int64_t>;
  rowe::tests::numbers least{true, -128, -32768, std::numeric_limits<std::int32_t>::min(), limits64::min()};
  rowe::tests::numbers most{
      true, 127,   32767,      std::numeric_limits<std::int32_t>::max(),  limits64::max(),
      255,  65535, 4294967295, std::numeric_limits<std::uint64_t>::max(), 1e38F,
      1e308};
  return {{}, least, most};
}

} // namespace

int main() {
  print<rowe::ros::twist>("twist", {{}});
  print<rowe::ros::odometry>("odometry", {{}});
  print<rowe::ros2::odometry>("odometry of ROS 2", {{}});
  print<robot::state>("state", states());
  print<robot::report>("report", {{}});
  print<rowe::tests::numbers>("numbers", numbers());
  print<rowe::tests::everything>("everything", {{}});
  rowe::tests::anything some;
  some.stances.emplace();
  some.stance = rowe::tests::stance::lying;
  some.laps.emplace();
  some.born.emplace();
  some.twice.emplace();
  print<rowe::tests::anything>("anything", {{}, some});
}
