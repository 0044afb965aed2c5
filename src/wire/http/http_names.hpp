// SPDX-License-Identifier: Apache-2.0
// Hosts and origins, and which of them are ours. For http_request.cpp. Pure functions; nothing allocates.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include "wire/http/http_request.hpp"

namespace rowe::wire {

struct authority {
  std::string_view host; // an IPv6 address with its brackets
  std::optional<std::uint16_t> port;
};

// Reads `host`, `host:port` or `[address]:port`; nothing if the text is none of them.
std::optional<authority> to_authority(std::string_view text) noexcept;
// Whether this is one of our names. A name without a port means our port.
bool is_ours(const authority& asked, const handshake_policy& policy) noexcept;
// Whether `origin` is our own page's: one of our names at our port, or the name in the request's Host.
bool is_own_origin(std::string_view origin, std::string_view host, const handshake_policy& policy) noexcept;
bool is_listed_origin(std::string_view origin, const handshake_policy& policy) noexcept;
bool begins_with_https(std::string_view origin) noexcept;
// Whether it is a page of the browser's own machine, which no network lies between.
bool is_loopback_origin(std::string_view origin) noexcept;

} // namespace rowe::wire
