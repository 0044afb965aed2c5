// SPDX-License-Identifier: Apache-2.0
// What of a request may be repeated, in an answer or an event, before its client was let in: what is known to
// be harmless. Anything else may be a token in a wrong place. For http_request.cpp only. Pure functions.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "wire/http/http_names.hpp"
#include "wire/text/ascii.hpp"
#include "wire/text/token_bytes.hpp"

namespace rowe::wire {

namespace shown {

inline constexpr std::string_view not_shown = "(not shown)";

// Words that others have defined, each for one place in a request.
inline constexpr auto words = std::to_array<std::string_view>({
    "DELETE",
    "GET",
    "HEAD",
    "OPTIONS",
    "PATCH",
    "POST",
    "PUT",
    "TRACE",
    "CONNECT", // methods
    "HTTP/0.9",
    "HTTP/1.0",
    "HTTP/1.1",
    "HTTP/2",
    "HTTP/2.0",
    "HTTP/3", // versions
    "h2",
    "h2c",
    "websocket",
    "TLS/1.0", // upgrades
    "chunked",
    "compress",
    "deflate",
    "gzip",
    "identity", // codings
    "application/json",
    "application/octet-stream",
    "application/x-www-form-urlencoded",
    "multipart/form-data",
    "text/plain",
    "text/plain;charset=UTF-8", // media types
    "authorization",
    "connection",
    "content-length",
    "content-type",
    "host",
    "origin",
    "sec-websocket-key",
    "sec-websocket-protocol",
    "sec-websocket-version",
    "transfer-encoding",
    "upgrade", // fields
    "binary",
    "chat",
    "foxglove.sdk.v1",
    "foxglove.websocket.v1",
    "graphql-transport-ws",
    "graphql-ws",
    "json",
    "mqtt",
    "mqttv3.1",
    "rosbridge_v2",
    "soap",
    "stomp",
    "v10.stomp",
    "v11.stomp",
    "v12.stomp",
    "wamp.2.json",
    "xmpp", // subprotocols
});

inline std::string_view word(std::string_view text) noexcept {
  const bool known = std::any_of(words.begin(), words.end(),
                                 [text](std::string_view one) { return equal_ignoring_case(one, text); });
  return known || text.empty() ? text : not_shown;
}

inline std::string_view number(std::string_view text) noexcept {
  constexpr std::size_t bytes_shown = 12;
  static_assert(bytes_shown < token_bytes_min);
  return text.size() <= bytes_shown && text.find_first_not_of("0123456789-+.x") == std::string_view::npos
             ? text
             : not_shown;
}

// HOST or HOST:PORT, where each part of a name is shorter than tokens are. A browser or a client could not
// have connected with anything else there.
inline std::string_view host(std::string_view text) noexcept {
  constexpr std::size_t label_bytes_shown = token_bytes_min - 1;
  const auto named = to_authority(text);
  if (!named) return not_shown;
  std::size_t label = 0;
  for (const char c : named->host) {
    label = c == '.' || c == ':' ? 0 : label + 1;
    if (label > label_bytes_shown || c <= ' ' || static_cast<unsigned char>(c) > '~') return not_shown;
  }
  return text;
}

inline std::string_view origin(std::string_view text) noexcept {
  for (const std::string_view scheme : {"http://", "https://"})
    if (equal_ignoring_case(text.substr(0, scheme.size()), scheme))
      return host(text.substr(scheme.size())) != not_shown ? text : not_shown;
  return not_shown;
}

} // namespace shown

} // namespace rowe::wire
