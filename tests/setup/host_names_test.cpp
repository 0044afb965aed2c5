// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/setup/host_names.hpp"

#include <gtest/gtest.h>

#include "tools/rowe/network/host_addresses.hpp"

namespace rowe::tools {
namespace host_names_test {
namespace {

bool has(const std::vector<std::string>& list, std::string_view one) {
  return std::find(list.begin(), list.end(), one) != list.end();
}

TEST(host_names, a_robot_is_called_by_one_label) {
  for (const char* const good : {"a", "ang-01", "R2D2", "0"}) EXPECT_EQ(check_robot_name(good), "") << good;
  for (const std::string& bad : {std::string{}, std::string{"a.b"}, std::string{"-a"}, std::string{"a-"},
                                 std::string{"a b"}, std::string{"ä"}, std::string{"a\"b"},
                                 std::string{"a/b"}, std::string(robot_name_bytes_max + 1, 'a')}) {
    EXPECT_NE(check_robot_name(bad).find("1 to 48"), std::string::npos) << bad;
  }
}

TEST(host_names, what_may_be_a_top_level_domain_is_no_host) {
  for (const char* const bad : {"com", "dev", "robot", "xn--p1ai", "XN--P1AI"})
    EXPECT_NE(check_host_name(bad).find("top-level"), std::string::npos) << bad;
  for (const char* const good : {"localhost", "ang-01", "dev.local", "robot.example.com", "pi4"})
    EXPECT_EQ(check_host_name(good), "") << good;
}

TEST(host_names, what_is_no_name_of_dns_is_refused) {
  for (const std::string& bad : {std::string{}, std::string{"."}, std::string{"a..b"}, std::string{"a."},
                                 std::string{".local"}, std::string{"*.local"}, std::string{"a,IP:8.8.8.8"},
                                 std::string{"a_b.local"}, std::string(64, 'a') + ".local"}) {
    EXPECT_NE(check_host_name(bad), "") << bad;
  }
  std::string long_one = "a";
  while (long_one.size() < 254) long_one += ".a";
  EXPECT_NE(check_host_name(long_one), "");
}

TEST(host_names, addresses_are_numeric) {
  for (const char* const good : {"10.0.0.1", "::1", "fe80::1", "2001:db8::7"}) EXPECT_TRUE(is_address(good));
  for (const char* const bad : {"", "10.0.0", "10.0.0.256", "[::1]", "fe80::1%eth0", "localhost", "1"})
    EXPECT_FALSE(is_address(bad)) << bad;
  EXPECT_FALSE(is_address(std::string(100, '1')));
}

TEST(host_names, knows_private_ranges_to_their_last_address) {
  for (const char* const yes : {"10.0.0.0", "10.255.255.255", "172.16.0.0", "172.31.255.255", "192.168.9.9",
                                "127.9.9.9", "169.254.0.1", "fc00::", "fdff::1", "fe80::1", "febf::1", "::1"})
    EXPECT_TRUE(is_private(yes)) << yes;
  for (const char* const no :
       {"9.255.255.255", "11.0.0.0", "172.15.255.255", "172.32.0.0", "192.167.255.255", "192.169.0.0",
        "8.8.8.8", "fbff::1", "fe00::1", "fec0::1", "2001:db8::1", "::2"})
    EXPECT_FALSE(is_private(no)) << no;
}

TEST(host_names, a_robot_has_its_names_each_once_and_the_machines_addresses) {
  const host_names all = names_of_robot("ang-01", {"ang-01.local", "gate.example", "203.0.113.7"});
  EXPECT_TRUE(has(all.names, "localhost"));
  EXPECT_TRUE(has(all.names, "ang-01"));
  EXPECT_TRUE(has(all.names, "gate.example"));
  EXPECT_EQ(std::count(all.names.begin(), all.names.end(), "ang-01.local"), 1);
  EXPECT_TRUE(has(all.addresses, "127.0.0.1"));
  EXPECT_TRUE(has(all.addresses, "::1"));
  EXPECT_TRUE(has(all.addresses, "203.0.113.7"));
  for (const std::string& one : all.addresses) EXPECT_TRUE(is_address(one)) << one;
  for (const std::string& one : own_addresses()) EXPECT_TRUE(has(all.addresses, one)) << one;
}

TEST(host_names, a_name_of_letters_alone_is_left_to_local) {
  const host_names all = names_of_robot("robot", {});
  EXPECT_TRUE(has(all.names, "robot.local"));
  EXPECT_FALSE(has(all.names, "robot"));
}

TEST(host_names, of_addresses_only_public_ones_stand_in_the_constraints) {
  const std::string text = name_constraints({.names = {"localhost", "a-1.local", "gate.example"},
                                             .addresses = {"10.1.1.1", "203.0.113.7", "2001:db8::7"}});
  EXPECT_TRUE(text.starts_with("critical,permitted;DNS:local,"));
  EXPECT_EQ(text.find("10.1.1.1"), text.npos);
  EXPECT_EQ(text.find("a-1.local"), text.npos);
  EXPECT_NE(text.find(",permitted;DNS:gate.example,"), text.npos);
  EXPECT_NE(text.find(",permitted;IP:203.0.113.7/255.255.255.255,"), text.npos);
  EXPECT_TRUE(text.ends_with(",permitted;IP:2001:db8::7/ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff"));
}

} // namespace
} // namespace host_names_test
} // namespace rowe::tools
