// SPDX-License-Identifier: Apache-2.0
// Ready-made messages that roslib pages, Foxglove panels and ROS bridges understand. Plain structs; lengths
// are in metres, angles in radians, speeds in m/s and rad/s, in the frame that the header names.
//
// ROS 1 and ROS 2 spell headers differently in JSON: stamps are {secs, nsecs} beside a seq, or {sec, nanosec}
// without one. The namespace decides what is published: rowe::ros writes as ROS 1, rowe::ros2 as ROS 2. A
// subscriber of either reads both shapes, and Foxglove's {sec, nsec}. Types without a header are the same in
// both.
#pragma once
#include <array>
#include <cstdint>

#include <rowe/fixed_string.hpp>
#include <rowe/schema.hpp>

namespace rowe::ros {

struct time {
  std::uint32_t secs = 0;
  std::uint32_t nsecs = 0;
};

using frame_name = fixed_string<60>;

struct header {
  std::uint32_t seq = 0;
  time stamp;
  frame_name frame_id;
};

struct point {
  double x = 0, y = 0, z = 0;
};

struct vector3 {
  double x = 0, y = 0, z = 0;
};

struct quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};

// Row-major 6 x 6: x, y, z, rotation about x, about y, about z.
using covariance6 = std::array<double, 36>;

struct pose {
  point position;
  quaternion orientation;
};

struct pose_with_covariance {
  ros::pose pose;
  covariance6 covariance{};
};

struct pose_stamped {
  ros::header header;
  ros::pose pose;
};

struct twist {
  vector3 linear, angular;
};

struct twist_with_covariance {
  ros::twist twist;
  covariance6 covariance{};
};

struct odometry {
  ros::header header;
  frame_name child_frame_id;
  pose_with_covariance pose;
  twist_with_covariance twist;
};

} // namespace rowe::ros

namespace rowe::ros2 {

using ros::covariance6;
using ros::frame_name;
using ros::point;
using ros::pose;
using ros::pose_with_covariance;
using ros::quaternion;
using ros::twist;
using ros::twist_with_covariance;
using ros::vector3;

struct time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};

struct header {
  time stamp;
  frame_name frame_id;
};

struct pose_stamped {
  ros2::header header;
  ros2::pose pose;
};

struct odometry {
  ros2::header header;
  frame_name child_frame_id;
  pose_with_covariance pose;
  twist_with_covariance twist;
};

} // namespace rowe::ros2

// clang-format off
template <> inline constexpr auto rowe::schema<rowe::ros::time> =
    rowe::fields<rowe::field<&rowe::ros::time::secs, "secs", "sec">,
                 rowe::field<&rowe::ros::time::nsecs, "nsecs", "nanosec">>{}.type("std_msgs/Time");

template <> inline constexpr auto rowe::schema<rowe::ros::header> =
    rowe::fields<rowe::field<&rowe::ros::header::seq>.or_default(), &rowe::ros::header::stamp,
                 &rowe::ros::header::frame_id>{}.type("std_msgs/Header");

template <> inline constexpr auto rowe::schema<rowe::ros::point> =
    rowe::fields<&rowe::ros::point::x, &rowe::ros::point::y, &rowe::ros::point::z>{}.type("geometry_msgs/Point");

template <> inline constexpr auto rowe::schema<rowe::ros::vector3> =
    rowe::fields<&rowe::ros::vector3::x, &rowe::ros::vector3::y, &rowe::ros::vector3::z>{}
        .type("geometry_msgs/Vector3");

template <> inline constexpr auto rowe::schema<rowe::ros::quaternion> =
    rowe::fields<&rowe::ros::quaternion::x, &rowe::ros::quaternion::y, &rowe::ros::quaternion::z,
                 &rowe::ros::quaternion::w>{}.type("geometry_msgs/Quaternion");

template <> inline constexpr auto rowe::schema<rowe::ros::pose> =
    rowe::fields<&rowe::ros::pose::position, &rowe::ros::pose::orientation>{}.type("geometry_msgs/Pose");

template <> inline constexpr auto rowe::schema<rowe::ros::pose_with_covariance> =
    rowe::fields<&rowe::ros::pose_with_covariance::pose, &rowe::ros::pose_with_covariance::covariance>{}
        .type("geometry_msgs/PoseWithCovariance");

template <> inline constexpr auto rowe::schema<rowe::ros::pose_stamped> =
    rowe::fields<&rowe::ros::pose_stamped::header, &rowe::ros::pose_stamped::pose>{}
        .type("geometry_msgs/PoseStamped");

template <> inline constexpr auto rowe::schema<rowe::ros::twist> =
    rowe::fields<&rowe::ros::twist::linear, &rowe::ros::twist::angular>{}.type("geometry_msgs/Twist");

template <> inline constexpr auto rowe::schema<rowe::ros::twist_with_covariance> =
    rowe::fields<&rowe::ros::twist_with_covariance::twist, &rowe::ros::twist_with_covariance::covariance>{}
        .type("geometry_msgs/TwistWithCovariance");

template <> inline constexpr auto rowe::schema<rowe::ros::odometry> =
    rowe::fields<&rowe::ros::odometry::header, &rowe::ros::odometry::child_frame_id, &rowe::ros::odometry::pose,
                 &rowe::ros::odometry::twist>{}.type("nav_msgs/Odometry");

template <> inline constexpr auto rowe::schema<rowe::ros2::time> =
    rowe::fields<rowe::field<&rowe::ros2::time::sec, "sec", "secs">,
                 rowe::field<&rowe::ros2::time::nanosec, "nanosec", "nsecs">>{}.type("builtin_interfaces/msg/Time");

template <> inline constexpr auto rowe::schema<rowe::ros2::header> =
    rowe::fields<&rowe::ros2::header::stamp, &rowe::ros2::header::frame_id>{}.type("std_msgs/msg/Header");

template <> inline constexpr auto rowe::schema<rowe::ros2::pose_stamped> =
    rowe::fields<&rowe::ros2::pose_stamped::header, &rowe::ros2::pose_stamped::pose>{}
        .type("geometry_msgs/msg/PoseStamped");

template <> inline constexpr auto rowe::schema<rowe::ros2::odometry> =
    rowe::fields<&rowe::ros2::odometry::header, &rowe::ros2::odometry::child_frame_id,
                 &rowe::ros2::odometry::pose, &rowe::ros2::odometry::twist>{}.type("nav_msgs/msg/Odometry");
// clang-format on
