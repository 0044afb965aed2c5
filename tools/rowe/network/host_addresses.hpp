// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

// How a browser on another machine would write the hosts behind a listening address: that address itself, or,
// of 0.0.0.0 and [::], those of all interfaces that are up. IPv6 in brackets; loopback and link-local ones
// are left out.
std::vector<std::string> hosts_reaching(std::string_view listening);

// Whether the text is an IPv4 or an IPv6 address.
bool is_address(std::string_view text) noexcept;

// Whether it is a name of DNS: labels of letters, digits and hyphens between dots.
bool is_host_name(std::string_view text) noexcept;
inline constexpr std::size_t label_bytes_max = 63; // RFC 1035
inline constexpr std::size_t host_name_bytes_max = 253;

// An address as URLs have it: IPv6 in brackets.
std::string in_brackets(std::string_view address);

// Whether an address means all interfaces.
bool is_any(std::string_view address) noexcept;

// "127.0.0.1" or "[::1]": how this machine itself reaches a listening address.
std::string host_for_here(std::string_view listening);

// Splits what --listen is given: ADDR:PORT, or [ADDR]:PORT for IPv6. Empty, or what is wrong with it.
std::string split_listen(const std::string& text, std::string& address, std::uint16_t& port);

} // namespace rowe::tools
