// SPDX-License-Identifier: Apache-2.0
// Reads what is in the pixels of a PNG in base64, by the standards and bit by bit: check sums, stored blocks,
// rows without a filter. Nothing for what is wrong. (tests/web reads the same with a browser.)
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace rowe::tests {

inline std::optional<std::string> from_base64(std::string_view text) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  if (text.size() % 4 != 0) return std::nullopt;
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); i += 4) {
    std::uint32_t bits = 0;
    std::size_t padding = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t value = alphabet.find(text[i + k]);
      const bool pads = text[i + k] == '=' && i + 4 == text.size() && k >= 2;
      if ((value == std::string_view::npos) != pads || (padding != 0 && !pads)) return std::nullopt;
      padding += pads;
      bits = bits << 6 | static_cast<std::uint32_t>(pads ? 0 : value);
    }
    for (std::size_t k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(bits >> (16 - 8 * k));
  }
  return bytes;
}

inline std::optional<std::string> png_text(std::string_view base64) {
  const auto png = from_base64(base64);
  if (!png) return std::nullopt;
  std::string_view rest = *png;
  const auto take = [&](std::size_t n) {
    const std::string_view taken = rest.substr(0, n);
    rest.remove_prefix(taken.size());
    return taken;
  };
  const auto number = [](std::string_view bytes) {
    std::uint32_t n = 0;
    for (const char c : bytes) n = n << 8 | static_cast<std::uint8_t>(c);
    return n;
  };
  if (take(8) != "\x89PNG\r\n\x1a\n") return std::nullopt;
  std::string header, data;
  for (bool ended = false; !ended;) {
    const std::uint32_t bytes = number(take(4));
    if (rest.size() < std::size_t{bytes} + 8) return std::nullopt;
    std::uint32_t crc = 0xffffffff;
    for (const char c : rest.substr(0, bytes + 4)) {
      crc ^= static_cast<std::uint8_t>(c);
      for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
    }
    const std::string_view type = take(4);
    const std::string_view inside = take(bytes);
    if (number(take(4)) != ~crc) return std::nullopt;
    if (type == "IHDR") header = inside;
    if (type == "IDAT") data += inside;
    ended = type == "IEND";
  }
  if (!rest.empty() || header.size() != 13 || header.substr(8) != std::string_view{"\x08\x02\0\0\0", 5})
    return std::nullopt;
  const std::size_t width = number(header.substr(0, 4));
  const std::size_t height = number(header.substr(4, 4));
  if (width * width > height * width || (height - 1) > width + 2) return std::nullopt; // nearly a square

  rest = data;
  if (take(2) != "\x78\x01" || rest.size() < 4) return std::nullopt;
  std::string raw;
  for (bool last = false; !last;) {
    const std::string_view head = take(5);
    if (head.size() != 5 || (head[0] & 0xfe) != 0) return std::nullopt;
    last = head[0] == 1;
    const auto byte = [&](std::size_t i) {
      return static_cast<std::size_t>(static_cast<std::uint8_t>(head[i]));
    };
    const std::size_t bytes = byte(1) | byte(2) << 8;
    if ((bytes ^ (byte(3) | byte(4) << 8)) != 0xffff || rest.size() < bytes) return std::nullopt;
    raw += take(bytes);
  }
  std::uint32_t a = 1, b = 0;
  for (const char c : raw) {
    a = (a + static_cast<std::uint8_t>(c)) % 65521;
    b = (b + a) % 65521;
  }
  if (rest.size() != 4 || number(rest) != (b << 16 | a) || raw.size() != height * (1 + 3 * width))
    return std::nullopt;
  std::string text;
  for (std::size_t row = 0; row < height; ++row) {
    if (raw[row * (1 + 3 * width)] != 0) return std::nullopt;
    text += raw.substr(row * (1 + 3 * width) + 1, 3 * width);
  }
  return text.substr(0, text.find_last_not_of('\n') + 1);
}

} // namespace rowe::tests
