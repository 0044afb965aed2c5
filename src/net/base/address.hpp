// SPDX-License-Identifier: Apache-2.0
// Socket addresses: read from numeric text, compared, written. Nothing here asks a name server.
#pragma once
#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace rowe::net {

struct socket_address {
  sockaddr_storage storage{};
  socklen_t bytes = 0;

  const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&storage); }
  sockaddr* get() noexcept { return reinterpret_cast<sockaddr*>(&storage); }
};

// Enough for "[" + an IPv6 address with its scope + "]:65535".
inline constexpr std::size_t address_text_bytes_max = 96;

// Nothing if it is neither IPv4 nor IPv6.
std::optional<socket_address> address_of(const sockaddr* raw) noexcept;

// `text` is an IPv4 or IPv6 address, the latter with or without a scope ("fe80::1%eth0"); nothing for any
// other text. Set-up: may allocate.
std::optional<socket_address> numeric_address(std::string_view text, std::uint16_t port) noexcept;

bool is_loopback(const socket_address& address) noexcept;
std::uint16_t port_of(const socket_address& address) noexcept;
void set_port(socket_address& address, std::uint16_t port) noexcept;

// The same host, whatever the ports.
bool same_host(const socket_address& one, const socket_address& other) noexcept;
// Whether limits for one source count both as the same source. A host that has one IPv6 address of a /64 can
// have all of them, so a /64 is one source. An IPv4 address is one source, also if it is written as IPv6
// (::ffff:192.0.2.1).
bool same_source(const socket_address& one, const socket_address& other) noexcept;
// The same for the same source; of different ones mostly different.
std::uint64_t source_number(const socket_address& address) noexcept;

// "127.0.0.1:8080", "[::1]:8080"; empty when `out` is too small.
std::string_view write_address(std::span<char> out, const socket_address& address) noexcept;
// "127.0.0.1", "fe80::1%eth0": the host alone and no brackets, with a NUL behind it.
std::string_view write_host(std::span<char> out, const socket_address& address) noexcept;

} // namespace rowe::net
