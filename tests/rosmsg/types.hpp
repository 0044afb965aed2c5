// SPDX-License-Identifier: Apache-2.0
// Types for tests, and what becomes of messages by them.
#pragma once
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <rowe/ros_type.hpp>

namespace rosmsg_tests {

using rowe::ros_encoding;
using rowe::ros_type;
using rowe::ros_version;

inline constexpr std::size_t plenty = 1 << 20;

inline std::string part(std::string_view name, std::string_view members) {
  return std::string(80, '=') + "\nMSG: " + std::string{name} + "\n" + std::string{members} + "\n";
}

inline ros_type type_of(std::string_view definition, ros_version version,
                        std::string_view name = "test/Root") {
  std::string why;
  auto made = ros_type::parse(name, definition, version, &why);
  EXPECT_TRUE(made) << why << "\n" << definition;
  return std::move(made).value();
}
inline ros_type ros1(std::string_view definition) { return type_of(definition, ros_version::ros1); }
inline ros_type ros2(std::string_view definition) { return type_of(definition, ros_version::ros2); }

// The JSON of the message, or why there is none.
inline std::string json_of(const ros_type& type, ros_encoding encoding, std::string_view message,
                           std::size_t bytes_max = plenty) {
  std::string json = "before";
  std::string why;
  const auto done = type.to_json(encoding, message, json, bytes_max, &why);
  if (!done) {
    EXPECT_EQ(json, "");
    EXPECT_NE(why, "");
  }
  return done ? json : std::string{done.error().name()} + ": " + why;
}

// The message of the JSON in hexadecimal digits, two a byte, or why there is none.
inline std::string bytes_of(const ros_type& type, ros_encoding encoding, std::string_view json,
                            std::size_t bytes_max = plenty) {
  std::string message = "before";
  std::string why;
  const auto done = type.from_json(encoding, json, message, bytes_max, &why);
  if (!done) {
    EXPECT_EQ(message, "");
    EXPECT_NE(why, "");
    return std::string{done.error().name()} + ": " + why;
  }
  std::string digits;
  for (const char c : message) {
    digits += "0123456789abcdef"[static_cast<unsigned char>(c) >> 4];
    digits += "0123456789abcdef"[static_cast<unsigned char>(c) & 15];
  }
  return digits;
}

// The bytes of hexadecimal digits; spaces are passed over.
inline std::string hex(std::string_view digits) {
  std::string bytes;
  int high = -1;
  for (const char c : digits) {
    if (c == ' ') continue;
    const int digit = c <= '9' ? c - '0' : c - 'a' + 10;
    if (high >= 0) bytes += static_cast<char>(high * 16 + digit);
    high = high >= 0 ? -1 : digit;
  }
  return bytes;
}

} // namespace rosmsg_tests
