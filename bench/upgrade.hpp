// SPDX-License-Identifier: Apache-2.0
// The server's half of a WebSocket handshake for servers that are measured and not used: whoever asks gets
// in.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <openssl/evp.h>
#include <openssl/sha.h>

namespace rowe::bench {

// The answer to a whole request; nothing where it has no key.
inline std::optional<std::string> upgrade_answer(std::string_view request) {
  constexpr std::string_view name = "Sec-WebSocket-Key: ";
  const std::size_t at = request.find(name);
  if (at == std::string_view::npos) return std::nullopt;
  std::string key{request.substr(at + name.size(), 24)}; // RFC 6455 4.1: of 16 bytes
  key += "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
  std::array<unsigned char, SHA_DIGEST_LENGTH> digest;
  (void)::SHA1(reinterpret_cast<const unsigned char*>(key.data()), key.size(), digest.data());
  std::array<unsigned char, 29> accept;
  (void)::EVP_EncodeBlock(accept.data(), digest.data(), static_cast<int>(digest.size()));
  return "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Accept: " +
         std::string{reinterpret_cast<const char*>(accept.data())} + "\r\n\r\n";
}

} // namespace rowe::bench
