// SPDX-License-Identifier: Apache-2.0
// Small files that hold certificates and keys. Not real-time.
#pragma once
#include <cstdint>
#include <string>

namespace rowe::net::tls {

// Who may be able to read a file.
enum class readers : std::uint8_t {
  anybody,
  owner, // and, below $CREDENTIALS_DIRECTORY, whoever the service manager lets
};

// Reads the whole file, of at most 1 MiB. Returns what is wrong, in words; empty: nothing.
std::string read_file(const std::string& path, readers allowed, std::string& text);

} // namespace rowe::net::tls
