// SPDX-License-Identifier: Apache-2.0
#include "host_addresses.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "../arguments/values.hpp"
#include "../console.hpp"

namespace rowe::tools {
namespace {

struct list_free {
  void operator()(ifaddrs* list) const noexcept { ::freeifaddrs(list); }
};

bool is_label(std::string_view text) noexcept {
  if (text.empty() || text.size() > label_bytes_max || text.front() == '-' || text.back() == '-')
    return false;
  return std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-';
  });
}

std::optional<std::string> host_of(const ifaddrs& one) {
  const bool up = (one.ifa_flags & IFF_UP) != 0;
  const bool loopback = (one.ifa_flags & IFF_LOOPBACK) != 0;
  if (one.ifa_addr == nullptr || !up || loopback) return std::nullopt;
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (one.ifa_addr->sa_family == AF_INET) {
    const auto* const four = reinterpret_cast<const sockaddr_in*>(one.ifa_addr);
    ::inet_ntop(AF_INET, &four->sin_addr, text.data(), text.size());
  } else if (one.ifa_addr->sa_family == AF_INET6) {
    const auto* const six = reinterpret_cast<const sockaddr_in6*>(one.ifa_addr);
    if (IN6_IS_ADDR_LINKLOCAL(&six->sin6_addr)) return std::nullopt; // needs a zone, which URLs do not have
    ::inet_ntop(AF_INET6, &six->sin6_addr, text.data(), text.size());
  } else {
    return std::nullopt;
  }
  return in_brackets(text.data());
}

} // namespace

std::string in_brackets(std::string_view address) {
  const bool six = address.find(':') != address.npos;
  return six ? joined("[", address, "]") : std::string{address};
}

bool is_address(std::string_view text) noexcept {
  std::array<unsigned char, 16> bytes;
  std::array<char, INET6_ADDRSTRLEN> copy{};
  if (text.size() >= copy.size() || text.find('\0') != text.npos) return false;
  std::copy(text.begin(), text.end(), copy.begin());
  return ::inet_pton(AF_INET, copy.data(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, copy.data(), bytes.data()) == 1;
}

bool is_host_name(std::string_view text) noexcept {
  if (text.size() > host_name_bytes_max) return false;
  while (true) {
    const std::size_t dot = text.find('.');
    if (!is_label(text.substr(0, dot))) return false;
    if (dot == text.npos) return true;
    text.remove_prefix(dot + 1);
  }
}

bool is_any(std::string_view address) noexcept { return address == "0.0.0.0" || address == "::"; }

std::string host_for_here(std::string_view listening) {
  if (listening == "0.0.0.0") return "127.0.0.1";
  if (listening == "::") return "[::1]";
  return in_brackets(listening);
}

std::vector<std::string> hosts_reaching(std::string_view listening) {
  if (!is_any(listening)) return {in_brackets(listening)};
  ifaddrs* found = nullptr;
  if (::getifaddrs(&found) != 0) return {};
  const std::unique_ptr<ifaddrs, list_free> list{found};
  std::vector<std::string> hosts;
  for (const ifaddrs* one = list.get(); one != nullptr; one = one->ifa_next) {
    const auto host = host_of(*one);
    const bool four = host && host->front() != '[';
    if (host && (four || listening == "::")) hosts.push_back(*host);
  }
  return hosts;
}

std::string split_listen(const std::string& text, std::string& address, std::uint16_t& port) {
  constexpr std::int64_t port_max = 65535;
  const std::size_t colon = text.rfind(':');
  const auto number =
      colon == text.npos ? std::nullopt : integer_of(std::string_view{text}.substr(colon + 1));
  std::string_view host = std::string_view{text}.substr(0, colon == text.npos ? 0 : colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  if (!number || host.empty())
    return joined("--listen needs ADDR:PORT such as 0.0.0.0:8080, not ", quoted(text));
  if (*number < 0 || *number > port_max) {
    return joined("--listen: the port ", *number, " is out of range: 0 to ", port_max);
  }
  address = host;
  port = static_cast<std::uint16_t>(*number);
  return {};
}

} // namespace rowe::tools
