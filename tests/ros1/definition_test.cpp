// SPDX-License-Identifier: Apache-2.0
#include "tools/ros1/definition.hpp"

#include <gtest/gtest.h>

#include "tools/ros1/md5.hpp"

namespace rowe::ros1 {
namespace definition_test {
namespace {

// As a publisher sends it.
const std::string odometry =
    "# An estimate.\n"
    "Header header\n"
    "string child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n"
    "\n================================================================================\n"
    "MSG: std_msgs/Header\n"
    "uint32 seq # consecutive\n"
    "time stamp\n"
    "string frame_id\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/PoseWithCovariance\n"
    "Pose pose\n"
    "float64[36] covariance\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/Pose\n"
    "Point position\r\n"
    "Quaternion orientation\r\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/Point\n"
    "float64 x\nfloat64 y\nfloat64 z\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/Quaternion\n"
    "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/TwistWithCovariance\n"
    "Twist twist\n"
    "float64[36] covariance\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/Twist\n"
    "Vector3  linear\n"
    "Vector3  angular\n"
    "\n================================================================================\n"
    "MSG: geometry_msgs/Vector3\n"
    "float64 x\nfloat64 y\nfloat64 z\n";

message_type_ptr read(const std::string& text, std::string& why) {
  return read_message("a/T", sections_of("a/T", text), why);
}

std::string fault_of(const std::string& text) {
  std::string why;
  EXPECT_EQ(read(text, why), nullptr) << text;
  return why;
}

// The sums are those that ROS's own packages have.
TEST(definition, has_the_md5sum_of_ros) {
  std::string why;
  const auto type = read_message("nav_msgs/Odometry", sections_of("nav_msgs/Odometry", odometry), why);
  ASSERT_TRUE(type) << why;
  EXPECT_EQ(type->md5, "cd5e73d190d741a2f92e81eda573aca7");
  EXPECT_EQ(type->depth, 4U);
  EXPECT_EQ(type->fields[3].type->fields[0].type->md5, "9f195f881246fdfa2798d1d3eebca84a");
}

TEST(definition, counts_constants_in_its_md5sum_without_their_comments) {
  const std::string text =
      "GoalID goal_id\nuint8 status\nuint8 PENDING         = 0   # yet to be processed\nuint8 ACTIVE = 1\n"
      "uint8 PREEMPTED =2\nuint8 SUCCEEDED= 3\nuint8 ABORTED=4\nuint8 REJECTED=5\nuint8 PREEMPTING=6\n"
      "uint8 RECALLING=7\nuint8 RECALLED=8\nuint8 LOST=9\n#Allow for a text\nstring text\n"
      "\n================================================================================\n"
      "MSG: actionlib_msgs/GoalID\ntime stamp\nstring id\n";
  std::string why;
  const auto type =
      read_message("actionlib_msgs/GoalStatus", sections_of("actionlib_msgs/GoalStatus", text), why);
  ASSERT_TRUE(type) << why;
  EXPECT_EQ(type->md5, "d388f9b87b3c471f784434d671988d4a");
  EXPECT_EQ(type->fields.size(), 3U);
}

TEST(definition, takes_a_constant_text_to_the_end_of_its_line) {
  std::string why;
  const auto type = read("string A = b # c \nbool d\n", why);
  ASSERT_TRUE(type) << why;
  EXPECT_EQ(type->md5_text, "string A=b # c\nbool d");
}

TEST(definition, of_a_service_has_the_md5sum_of_ros) {
  const definition_source none = [](const std::string&) { return std::optional<std::string>{}; };
  std::string why;
  const auto set =
      read_service("std_srvs/SetBool", "bool data # e.g. on\n---\nbool success\nstring message\n", none, why);
  ASSERT_TRUE(set) << why;
  EXPECT_EQ(set->md5, "09fb03525b03e7ea1fd3992bafd87e16");
  const auto trigger = read_service("std_srvs/Trigger", "---\nbool success\nstring message", none, why);
  ASSERT_TRUE(trigger) << why;
  EXPECT_EQ(trigger->md5, "937c9679a518e3a18d831e57125ea522");
  EXPECT_FALSE(read_service("a/B", "bool data\n", none, why));
  EXPECT_EQ(why, "the definition of a/B has no line ---");
}

TEST(definition, is_sent_as_it_was_read) {
  std::string why;
  const auto type = read_message("nav_msgs/Odometry", sections_of("nav_msgs/Odometry", odometry), why);
  ASSERT_TRUE(type) << why;
  const auto again =
      read_message("nav_msgs/Odometry", sections_of("nav_msgs/Odometry", whole_text(*type)), why);
  ASSERT_TRUE(again) << why;
  EXPECT_EQ(again->md5, type->md5);
}

TEST(definition, that_is_wrong_says_where) {
  EXPECT_EQ(fault_of("bool\n"), "a type without a name");
  EXPECT_EQ(fault_of("bool 1a\n"), "a name that is no identifier");
  EXPECT_EQ(fault_of("bool a\nint8 a\n"), "two members of one name");
  EXPECT_EQ(fault_of("int8[x] a\n"), "an array whose length is no number");
  EXPECT_EQ(fault_of("int8] a\n"), "a ] without a [");
  EXPECT_EQ(fault_of("int8[99999999999] a\n"), "an array whose length is no number");
  EXPECT_EQ(fault_of("int8[16777217] a\n"), "an array of more than 16777216 elements");
  EXPECT_EQ(fault_of("Other a\n"), "there is no definition of a/Other");
  EXPECT_EQ(fault_of("../../etc/passwd a\n"), "a type whose name is none");
  EXPECT_EQ(fault_of("int8 = 1\n"), "a constant without a name");
}

TEST(definition, that_has_itself_as_a_member_is_refused) {
  EXPECT_EQ(fault_of("T[] again\n"), "the type a/T has itself as a member");
  EXPECT_EQ(fault_of("U b\n================================================================================\n"
                     "MSG: a/U\nT[] c\n"),
            "the type a/T has itself as a member");
}

TEST(definition, is_no_larger_than_its_bounds) {
  std::string members;
  for (int i = 0; i <= 1024; ++i) members += "int8 a" + std::to_string(i) + "\n";
  EXPECT_EQ(fault_of(members), "more than 1024 members");
  const std::string line = "\n" + std::string(80, '=') + "\nMSG: a/N";
  std::string deep = "N0 a\n";
  for (int i = 0; i < 40; ++i) deep += line + std::to_string(i) + "\nN" + std::to_string(i + 1) + " a\n";
  EXPECT_EQ(fault_of(deep), "the type a/N31 is nested deeper than 32 messages");
  std::string many;
  std::string sections;
  for (int i = 0; i < 600; ++i) {
    many += "N" + std::to_string(i) + " a" + std::to_string(i) + "\n";
    sections += line + std::to_string(i) + "\n";
  }
  EXPECT_EQ(fault_of(many + sections), "needs more than 512 types");
}

TEST(definition, of_a_type_goes_by_either_name) {
  EXPECT_EQ(plain_type_name("geometry_msgs/msg/Twist"), "geometry_msgs/Twist");
  EXPECT_EQ(plain_type_name("std_srvs/srv/SetBool"), "std_srvs/SetBool");
  EXPECT_EQ(plain_type_name("std_msgs/String"), "std_msgs/String");
  for (const char* const none : {"", "*", "String", "a/b/c", "../x", "a/", "/b"})
    EXPECT_EQ(plain_type_name(none), "");
}

TEST(base64, is_as_rfc_4648_has_it) {
  for (const auto& [bytes, text] : std::map<std::string, std::string>{
           {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}}) {
    EXPECT_EQ(base64_of(bytes), text);
    std::string back;
    EXPECT_TRUE(bytes_of_base64(text, back));
    EXPECT_EQ(back, bytes);
  }
  std::string back;
  for (const char* const none : {"Z", "Zg=", "Z===", "Zm9v Zg==", " Zm9", "Zm-v", "Zg==Zg=="})
    EXPECT_FALSE(bytes_of_base64(none, back)) << none;
}

} // namespace
} // namespace definition_test
} // namespace rowe::ros1
