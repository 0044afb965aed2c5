// SPDX-License-Identifier: Apache-2.0
#include "api/url.hpp"

#include <charconv>

namespace rowe {
namespace {

constexpr std::string_view plain = "ws://";
constexpr std::string_view secure = "wss://";
constexpr std::uint16_t secure_port = 443;

} // namespace

result<url_parts> split_url(std::string_view url) noexcept {
  const auto wrong_at = [&](std::string_view rest) {
    return error{errc::bad_url, static_cast<std::int64_t>(url.size() - rest.size())};
  };
  url_parts parts;
  parts.secure = url.starts_with(secure);
  if (!parts.secure && !url.starts_with(plain)) return wrong_at(url);
  if (parts.secure) parts.port = secure_port;
  std::string_view rest = url.substr(parts.secure ? secure.size() : plain.size());
  if (rest.starts_with('[')) {
    const auto end = rest.find(']');
    if (end == std::string_view::npos) return wrong_at(rest);
    parts.host = rest.substr(1, end - 1);
    rest.remove_prefix(end + 1);
  } else {
    const auto end = rest.find_first_of(":/?#");
    parts.host = rest.substr(0, end);
    rest.remove_prefix(parts.host.size());
  }
  if (parts.host.empty() || parts.host.find_first_of("@ ") != std::string_view::npos) return wrong_at(rest);
  if (rest.starts_with(':')) {
    rest.remove_prefix(1);
    const auto [end, failure] = std::from_chars(rest.data(), rest.data() + rest.size(), parts.port);
    if (failure != std::errc{} || parts.port == 0) return wrong_at(rest);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  if (!rest.empty()) {
    if (rest.front() != '/' || rest.find_first_of("# ") != std::string_view::npos) return wrong_at(rest);
    parts.path = rest;
  }
  return parts;
}

} // namespace rowe
