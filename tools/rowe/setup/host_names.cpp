// SPDX-License-Identifier: Apache-2.0
#include "host_names.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "../console.hpp"
#include "../network/host_addresses.hpp"

namespace rowe::tools {
namespace {

// network/mask, as OpenSSL has them.
constexpr std::array<std::string_view, 8> private_ranges{
    "10.0.0.0/255.0.0.0",      "172.16.0.0/255.240.0.0",
    "192.168.0.0/255.255.0.0", "127.0.0.0/255.0.0.0",
    "169.254.0.0/255.255.0.0", "fc00::/fe00::",
    "fe80::/ffc0::",           "::1/ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff"};

bool is_letter(char c) noexcept { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool is_label(std::string_view text) noexcept { return is_host_name(text) && text.find('.') == text.npos; }

// No top-level domain has a digit or a hyphen, but those in Punycode, which begin with "xn--" in either case.
bool may_be_top_level(std::string_view label) noexcept {
  const bool letters = std::all_of(label.begin(), label.end(), is_letter);
  return letters || label.substr(0, 4).ends_with("--");
}

union sockaddr_in4_or_6 {
  sockaddr any;
  sockaddr_in four;
  sockaddr_in6 six;
};

std::string machine_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

std::string without_brackets(std::string_view host) {
  return std::string{host.starts_with('[') ? host.substr(1, host.size() - 2) : host};
}

void add(std::vector<std::string>& to, std::string one) {
  if (std::find(to.begin(), to.end(), one) == to.end()) to.push_back(std::move(one));
}

// Whether `address` is in `range`, which is of the same family or not.
bool is_in(const std::string& address, std::string_view range) noexcept {
  const std::size_t slash = range.find('/');
  const std::string network{range.substr(0, slash)};
  const std::string mask{range.substr(slash + 1)};
  const bool six = address.find(':') != address.npos;
  if (six != (network.find(':') != network.npos)) return false;
  const int family = six ? AF_INET6 : AF_INET;
  std::array<unsigned char, 16> a{}, n{}, m{};
  if (::inet_pton(family, address.c_str(), a.data()) != 1) return false;
  if (::inet_pton(family, network.c_str(), n.data()) != 1) return false;
  if (::inet_pton(family, mask.c_str(), m.data()) != 1) return false;
  for (std::size_t at = 0; at < a.size(); ++at) {
    if ((a[at] & m[at]) != n[at]) return false;
  }
  return true;
}

// The address that packets to the Internet would have: of several networks, that of the default route, and
// not one for containers. Nothing is sent. Empty without such a route.
std::string source_address(bool six) noexcept {
  const int family = six ? AF_INET6 : AF_INET;
  const int socket = ::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return {};
  sockaddr_in4_or_6 there{}, here{};
  ::socklen_t size = six ? sizeof there.six : sizeof there.four;
  if (six) {
    there.six.sin6_family = AF_INET6;
    there.six.sin6_port = htons(9);
    ::inet_pton(AF_INET6, "2001:db8::1", &there.six.sin6_addr); // for documentation: nobody's
  } else {
    there.four.sin_family = AF_INET;
    there.four.sin_port = htons(9);
    ::inet_pton(AF_INET, "192.0.2.1", &there.four.sin_addr);
  }
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (::connect(socket, &there.any, size) == 0 && ::getsockname(socket, &here.any, &size) == 0) {
    const void* const address =
        six ? static_cast<const void*>(&here.six.sin6_addr) : static_cast<const void*>(&here.four.sin_addr);
    ::inet_ntop(family, address, text.data(), text.size());
  }
  ::close(socket);
  return text.data();
}

} // namespace

std::string check_robot_name(std::string_view name) {
  if (is_label(name) && name.size() <= robot_name_bytes_max) return {};
  return joined("the name of a robot has 1 to ", robot_name_bytes_max,
                " letters, digits and hyphens, none of these at its ends, not ", quoted(name));
}

std::string check_host_name(std::string_view name) {
  if (!is_host_name(name)) {
    return joined("a host's name has letters, digits and hyphens between dots, at most ", host_name_bytes_max,
                  " in all and ", label_bytes_max, " between dots, not ", quoted(name));
  }
  if (name.find('.') == name.npos && name != "localhost" && may_be_top_level(name)) {
    return joined(quoted(name), " may be a top-level domain, and the root would vouch for all names in it: ",
                  "give a name with a dot, a digit or a hyphen");
  }
  return {};
}

bool is_private(const std::string& address) noexcept {
  return std::any_of(private_ranges.begin(), private_ranges.end(),
                     [&](std::string_view range) { return is_in(address, range); });
}

std::string own_name() {
  const std::string name = machine_name();
  return name.substr(0, name.find('.'));
}

std::string own_local_name() {
  const std::string name = own_name();
  return is_label(name) ? name + ".local" : "";
}

std::vector<std::string> own_addresses() {
  std::vector<std::string> found{"127.0.0.1", "::1"};
  for (const std::string& host : hosts_reaching("::")) {
    add(found, without_brackets(host));
  }
  return found;
}

host_names names_of_robot(std::string_view name, const std::vector<std::string>& further) {
  host_names all{.names = {"localhost", joined(name, ".local")}, .addresses = own_addresses()};
  const std::string machine = machine_name();
  for (const std::string& one : {own_local_name(), machine, std::string{name}}) {
    if (check_host_name(one).empty()) add(all.names, one);
  }
  for (const std::string& one : further) add(is_address(one) ? all.addresses : all.names, one);
  return all;
}

std::string host_for_others(const std::string& listening) {
  if (!is_any(listening)) return in_brackets(listening);
  const bool six = listening == "::";
  if (std::string address = source_address(six); !address.empty()) return in_brackets(address);
  for (const std::string& host : hosts_reaching(listening)) {
    if (host.starts_with('[') == six) return host;
  }
  return {};
}

std::string name_constraints(const host_names& robot) {
  std::string text = "critical,permitted;DNS:local";
  for (const std::string& one : robot.names) {
    if (!one.ends_with(".local")) text.append(",permitted;DNS:").append(one);
  }
  for (const std::string_view range : private_ranges) text.append(",permitted;IP:").append(range);
  for (const std::string& one : robot.addresses) {
    if (is_private(one)) continue;
    const bool six = one.find(':') != one.npos;
    text.append(",permitted;IP:").append(one);
    text.append(six ? "/ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff" : "/255.255.255.255");
  }
  return text;
}

} // namespace rowe::tools
