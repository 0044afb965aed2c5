// SPDX-License-Identifier: Apache-2.0
#include "net/base/address.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>

#include <cstdio>
#include <cstring>

namespace rowe::net {

namespace {

// As the kernel does: the family says which structure is in the storage.
const sockaddr_in& v4(const socket_address& address) noexcept {
  return reinterpret_cast<const sockaddr_in&>(address.storage);
}
const sockaddr_in6& v6(const socket_address& address) noexcept {
  return reinterpret_cast<const sockaddr_in6&>(address.storage);
}

// The IPv4 address, also if it is written as IPv6.
std::optional<in_addr> v4_of(const socket_address& address) noexcept {
  if (address.storage.ss_family == AF_INET) return v4(address).sin_addr;
  if (address.storage.ss_family != AF_INET6 || !IN6_IS_ADDR_V4MAPPED(&v6(address).sin6_addr))
    return std::nullopt;
  in_addr four{};
  std::memcpy(&four, v6(address).sin6_addr.s6_addr + sizeof(in6_addr) - sizeof four, sizeof four);
  return four;
}

} // namespace

std::optional<socket_address> address_of(const sockaddr* raw) noexcept {
  if (!raw || (raw->sa_family != AF_INET && raw->sa_family != AF_INET6)) return std::nullopt;
  socket_address address;
  address.bytes = raw->sa_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
  std::memcpy(&address.storage, raw, address.bytes);
  return address;
}

std::optional<socket_address> numeric_address(std::string_view text, std::uint16_t port) noexcept {
  char host[INET6_ADDRSTRLEN + 32]; // and a scope
  if (text.empty() || text.size() >= sizeof host) return std::nullopt;
  if (std::memchr(text.data(), '\0', text.size())) return std::nullopt;
  std::memcpy(host, text.data(), text.size());
  host[text.size()] = '\0';

  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host, nullptr, &hints, &found) != 0) return std::nullopt;
  auto address = address_of(found->ai_addr);
  ::freeaddrinfo(found);
  if (address) set_port(*address, port);
  return address;
}

bool is_loopback(const socket_address& address) noexcept {
  if (const auto four = v4_of(address)) return ntohl(four->s_addr) >> 24 == 127;
  return address.storage.ss_family == AF_INET6 && IN6_IS_ADDR_LOOPBACK(&v6(address).sin6_addr);
}

std::uint16_t port_of(const socket_address& address) noexcept {
  return ntohs(address.storage.ss_family == AF_INET ? v4(address).sin_port : v6(address).sin6_port);
}

void set_port(socket_address& address, std::uint16_t port) noexcept {
  if (address.storage.ss_family == AF_INET)
    reinterpret_cast<sockaddr_in&>(address.storage).sin_port = htons(port);
  else
    reinterpret_cast<sockaddr_in6&>(address.storage).sin6_port = htons(port);
}

bool same_host(const socket_address& one, const socket_address& other) noexcept {
  if (one.storage.ss_family != other.storage.ss_family) return false;
  if (one.storage.ss_family == AF_INET) return v4(one).sin_addr.s_addr == v4(other).sin_addr.s_addr;
  return std::memcmp(&v6(one).sin6_addr, &v6(other).sin6_addr, sizeof(in6_addr)) == 0 &&
         v6(one).sin6_scope_id == v6(other).sin6_scope_id;
}

bool same_source(const socket_address& one, const socket_address& other) noexcept {
  const auto four = v4_of(one);
  const auto other_four = v4_of(other);
  if (four || other_four) return four && other_four && four->s_addr == other_four->s_addr;
  if (one.storage.ss_family != AF_INET6 || other.storage.ss_family != AF_INET6) return false;
  constexpr std::size_t network_bytes = 64 / 8;
  return std::memcmp(&v6(one).sin6_addr, &v6(other).sin6_addr, network_bytes) == 0 &&
         v6(one).sin6_scope_id == v6(other).sin6_scope_id;
}

std::uint64_t source_number(const socket_address& address) noexcept {
  if (const auto four = v4_of(address)) return four->s_addr;
  std::uint64_t network = 0;
  std::memcpy(&network, &v6(address).sin6_addr, sizeof network);
  return network ^ (std::uint64_t{v6(address).sin6_scope_id} << 32U);
}

std::string_view write_host(std::span<char> out, const socket_address& address) noexcept {
  const auto capacity = static_cast<socklen_t>(out.size());
  if (::getnameinfo(address.get(), address.bytes, out.data(), capacity, nullptr, 0, NI_NUMERICHOST) != 0)
    return {};
  return {out.data()};
}

std::string_view write_address(std::span<char> out, const socket_address& address) noexcept {
  char host[address_text_bytes_max];
  if (write_host(host, address).empty()) return {};
  const bool brackets = address.storage.ss_family == AF_INET6;
  const int bytes = std::snprintf(out.data(), out.size(), brackets ? "[%s]:%u" : "%s:%u", host,
                                  static_cast<unsigned>(port_of(address)));
  if (bytes < 0 || static_cast<std::size_t>(bytes) >= out.size()) return {};
  return {out.data(), static_cast<std::size_t>(bytes)};
}

} // namespace rowe::net
