// SPDX-License-Identifier: Apache-2.0
#include "wire/http/http_names.hpp"

#include <algorithm>

#include "wire/http/http_fields.hpp"

namespace rowe::wire {
namespace {

constexpr std::string_view between = "://"; // scheme and authority

bool is_loopback_name(std::string_view host) noexcept {
  constexpr std::string_view names[] = {"localhost", "127.0.0.1", "[::1]"};
  return std::any_of(std::begin(names), std::end(names),
                     [host](std::string_view name) { return equal_ignoring_case(host, name); });
}

} // namespace

std::optional<authority> to_authority(std::string_view text) noexcept {
  const bool bracketed = text.starts_with('[');
  const std::size_t closing = text.find(']');
  if (bracketed && closing == std::string_view::npos) return std::nullopt;
  const std::size_t host_end = bracketed ? closing + 1 : std::min(text.find(':'), text.size());
  authority out{.host = text.substr(0, host_end), .port = std::nullopt};
  constexpr std::string_view never_in_a_host = "/?#@\\\" \t,";
  if (out.host.empty() || out.host.find_first_of(never_in_a_host) != std::string_view::npos)
    return std::nullopt;
  if (host_end == text.size()) return out;
  const auto port = text[host_end] == ':' ? to_number(text.substr(host_end + 1)) : std::nullopt;
  if (!port || *port == 0 || *port > 65535) return std::nullopt;
  out.port = static_cast<std::uint16_t>(*port);
  return out;
}

bool is_ours(const authority& asked, const handshake_policy& policy) noexcept {
  const bool at_our_port = !asked.port || *asked.port == policy.port;
  if (at_our_port && is_loopback_name(asked.host)) return true;
  return std::any_of(policy.hosts.begin(), policy.hosts.end(), [&](std::string_view entry) {
    const auto listed = to_authority(entry);
    return listed && equal_ignoring_case(asked.host, listed->host) &&
           (listed->port ? asked.port == listed->port : at_our_port);
  });
}

bool is_own_origin(std::string_view origin, std::string_view host, const handshake_policy& policy) noexcept {
  const std::size_t separator = origin.find(between);
  if (separator == std::string_view::npos) return false;
  const std::string_view scheme = origin.substr(0, separator);
  const bool encrypted = equal_ignoring_case(scheme, "https");
  if (!encrypted && (policy.secure || !equal_ignoring_case(scheme, "http"))) return false;
  const std::string_view rest = origin.substr(separator + between.size());
  auto page = to_authority(rest);
  if (!page) return false;
  if (equal_ignoring_case(rest, host)) return true;
  if (!page->port) page->port = encrypted ? 443 : 80;
  return is_ours(*page, policy);
}

bool is_listed_origin(std::string_view origin, const handshake_policy& policy) noexcept {
  return std::any_of(policy.origins.begin(), policy.origins.end(), [origin](std::string_view entry) {
    if (entry.ends_with('/')) entry.remove_suffix(1);
    return equal_ignoring_case(entry, origin);
  });
}

bool begins_with_https(std::string_view origin) noexcept {
  return equal_ignoring_case(origin.substr(0, origin.find(between)), "https");
}

bool is_loopback_origin(std::string_view origin) noexcept {
  const std::size_t separator = origin.find(between);
  if (separator == std::string_view::npos) return false;
  const auto page = to_authority(origin.substr(separator + between.size()));
  return page && is_loopback_name(page->host);
}

} // namespace rowe::wire
