// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tools/rowe/verbs/stop_ways.hpp"

namespace rowe::tools {
namespace stop_ways_test {
namespace {

TEST(stop_url, is_the_path_of_the_stop_behind_that_of_the_url) {
  EXPECT_EQ(stop_url("ws://robot"), "ws://robot/rowe/stop");
  EXPECT_EQ(stop_url("ws://robot:8080/"), "ws://robot:8080/rowe/stop");
  EXPECT_EQ(stop_url("ws://[fe80::1%eth0]:8080"), "ws://[fe80::1%eth0]:8080/rowe/stop");
  EXPECT_EQ(stop_url("ws://gate/robots/7/"), "ws://gate/robots/7/rowe/stop");
  EXPECT_EQ(stop_url("ws://robot/?key=a/b"), "ws://robot/rowe/stop?key=a/b");
}

TEST(stop_url, is_none_where_the_url_is_that_path) {
  EXPECT_EQ(stop_url("ws://robot/rowe/stop"), "");
  EXPECT_EQ(stop_url("ws://robot/rowe/stop/?x"), "");
}

} // namespace
} // namespace stop_ways_test
} // namespace rowe::tools
