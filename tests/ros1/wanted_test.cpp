// SPDX-License-Identifier: Apache-2.0
#include "tools/ros1/wanted.hpp"

#include <gtest/gtest.h>

namespace rowe::ros1 {
namespace wanted_test {
namespace {

TEST(wanted_names, are_names_or_patterns) {
  wanted_names names;
  EXPECT_EQ(names.set({"/tf", "odom", "/camera/*", "/arm[12]/?", "*/info"}), "");
  for (const char* const name : {"/tf", "/odom", "/camera/a/b", "/arm1/x", "/a/info"})
    EXPECT_TRUE(names.match(name)) << name;
  for (const char* const name : {"/tf2", "odom", "/camera", "/arm3/x", "/arm1/xy"})
    EXPECT_FALSE(names.match(name)) << name;
  EXPECT_TRUE(names.names("/odom"));
  EXPECT_FALSE(names.names("/camera/a"));
}

TEST(wanted_names, may_say_their_types) {
  wanted_names names;
  EXPECT_EQ(names.set({"/cmd_vel=geometry_msgs/msg/Twist", "/a/*=std_msgs/String", "/b"}), "");
  EXPECT_EQ(names.type_of("/cmd_vel"), "geometry_msgs/Twist");
  EXPECT_EQ(names.type_of("/a/x"), "std_msgs/String");
  EXPECT_EQ(names.type_of("/b"), "");
}

TEST(wanted_names, that_make_no_sense_are_refused) {
  EXPECT_EQ(wanted_names{}.set({"/a=String"}), "'String' is no type; it reads package/Name");
  EXPECT_EQ(wanted_names{}.set({""}), "a name or pattern is empty");
}

} // namespace
} // namespace wanted_test
} // namespace rowe::ros1
