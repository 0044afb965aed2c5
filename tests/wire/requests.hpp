// SPDX-License-Identifier: Apache-2.0
// Request headers for tests: right ones, and the same with one thing wrong.
#pragma once
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "wire/http/http_request.hpp"

namespace rowe::wire::test {

inline constexpr std::string_view known_subprotocols[] = {"rowe.v1", "foxglove.sdk.v1"};

inline handshake_policy policy_at(std::uint16_t port) {
  return {.port = port, .subprotocols = known_subprotocols};
}

// A request as lines; the ends are added.
inline std::string header(std::initializer_list<std::string_view> lines) {
  std::string out;
  for (const std::string_view line : lines) out.append(line).append("\r\n");
  return out + "\r\n";
}

// A right handshake, and the same with fields replaced by name, removed (empty) or added.
struct change {
  std::string_view name;
  std::string_view line;
};
inline std::string upgrade(std::initializer_list<change> changes = {},
                           std::string_view first = "GET /x?y=1 HTTP/1.1") {
  std::vector<std::pair<std::string_view, std::string_view>> lines = {
      {"Host", "Host: localhost:8080"},
      {"Upgrade", "Upgrade: websocket"},
      {"Connection", "Connection: keep-alive, Upgrade"},
      {"Key", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="},
      {"Version", "Sec-WebSocket-Version: 13"}};
  for (const change& c : changes) {
    bool replaced = false;
    for (auto& [name, line] : lines) {
      if (name == c.name) line = c.line, replaced = true;
    }
    if (!replaced) lines.emplace_back(c.name, c.line);
  }
  std::string out = std::string{first} + "\r\n";
  for (const auto& [name, line] : lines) {
    if (!line.empty()) out.append(line).append("\r\n");
  }
  return out + "\r\n";
}

// Refused with a status, and with texts that contain what is given.
inline ::testing::AssertionResult refused(const std::string& request, std::uint16_t status,
                                          std::string_view what, std::string_view remedy = {},
                                          const handshake_policy& policy = policy_at(8080)) {
  const http_judgement j = judge_request(request, policy);
  if (j.outcome != http_outcome::rejected) return ::testing::AssertionFailure() << "it is not refused";
  if (j.rejection.status != status || j.rejection.what().find(what) == std::string_view::npos ||
      j.rejection.remedy().find(remedy) == std::string_view::npos || j.rejection.remedy().empty()) {
    return ::testing::AssertionFailure()
           << j.rejection.status << ' ' << j.rejection.what() << " / " << j.rejection.remedy();
  }
  return ::testing::AssertionSuccess();
}

inline ::testing::AssertionResult accepted(const std::string& request,
                                           const handshake_policy& policy = policy_at(8080),
                                           http_outcome outcome = http_outcome::upgrade) {
  const http_judgement j = judge_request(request, policy);
  if (j.outcome == outcome) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << j.rejection.status << ' ' << j.rejection.what() << " / " << j.rejection.remedy();
}

} // namespace rowe::wire::test
