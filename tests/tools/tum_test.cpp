// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/tum.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace rowe::tools {
namespace tum_test {
namespace {

tum_pose only_pose(const std::string& text) {
  const tum_file file = read_tum(text);
  EXPECT_EQ(file.fault.what, "") << text;
  return file.poses.empty() ? tum_pose{} : file.poses.front();
}

std::int64_t time_of(const std::string& text) { return only_pose(text + " 0 0 0 0 0 0 1").time_ns; }

TEST(tum, reads_poses_between_comments_and_empty_lines) {
  const tum_file file = read_tum("# ground truth\n\n1.5 1 2 3 0.1 0.2 0.3 0.9\n  # indented\n\t2 -1\t-2 -3e0 "
                                 "0 0 0 1 \r\n3 0 0 0 0 0 0 1");
  ASSERT_EQ(file.fault.what, "");
  ASSERT_EQ(file.poses.size(), 3U);
  EXPECT_EQ(file.poses[0].time_ns, 1'500'000'000);
  EXPECT_EQ(file.poses[0].position, (std::array{1.0, 2.0, 3.0}));
  EXPECT_EQ(file.poses[0].orientation, (std::array{0.1, 0.2, 0.3, 0.9}));
  EXPECT_EQ(file.poses[1].position, (std::array{-1.0, -2.0, -3.0}));
}

TEST(tum, reads_doubles_exactly) {
  const tum_pose pose = only_pose("0 0.1 4.9406564584124654e-324 1.7976931348623157e308 -0.0 "
                                  "2.2250738585072011e-308 9007199254740993 1e23");
  EXPECT_EQ(pose.position[0], 0.1);
  EXPECT_EQ(pose.position[1], std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(pose.position[2], std::numeric_limits<double>::max());
  EXPECT_TRUE(std::signbit(pose.orientation[0]));
  EXPECT_EQ(pose.orientation[1], 2.2250738585072011e-308);
  EXPECT_EQ(pose.orientation[2], 9007199254740992.0);
  EXPECT_EQ(pose.orientation[3], 1e23);
}

TEST(tum, keeps_times_to_the_nanosecond) {
  EXPECT_EQ(time_of("0"), 0);
  EXPECT_EQ(time_of("1305031098.6659"), 1305031098'665900000);
  EXPECT_EQ(time_of("1305031098.665900001"),
            1305031098'665900001); // a double cannot tell it from the one above
  EXPECT_EQ(time_of("4294967295.999999999"), 4294967295'999999999);
  EXPECT_EQ(time_of(".000000001"), 1);
  EXPECT_EQ(time_of("0012.5"), 12'500000000);
}

TEST(tum, reads_times_in_scientific_notation) {
  EXPECT_EQ(time_of("1.305031098665899992e+09"), 1305031098'665899992);
  EXPECT_EQ(time_of("1305031098665900001e-9"), 1305031098'665900001);
  EXPECT_EQ(time_of("1E3"), 1000'000000000);
  EXPECT_EQ(time_of("0e300"), 0);
}

TEST(tum, rounds_times_below_the_nanosecond) {
  EXPECT_EQ(time_of("1.0000000004999"), 1'000000000);
  EXPECT_EQ(time_of("1.0000000005"), 1'000000001);
  EXPECT_EQ(time_of("5e-10"), 1);
  EXPECT_EQ(time_of("5e-11"), 0);
}

TEST(tum, names_the_line_and_the_field_of_what_is_wrong) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  const struct {
    const char* line;
    const char* says;
  } cases[] = {
      {"2 0 0 0 0 0 1", "7 fields where a pose has 8"},
      {"2 0 0 0 0 0 0 1 0", "9 fields where a pose has 8"},
      {"2 0 abc 0 0 0 0 1", "field 3 (ty) is 'abc'"},
      {"2 0 0 0 0 0 0 1,", "field 8 (qw) is '1,'"},
      {"2 nan 0 0 0 0 0 1", "field 2 (tx) is 'nan'"},
      {"2 0 0 0 -inf 0 0 1", "field 5 (qx) is '-inf'"},
      {"2 0 0 1e400 0 0 0 1", "field 4 (tz) is '1e400'"},
      {"2 0 0 0 0 0 0 0x1", "field 8 (qw) is '0x1'"},
      {"2 +1 0 0 0 0 0 1", "field 2 (tx) is '+1'"},
      {"0.999 0 0 0 0 0 0 1", "lies before the pose above"},
      {"-2 0 0 0 0 0 0 1", "out of range"},
      {"4294967296 0 0 0 0 0 0 1", "out of range"},
      {"4294967295.9999999999 0 0 0 0 0 0 1", "out of range"},
      {"1e300 0 0 0 0 0 0 1", "out of range"},
      {"2 \x1b[2J 0 0 0 0 0 1", "'\\u001b[2J'"},
  };
  for (const auto& one : cases) {
    const tum_file file = read_tum("# a comment\n" + good + one.line + "\n" + good);
    EXPECT_EQ(file.fault.line, 3U) << one.line;
    EXPECT_NE(file.fault.what.find(one.says), std::string::npos) << one.line << ": " << file.fault.what;
  }
}

TEST(tum, accepts_two_poses_of_one_time) {
  EXPECT_EQ(read_tum("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").poses.size(), 2U);
}

TEST(tum, refuses_a_file_without_a_pose) {
  for (const char* text : {"", "\n\n", "# nothing\n"}) EXPECT_NE(read_tum(text).fault.what, "") << text;
}

TEST(tum, refuses_a_file_that_cannot_be_read) {
  EXPECT_NE(read_tum_file("/nowhere/at/all").fault.what, "");
  EXPECT_NE(read_tum_file("/").fault.what, "");
}

} // namespace
} // namespace tum_test
} // namespace rowe::tools
