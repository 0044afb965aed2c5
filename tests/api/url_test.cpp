// SPDX-License-Identifier: Apache-2.0
#include "api/url.hpp"

#include <gtest/gtest.h>

namespace url_test {
namespace {

TEST(split_url, takes_a_url_apart) {
  const auto parts = rowe::split_url("ws://robot.local:9090/path?query=1");
  ASSERT_TRUE(parts);
  EXPECT_EQ(parts->host, "robot.local");
  EXPECT_EQ(parts->port, 9090);
  EXPECT_EQ(parts->path, "/path?query=1");
}

TEST(split_url, has_a_port_and_a_path_for_those_that_name_none) {
  const auto parts = rowe::split_url("ws://10.0.0.7");
  ASSERT_TRUE(parts);
  EXPECT_EQ(parts->port, 80);
  EXPECT_EQ(parts->path, "/");
}

TEST(split_url, knows_tls_by_its_scheme) {
  const auto parts = rowe::split_url("wss://robot.local/x");
  ASSERT_TRUE(parts);
  EXPECT_TRUE(parts->secure);
  EXPECT_EQ(parts->port, 443);
  EXPECT_EQ(rowe::split_url("wss://robot.local:8443")->port, 8443);
  EXPECT_FALSE(rowe::split_url("ws://robot.local")->secure);
  EXPECT_EQ(rowe::split_url("wss://").error().value, 6);
}

TEST(split_url, knows_addresses_of_ipv6_by_their_brackets) {
  const auto parts = rowe::split_url("ws://[::1]:8080/");
  ASSERT_TRUE(parts);
  EXPECT_EQ(parts->host, "::1");
  EXPECT_EQ(parts->port, 8080);
}

TEST(split_url, refuses_everything_else_and_says_where_it_goes_wrong) {
  struct {
    const char* url;
    int at;
  } const wrong[] = {
      {"", 0},         {"http://a", 0},  {"wsss://a", 0},  {"ws://", 5},        {"ws://:80", 5},
      {"ws://a:", 7},  {"ws://a:x", 7},  {"ws://a:0", 7},  {"ws://a:70000", 7}, {"ws://[::1", 5},
      {"ws://a?q", 6}, {"ws://a/#f", 6}, {"ws://u@h/", 8}, {"ws://a:80x", 9}};
  for (const auto& [url, at] : wrong) {
    const auto parts = rowe::split_url(url);
    ASSERT_FALSE(parts) << url;
    EXPECT_EQ(parts.code(), rowe::errc::bad_url) << url;
    EXPECT_EQ(parts.error().value, at) << url;
  }
}

} // namespace
} // namespace url_test
