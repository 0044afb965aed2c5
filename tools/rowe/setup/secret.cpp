// SPDX-License-Identifier: Apache-2.0
#include "secret.hpp"

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstdint>

namespace rowe::tools {

std::string base64url(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string text;
  std::uint32_t waiting = 0;
  int bits = 0;
  for (const char byte : bytes) {
    waiting = (waiting << 8 | static_cast<unsigned char>(byte)) & 0xffff;
    for (bits += 8; bits >= 6; bits -= 6) text += digits[waiting >> (bits - 6) & 63];
  }
  if (bits > 0) text += digits[waiting << (6 - bits) & 63];
  return text;
}

std::string new_token() {
  std::array<char, 32> bytes;
  ::ssize_t count = 0;
  do { // so few bytes come at once, or not at all: getrandom(2)
    count = ::getrandom(bytes.data(), bytes.size(), 0);
  } while (count < 0 && errno == EINTR);
  if (count != static_cast<::ssize_t>(bytes.size())) return {};
  return base64url({bytes.data(), bytes.size()});
}

} // namespace rowe::tools
