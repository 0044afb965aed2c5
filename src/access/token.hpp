// SPDX-License-Identifier: Apache-2.0
// Tokens and their hashes. Not real-time: OpenSSL allocates.
#pragma once
#include <optional>
#include <string_view>

#include "access/policy.hpp"
#include "wire/text/token_bytes.hpp"

namespace rowe::access {

using wire::token_bytes_min;
inline constexpr std::size_t token_bytes_max = 128;

bool is_token(std::string_view text) noexcept;

// SHA-256, without salt: a token is random, so nobody can have a table of hashes.
// Nothing if libcrypto cannot compute it.
std::optional<token_hash> hash_of(std::string_view token) noexcept;
std::optional<token_hash> hash_from_hex(std::string_view digits) noexcept;

// In a time that does not depend on where they differ.
bool equal(const token_hash& a, const token_hash& b) noexcept;

} // namespace rowe::access
