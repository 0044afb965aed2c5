// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/network/announced.hpp"

#include <gtest/gtest.h>

#include <random>

namespace rowe::tools {
namespace announced_test {
namespace {

announced_robots of(const std::vector<std::string>& lines) {
  announced_robots found;
  for (const std::string& line : lines) found.add(line);
  return found;
}

std::string answer(const std::string& name, const std::string& host, const std::string& address,
                   const std::string& port, const std::string& texts) {
  return "=;eth0;IPv4;" + name + ";_rowe._tcp;local;" + host + ";" + address + ";" + port + ";" + texts;
}

TEST(announced, reads_what_avahi_browse_prints) {
  const auto found = of({"+;eth0;IPv4;ang-01;_rowe._tcp;local",
                         answer("ang-01", "ang-01.local", "192.168.1.5", "8443",
                                R"("api=rowe.v1" "name=ang-01" "path=/ui/" "scheme=https")")});
  ASSERT_EQ(found.all().size(), 1U);
  const announced_robot& one = found.all()[0];
  EXPECT_EQ(one.service, "ang-01");
  EXPECT_EQ(one.url(), "https://ang-01.local:8443/ui/");
  EXPECT_EQ(one.addresses, std::vector<std::string>{"192.168.1.5"});
  EXPECT_EQ(one.text("api"), "rowe.v1");
  EXPECT_EQ(one.text("none"), "");
  EXPECT_EQ(found.unreadable(), 0U);
}

TEST(announced, undoes_escapes) {
  const auto found = of({answer(R"(ang\03201\.\\ \195\164\059)", "a.local", "10.0.0.1", "1",
                                R"("a=say \"hi\"" "b=back\\slash" "c" "d=x;y=\010" "" "e=\999")")});
  ASSERT_EQ(found.all().size(), 1U);
  EXPECT_EQ(found.all()[0].service, "ang 01.\\ \xc3\xa4;");
  const std::vector<std::pair<std::string, std::string>> texts{
      {"a", "say \"hi\""}, {"b", "back\\slash"}, {"c", ""}, {"d", "x;y=\n"}, {"", ""}, {"e", "999"}};
  EXPECT_EQ(found.all()[0].texts, texts);
}

// What avahi-browse 0.8 printed of a service that was published with such a name and such texts.
TEST(announced, undoes_the_escapes_of_avahi_itself) {
  const auto found =
      of({R"(=;d0;IPv4;a\059b\032\034c\034\032\195\164\.\\d;_rowe._tcp;local;vm.local;192.168.77.5;81;)"
          R"("path=/ui" "n=1\0102" "x=y;\"z\"\\ \195\164")"});
  ASSERT_EQ(found.all().size(), 1U);
  EXPECT_EQ(found.all()[0].service, "a;b \"c\" \xc3\xa4.\\d");
  EXPECT_EQ(found.all()[0].text("n"), "1\n2");
  EXPECT_EQ(found.all()[0].text("x"), "y;\"z\"\\ \xc3\xa4");
}

TEST(announced, one_robot_on_several_networks_is_one) {
  const auto found =
      of({answer("a", "a.local", "192.168.1.5", "8443", ""), answer("a", "a.local", "fd00::5", "8443", ""),
          answer("a", "a.local", "fe80::5", "8443", ""), answer("a", "a.local", "192.168.1.5", "8443", ""),
          answer("a", "b.local", "192.168.1.6", "8443", "")});
  ASSERT_EQ(found.all().size(), 2U);
  EXPECT_EQ(found.all()[0].addresses, (std::vector<std::string>{"192.168.1.5", "fd00::5"}));
}

TEST(announced, what_is_no_host_port_or_address_is_counted_and_left_out) {
  const auto found =
      of({answer("a", "a.local/evil?", "10.0.0.1", "1", ""), answer("a", "", "10.0.0.1", "1", ""),
          answer("a", "a.local", "10.0.0.1", "0", ""), answer("a", "a.local", "10.0.0.1", "65536", ""),
          answer("a", "a.local", "10.0.0.1", "x", ""), answer("a", "a.local", "somewhere", "1", ""),
          "=;eth0;IPv4;a", "=", R"(=;e;I;a;_rowe._tcp;local;a\027[2J.local;10.0.0.1;1;)"});
  EXPECT_TRUE(found.all().empty());
  EXPECT_EQ(found.unreadable(), 9U);
}

TEST(announced, a_url_is_made_of_nothing_but_a_path) {
  const auto url = [](const std::string& texts) {
    return of({answer("a", "a.local", "10.0.0.1", "1", texts)}).all().at(0).url();
  };
  EXPECT_EQ(url(R"("path=/a b")"), "https://a.local:1/");
  EXPECT_EQ(url(R"("path=@evil.example/")"), "https://a.local:1/");
  EXPECT_EQ(url(R"("path=/\027")"), "https://a.local:1/");
  EXPECT_EQ(url(R"("scheme=javascript")"), "https://a.local:1/");
  EXPECT_EQ(url(R"("scheme=http")"), "http://a.local:1/");
}

TEST(announced, an_end_of_robots_is_kept) {
  announced_robots found;
  for (std::size_t one = 0; one < announced_robots::robots_max + 7; ++one)
    found.add(answer("r" + std::to_string(one), "a.local", "10.0.0.1", "1", ""));
  EXPECT_EQ(found.all().size(), announced_robots::robots_max);
  EXPECT_EQ(found.left_out(), 7U);
}

TEST(announced, random_lines_yield_valid_urls_or_nothing) {
  constexpr unsigned seed = 20261125;
  const std::vector<std::string> pieces{"=", ";",      "\\",       "\"",  "0", "1", "032",
                                        "a", ".local", "10.0.0.1", "443", "/", "é"};
  std::mt19937 random{seed};
  const std::string whole = answer("a", "a.local", "10.0.0.1", "443", R"("path=/" "x=y")");
  announced_robots found;
  for (int round = 0; round < 20000; ++round) {
    std::string line = whole;
    for (unsigned change = random() % 4; change > 0; --change)
      line.replace(random() % line.size(), random() % 3, pieces[random() % pieces.size()]);
    found.add(line);
  }
  EXPECT_GT(found.unreadable(), 1000U) << "seed " << seed;
  EXPECT_GT(found.all().size(), 100U);
  for (const announced_robot& one : found.all()) {
    const std::string url = one.url();
    EXPECT_TRUE(url.starts_with("https://")) << url;
    EXPECT_EQ(url.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789:/.-"), url.npos) << url;
  }
}

} // namespace
} // namespace announced_test
} // namespace rowe::tools
