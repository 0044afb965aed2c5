// SPDX-License-Identifier: Apache-2.0
// The messages that JSON is measured with. For json_write.cpp, json_read.cpp and json_steps.cpp.
#pragma once
#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <rowe/ros.hpp>

#include "json/writing/writer.hpp"

namespace rowe::bench {

// Without covariances: 13 doubles, about 500 bytes of text.
struct odometry {
  ros::header header;
  ros::frame_name child_frame_id;
  ros::pose pose;
  ros::twist twist;
};

} // namespace rowe::bench

template <>
inline constexpr auto rowe::schema<rowe::bench::odometry> =
    rowe::fields<&rowe::bench::odometry::header, &rowe::bench::odometry::child_frame_id,
                 &rowe::bench::odometry::pose, &rowe::bench::odometry::twist>{};

namespace rowe::bench {

// A laser scan: 360 floats.
struct laser_scan {
  ros::header header;
  float angle_min = 0, angle_max = 0, range_max = 0;
  std::array<float, 360> ranges{};
};
// A picture: 16 KiB of bytes that look random.
struct picture {
  ros::header header;
  std::array<std::uint8_t, 16 * 1024> data{};
};

} // namespace rowe::bench

template <>
inline constexpr auto rowe::schema<rowe::bench::laser_scan> =
    rowe::fields<&rowe::bench::laser_scan::header, &rowe::bench::laser_scan::angle_min,
                 &rowe::bench::laser_scan::angle_max, &rowe::bench::laser_scan::range_max,
                 &rowe::bench::laser_scan::ranges>{};
template <>
inline constexpr auto rowe::schema<rowe::bench::picture> =
    rowe::fields<&rowe::bench::picture::header, &rowe::bench::picture::data>{};

namespace rowe::bench {

inline constexpr std::size_t messages = 256;

// A small invocation.
struct call {
  std::string service, id;
  std::int64_t a, b;
};

inline std::size_t write_call(std::span<char> buffer, const call& c) {
  json::writer w{buffer};
  w.begin_object();
  w.key("service");
  w.string(c.service);
  w.key("a");
  w.number(c.a);
  w.key("b");
  w.number(c.b);
  w.key("message_id");
  w.string(c.id);
  w.end_object();
  return w.bytes();
}

enum class covariances { sparse, dense };

class message_source {
 public:
  double number() { return metres_(random_); }

  std::vector<odometry> odometries() {
    std::vector<odometry> all;
    for (std::size_t i = 0; i < messages; ++i) all.push_back({header(i), "base_link", pose(), twist()});
    return all;
  }

  std::vector<laser_scan> scans() {
    std::vector<laser_scan> all;
    for (std::size_t i = 0; i < messages; ++i) {
      laser_scan& scan = all.emplace_back();
      scan.header = header(i);
      scan.angle_min = -3.14f;
      scan.angle_max = 3.14f;
      scan.range_max = 12.0f;
      for (float& range : scan.ranges) range = static_cast<float>(number());
    }
    return all;
  }

  std::vector<picture> pictures(std::size_t count) {
    std::vector<picture> all(count);
    for (picture& one : all) {
      one.header = header(0);
      for (std::uint8_t& byte : one.data) byte = static_cast<std::uint8_t>(random_());
    }
    return all;
  }

  // 85 doubles: sparse are 12 of the 72 covariances, the diagonals, and dense all of them.
  std::vector<ros::odometry> odometries_with(covariances which) {
    std::vector<ros::odometry> all;
    for (std::size_t i = 0; i < messages; ++i) {
      ros::odometry o{header(i), "base_link", {pose(), {}}, {twist(), {}}};
      for (std::size_t k = 0; k < 36; ++k) {
        if (which != covariances::dense && k % 7 != 0) continue;
        o.pose.covariance[k] = number();
        o.twist.covariance[k] = number();
      }
      all.push_back(o);
    }
    return all;
  }

  // A rosbridge publish of about 300 bytes.
  std::string publish(std::size_t i) {
    std::array<char, 1024> buffer;
    json::writer w{buffer};
    w.append(R"({"op":"publish","id":"publish:/cmd_vel:)");
    w.append(std::to_string(i));
    w.append(R"(","topic":"/cmd_vel","msg":{"header":{"stamp":{"secs":1700000000,"nsecs":123456789},)"
             R"("frame_id":"base_link"},"twist":)");
    w.begin_object();
    for (const char* const name : {"linear", "angular"}) {
      w.key(name);
      w.begin_object();
      for (const char* const axis : {"x", "y", "z"}) {
        w.key(axis);
        w.number(number());
      }
      w.end_object();
    }
    w.append(R"(}},"latch":false})");
    return std::string{w.text()};
  }

  std::vector<call> calls() {
    std::vector<call> all;
    for (std::size_t i = 0; i < messages; ++i) {
      all.push_back({"add-two-numbers", "5c1f2e.1.2." + std::to_string(i), static_cast<std::int64_t>(i), 4});
    }
    return all;
  }

 private:
  ros::pose pose() { return {{number(), number(), number()}, {number(), number(), number(), number()}}; }
  ros::twist twist() { return {{number(), number(), number()}, {number(), number(), number()}}; }
  static ros::header header(std::size_t i) {
    return {.seq = static_cast<std::uint32_t>(100'000 + i),
            .stamp = {1'700'000'000, 123'456'789},
            .frame_id = "odom"};
  }

  std::mt19937_64 random_{20'240'229};
  std::normal_distribution<double> metres_;
};

} // namespace rowe::bench
