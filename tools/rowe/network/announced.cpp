// SPDX-License-Identifier: Apache-2.0
#include "announced.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "../arguments/values.hpp"
#include "../console.hpp"
#include "host_addresses.hpp"

namespace rowe::tools {
namespace {

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

// "ang\03201" is "ang 01": Avahi writes a byte as three decimal digits behind a backslash, and puts one
// before a dot, a quote or a backslash that is to be taken as it is.
std::string unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] != '\\' || at + 1 == text.size()) {
      plain += text[at];
      continue;
    }
    const std::string_view digits = text.substr(at + 1, 3);
    const auto number = digits.size() == 3 && std::all_of(digits.begin(), digits.end(), is_digit)
                            ? integer_of(digits)
                            : std::nullopt;
    plain += number && *number < 256 ? static_cast<char>(*number) : text[at + 1];
    at += number && *number < 256 ? 3U : 1U;
  }
  return plain;
}

// The strings of `"path=/" "name=ang 01"`; a quote inside has a backslash before it.
std::vector<std::string> quoted_in(std::string_view text) {
  std::vector<std::string> all;
  for (std::size_t at = text.find('"'); at != text.npos; at = text.find('"', at)) {
    const std::size_t begin = ++at;
    while (at < text.size() && text[at] != '"') at += text[at] == '\\' ? 2U : 1U;
    if (at >= text.size()) break;
    all.push_back(unescaped(text.substr(begin, at - begin)));
    ++at;
  }
  return all;
}

// Nothing where there are fewer. The last one is the rest, semicolons and all.
std::optional<std::array<std::string_view, 10>> fields_of(std::string_view line) noexcept {
  std::array<std::string_view, 10> fields;
  for (std::size_t at = 0; at + 1 < fields.size(); ++at) {
    const std::size_t end = line.find(';');
    if (end == line.npos) return std::nullopt;
    fields[at] = line.substr(0, end);
    line.remove_prefix(end + 1);
  }
  fields.back() = line;
  return fields;
}

// Of link-local IPv6 addresses only the machine knows the interface.
bool needs_zone(std::string_view address) noexcept {
  constexpr std::array<std::string_view, 4> first{"fe8", "fe9", "fea", "feb"};
  return std::any_of(first.begin(), first.end(), [&](std::string_view f) { return address.starts_with(f); });
}

bool is_path(std::string_view text) noexcept {
  constexpr std::string_view others = "/-._~%";
  return text.starts_with('/') && std::all_of(text.begin(), text.end(), [&](char c) {
           return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                  others.find(c) != others.npos;
         });
}

} // namespace

std::string_view announced_robot::text(std::string_view key) const noexcept {
  const auto found = std::find_if(texts.begin(), texts.end(), [&](const auto& t) { return t.first == key; });
  return found == texts.end() ? std::string_view{} : found->second;
}

std::string announced_robot::url() const {
  const std::string_view scheme = text("scheme") == "http" ? "http" : "https";
  const std::string_view path = is_path(text("path")) ? text("path") : "/";
  return joined(scheme, "://", host, ":", port, path);
}

void announced_robots::add(std::string_view line) {
  if (line.starts_with('=') && !add_answer(line)) ++unreadable_; // '+' and '-' say no address
}

// =;interface;protocol;name;type;domain;host;address;port;texts
bool announced_robots::add_answer(std::string_view line) {
  const auto fields = fields_of(line);
  if (!fields) return false;
  const std::string host = unescaped((*fields)[6]);
  const std::string address{(*fields)[7]};
  const auto port = integer_of((*fields)[8]);
  if (!is_host_name(host) || !is_address(address) || !port || *port < 1 || *port > 65535) return false;
  announced_robot one{.service = unescaped((*fields)[3]),
                      .host = host,
                      .port = static_cast<std::uint16_t>(*port),
                      .addresses = {},
                      .texts = {}};
  for (const std::string& text : quoted_in((*fields)[9])) {
    const std::size_t equals = text.find('=');
    one.texts.emplace_back(text.substr(0, equals), equals == text.npos ? "" : text.substr(equals + 1));
  }
  auto known = std::find_if(all_.begin(), all_.end(), [&](const announced_robot& other) {
    return other.service == one.service && other.host == one.host && other.port == one.port;
  });
  if (known == all_.end()) {
    if (all_.size() == robots_max) {
      ++left_out_;
      return true;
    }
    known = all_.insert(known, std::move(one));
  }
  const bool twice =
      std::find(known->addresses.begin(), known->addresses.end(), address) != known->addresses.end();
  if (!twice && !needs_zone(address)) known->addresses.push_back(address);
  return true;
}

} // namespace rowe::tools
