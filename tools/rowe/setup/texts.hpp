// SPDX-License-Identifier: Apache-2.0
// The files that set-up writes and people read.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>

namespace rowe::tools {

inline constexpr std::string_view settings_file = "rowe.toml";
inline constexpr std::string_view certificate_file = "certificate.pem";
inline constexpr std::string_view key_file = "key.pem";
inline constexpr std::string_view root_file = "ca.pem";         // for programs
inline constexpr std::string_view root_phone_file = "ca.crt";   // the same in DER, which phones import
inline constexpr std::string_view root_key_file = "ca-key.pem"; // where it was kept
inline constexpr std::string_view avahi_file = "rowe.service";
inline constexpr std::string_view tokens_file = "tokens.txt";

// Names of all of them.
std::vector<std::string> setup_files();

struct robot_settings {
  std::string name;
  std::string address;
  std::uint16_t port = 0;
  std::vector<std::string> hosts; // names that it answers to
  std::vector<identity> identities;
};

// rowe.toml.
std::string toml_of(const robot_settings& robot);

// A static service file for Avahi: a robot's, and that of its page.
std::string avahi_service_of(std::string_view name, std::uint16_t port);

} // namespace rowe::tools
