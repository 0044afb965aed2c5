// SPDX-License-Identifier: Apache-2.0
// Files that say who may do what: settings, keys, certificates, tokens. Not real-time.
#pragma once
#include <cstdint>
#include <string>

namespace rowe::access {

// Whether the file, which is there, is below $CREDENTIALS_DIRECTORY. What systemd hands to a service is in
// that folder, and systemd knows who may read and write it.
bool is_credential(const std::string& path);

// Changes when the file is replaced or written to. 0 if it cannot be looked at.
std::uint64_t version_of(const std::string& path) noexcept;

} // namespace rowe::access
