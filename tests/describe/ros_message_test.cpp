// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <rowe/types.hpp>

#include "describe/robot.hpp"

namespace ros_message_test {
namespace {

struct inner {
  double x = 0;
};
struct maybe {
  std::optional<double> x;
};
struct table {
  std::array<std::array<float, 2>, 2> rows{};
};
struct holes {
  std::array<std::optional<int>, 2> list{};
};
struct renamed {
  double x = 0;
};
struct nameless {
  std::array<inner, 2> parts{};
};
struct impostor {
  double y = 0;
};
struct two_of_a_name {
  rowe::ros::point a;
  impostor b;
};
struct deep {
  maybe middle;
};
struct empty {};

} // namespace
} // namespace ros_message_test

// clang-format off
template <> inline constexpr auto rowe::schema<ros_message_test::inner> =
    rowe::fields<&ros_message_test::inner::x>{};
template <> inline constexpr auto rowe::schema<ros_message_test::maybe> =
    rowe::fields<&ros_message_test::maybe::x>{}.type("test/Maybe");
template <> inline constexpr auto rowe::schema<ros_message_test::table> =
    rowe::fields<&ros_message_test::table::rows>{}.type("test/Table");
template <> inline constexpr auto rowe::schema<ros_message_test::holes> =
    rowe::fields<&ros_message_test::holes::list>{}.type("test/Holes");
template <> inline constexpr auto rowe::schema<ros_message_test::renamed> =
    rowe::fields<rowe::field<&ros_message_test::renamed::x, "x y">>{}.type("test/Renamed");
template <> inline constexpr auto rowe::schema<ros_message_test::nameless> =
    rowe::fields<&ros_message_test::nameless::parts>{}.type("test/Nameless");
template <> inline constexpr auto rowe::schema<ros_message_test::impostor> =
    rowe::fields<&ros_message_test::impostor::y>{}.type("geometry_msgs/msg/Point");
template <> inline constexpr auto rowe::schema<ros_message_test::two_of_a_name> =
    rowe::fields<&ros_message_test::two_of_a_name::a, &ros_message_test::two_of_a_name::b>{}.type("test/Two");
template <> inline constexpr auto rowe::schema<ros_message_test::deep> =
    rowe::fields<&ros_message_test::deep::middle>{}.type("test/a bad name");
template <> inline constexpr auto rowe::schema<ros_message_test::empty> = rowe::fields<>{}.type("std_msgs/Empty");
// clang-format on

namespace rowe {
namespace ros_message_test {
using namespace ::ros_message_test;
namespace {

const std::string line = "\n" + std::string(80, '=') + "\n";

TEST(ros_message, is_spelt_as_ros_prints_twist) {
  EXPECT_EQ(ros_message<ros::twist>().text, "geometry_msgs/Vector3 linear\n"
                                            "geometry_msgs/Vector3 angular\n" +
                                                line +
                                                "MSG: geometry_msgs/Vector3\n"
                                                "float64 x\n"
                                                "float64 y\n"
                                                "float64 z\n");
}

TEST(ros_message, is_spelt_as_ros_prints_odometry) {
  EXPECT_EQ(ros_message<ros::odometry>().text, "std_msgs/Header header\n"
                                               "string child_frame_id\n"
                                               "geometry_msgs/PoseWithCovariance pose\n"
                                               "geometry_msgs/TwistWithCovariance twist\n" +
                                                   line +
                                                   "MSG: std_msgs/Header\n"
                                                   "uint32 seq\n"
                                                   "time stamp\n"
                                                   "string frame_id\n" +
                                                   line +
                                                   "MSG: geometry_msgs/PoseWithCovariance\n"
                                                   "geometry_msgs/Pose pose\n"
                                                   "float64[36] covariance\n" +
                                                   line +
                                                   "MSG: geometry_msgs/Pose\n"
                                                   "geometry_msgs/Point position\n"
                                                   "geometry_msgs/Quaternion orientation\n" +
                                                   line +
                                                   "MSG: geometry_msgs/Point\n"
                                                   "float64 x\n"
                                                   "float64 y\n"
                                                   "float64 z\n" +
                                                   line +
                                                   "MSG: geometry_msgs/Quaternion\n"
                                                   "float64 x\n"
                                                   "float64 y\n"
                                                   "float64 z\n"
                                                   "float64 w\n" +
                                                   line +
                                                   "MSG: geometry_msgs/TwistWithCovariance\n"
                                                   "geometry_msgs/Twist twist\n"
                                                   "float64[36] covariance\n" +
                                                   line +
                                                   "MSG: geometry_msgs/Twist\n"
                                                   "geometry_msgs/Vector3 linear\n"
                                                   "geometry_msgs/Vector3 angular\n" +
                                                   line +
                                                   "MSG: geometry_msgs/Vector3\n"
                                                   "float64 x\n"
                                                   "float64 y\n"
                                                   "float64 z\n");
}

TEST(ros_message, calls_types_of_ros_2_as_their_texts_do) {
  EXPECT_EQ(ros_message<ros2::header>().text, "builtin_interfaces/Time stamp\n"
                                              "string frame_id\n" +
                                                  line +
                                                  "MSG: builtin_interfaces/Time\n"
                                                  "int32 sec\n"
                                                  "uint32 nanosec\n");
}

TEST(ros_message, has_what_is_written_for_enums_times_and_lists) {
  const std::string text = ros_message<robot::report>().text;
  EXPECT_EQ(text.substr(0, text.find(line)), "std_msgs/Header header\n"
                                             "string mode # off, manual, auto\n"
                                             "uint8 wanted # off=0, manual=1, auto=7\n"
                                             "int64 uptime # milliseconds\n"
                                             "float64 born # seconds since 1970\n"
                                             "string serial\n"
                                             "float32[3] axes\n"
                                             "geometry_msgs/Point[] path\n"
                                             "bool moving\n");
}

TEST(ros_message, may_be_empty) {
  const ros_text none = ros_message<empty>();
  EXPECT_TRUE(none);
  EXPECT_EQ(none.text, "");
}

TEST(ros_message, says_why_there_is_none) {
  const auto reason = [](const ros_text& r) {
    EXPECT_FALSE(r);
    EXPECT_EQ(r.text, "");
    return r.reason;
  };
  EXPECT_EQ(reason(ros_message<maybe>()), R"(the member "x" is optional, which ROS does not have)");
  EXPECT_EQ(reason(ros_message<holes>()), R"(the member "list[]" is optional, which ROS does not have)");
  EXPECT_EQ(reason(ros_message<table>()),
            R"(the member "rows[]" is an array within an array, which ROS does not have)");
  EXPECT_EQ(reason(ros_message<renamed>()),
            R"(the member "x y" has a name that is none in ROS; letters, digits and _ are allowed)");
  EXPECT_EQ(reason(ros_message<inner>()),
            R"(the type has no name; give its schema one: .type("package/Name"))");
  EXPECT_EQ(reason(ros_message<nameless>()),
            R"(the member "parts[]" is of a type that has no name; give its )"
            R"(schema one: .type("package/Name"))");
  EXPECT_EQ(reason(ros_message<deep>()), R"(the type is called "test/a bad name", which is no name in ROS; )"
                                         R"(give its schema one: .type("package/Name"))");
  EXPECT_EQ(reason(ros_message<two_of_a_name>()),
            R"(the member "b" is of a type called "geometry_msgs/Point", as another type is)");
  EXPECT_EQ(reason(ros_message<ros::time>()),
            R"(the type "std_msgs/Time" is built into ROS 1 and no message)");
}

} // namespace
} // namespace ros_message_test
} // namespace rowe
