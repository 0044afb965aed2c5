// SPDX-License-Identifier: Apache-2.0
#include "api/url.hpp"

#include <gtest/gtest.h>

namespace url_test {
namespace {

TEST(split_url, takes_a_url_apart) {
  struct {
    const char* url;
    bool secure;
    const char* host;
    int port;
    const char* path;
  } const rows[] = {{"ws://robot.local:9090/path?query=1", false, "robot.local", 9090, "/path?query=1"},
                    {"ws://10.0.0.7", false, "10.0.0.7", 80, "/"},
                    {"wss://robot.local/x", true, "robot.local", 443, "/x"},
                    {"wss://robot.local:8443", true, "robot.local", 8443, "/"},
                    {"ws://[::1]:8080/", false, "::1", 8080, "/"}};
  for (const auto& row : rows) {
    const auto parts = rowe::split_url(row.url);
    ASSERT_TRUE(parts) << row.url;
    EXPECT_EQ(parts->secure, row.secure) << row.url;
    EXPECT_EQ(parts->host, row.host) << row.url;
    EXPECT_EQ(parts->port, row.port) << row.url;
    EXPECT_EQ(parts->path, row.path) << row.url;
  }
}

TEST(split_url, refuses_everything_else_and_says_where_it_goes_wrong) {
  struct {
    const char* url;
    int at;
  } const wrong[] = {{"", 0},          {"http://a", 0},     {"wsss://a", 0},  {"ws://", 5},
                     {"wss://", 6},    {"ws://:80", 5},     {"ws://a:", 7},   {"ws://a:x", 7},
                     {"ws://a:0", 7},  {"ws://a:70000", 7}, {"ws://[::1", 5}, {"ws://a?q", 6},
                     {"ws://a/#f", 6}, {"ws://u@h/", 8},    {"ws://a:80x", 9}};
  for (const auto& [url, at] : wrong) {
    const auto parts = rowe::split_url(url);
    ASSERT_FALSE(parts) << url;
    EXPECT_EQ(parts.code(), rowe::errc::bad_url) << url;
    EXPECT_EQ(parts.error().value, at) << url;
  }
}

} // namespace
} // namespace url_test
