// SPDX-License-Identifier: Apache-2.0
// What strangers announce by multicast DNS, as avahi-browse prints it. Required: whatever the lines are, a
// URL is a scheme, a host, a port and a path, and nothing else; no robot is there twice; what was not read is
// counted.
#include <cstdint>
#include <string>
#include <string_view>

#include "fuzz/require.hpp"
#include "tools/rowe/network/announced.hpp"
#include "tools/rowe/network/host_addresses.hpp"

namespace {

using namespace rowe::tools;
using rowe::fuzz::require;

void check(const announced_robot& one) {
  require(is_host_name(one.host) && one.port > 0, "a robot has a host and a port");
  const std::string url = one.url();
  const bool plain = url.starts_with("http://");
  require(plain || url.starts_with("https://"), "a URL is one of HTTP");
  const std::string authority = one.host + ":" + std::to_string(one.port) + "/";
  require(std::string_view{url}.substr(plain ? 7 : 8).starts_with(authority), "it leads to that host");
  for (const char c : url) require(c > 0x20 && c < 0x7f && c != '#' && c != '?' && c != '@', "it is plain");
  for (const std::string& address : one.addresses) require(is_address(address), "addresses are addresses");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text{reinterpret_cast<const char*>(data), size};
  announced_robots found;
  std::size_t answers = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    answers += line.starts_with('=') ? 1U : 0U;
    found.add(line);
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
  }
  require(found.all().size() + found.unreadable() + found.left_out() <= answers, "an answer counts once");
  for (const announced_robot& one : found.all()) {
    check(one);
    std::size_t same = 0;
    for (const announced_robot& other : found.all())
      same += one.service == other.service && one.host == other.host && one.port == other.port ? 1U : 0U;
    require(same == 1, "a robot is there once");
  }
  return 0;
}
