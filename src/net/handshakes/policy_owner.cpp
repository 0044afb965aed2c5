// SPDX-License-Identifier: Apache-2.0
#include "net/handshakes/policy_owner.hpp"

#include <ifaddrs.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <span>

namespace rowe::net {

policy_owner::policy_owner(const listen_options& options, const socket_address& bound) {
  for (const std::string_view one : options.allow_origins) texts_.emplace_back(one);
  const std::size_t origins = texts_.size();
  for (const std::string_view one : options.subprotocols) texts_.emplace_back(one);
  const std::size_t subprotocols = texts_.size() - origins;
  for (const std::string_view one : options.allow_hosts) texts_.emplace_back(one);
  policy_.secure = !options.tls.certificate.empty();
  if (options.insecure || policy_.secure) add_own_names();

  views_.assign(texts_.begin(), texts_.end());
  const std::span<const std::string_view> all{views_};
  policy_.port = port_of(bound);
  policy_.lenient = options.lenient_handshake;
  policy_.origins = all.first(origins);
  policy_.subprotocols = all.subspan(origins, subprotocols);
  policy_.hosts = all.subspan(origins + subprotocols);
  policy_.any_host = std::find(policy_.hosts.begin(), policy_.hosts.end(), "*") != policy_.hosts.end();
}

// Adds the host's name, plain and as in multicast DNS, and each of its addresses as in a URL.
void policy_owner::add_own_names() {
  char name[HOST_NAME_MAX + 1] = {};
  if (::gethostname(name, sizeof name - 1) == 0 && name[0]) {
    texts_.emplace_back(name);
    texts_.emplace_back(std::string{name} + ".local");
  }
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return; // then by name alone
  for (const ifaddrs* one = list; one; one = one->ifa_next) {
    const auto address = address_of(one->ifa_addr);
    if (!address) continue;
    char text[address_text_bytes_max];
    const std::string host{write_host(text, *address)};
    const bool brackets = address->storage.ss_family == AF_INET6;
    if (!host.empty()) texts_.push_back(brackets ? '[' + host + ']' : host);
  }
  ::freeifaddrs(list);
}

} // namespace rowe::net
