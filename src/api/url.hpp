// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/result.hpp>

namespace rowe {

// The parts of ws://HOST[:PORT][/PATH] or wss://HOST[:PORT][/PATH]; views into the text.
struct url_parts {
  std::string_view host;       // IPv6 without its brackets
  std::uint16_t port = 80;     // wss: 443
  bool secure = false;         // wss
  std::string_view path = "/"; // with its query
};

// Errors: bad_url (value: the position in the text where it goes wrong).
result<url_parts> split_url(std::string_view url) noexcept;

} // namespace rowe
