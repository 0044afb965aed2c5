// SPDX-License-Identifier: Apache-2.0
// What a peer of the swarm hears in another encoding than JSON, as JSON.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "wire/png_text.hpp"
#include "json/cbor_text.hpp"

namespace swarm {

// The message that is in CBOR or in a PNG; any other as it is. Nothing where these are not well-formed, or
// hold what is no message of a topic.
inline std::optional<std::string> decoded_encoding(const std::string& message) {
  constexpr std::string_view png = R"({"op":"png","data":")";
  const bool is_png = message.starts_with(png);
  if (!is_png && (message.empty() || message.front() != '\xa3')) return message;
  const std::string_view data = std::string_view{message}.substr(is_png ? png.size() : 0);
  if (is_png && !data.ends_with(R"("})")) return std::nullopt;
  auto json =
      is_png ? rowe::tests::png_text(data.substr(0, data.size() - 2)) : rowe::tests::cbor_text(message);
  if (json && !json->starts_with(R"({"op":"publish","topic":")")) return std::nullopt;
  return json;
}

} // namespace swarm
