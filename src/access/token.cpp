// SPDX-License-Identifier: Apache-2.0
#include "access/token.hpp"

#include <algorithm>

#include <openssl/crypto.h>
#include <openssl/sha.h>

namespace rowe::access {
namespace {

bool is_token_byte(char c) noexcept {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
         c == '_' || c == '~';
}

int value_of(char digit) noexcept {
  if (digit >= '0' && digit <= '9') return digit - '0';
  if (digit >= 'a' && digit <= 'f') return digit - 'a' + 10;
  if (digit >= 'A' && digit <= 'F') return digit - 'A' + 10;
  return -1;
}

} // namespace

bool is_token(std::string_view text) noexcept {
  return text.size() >= token_bytes_min && text.size() <= token_bytes_max &&
         std::all_of(text.begin(), text.end(), is_token_byte);
}

std::optional<token_hash> hash_of(std::string_view token) noexcept {
  token_hash hash{};
  static_assert(sizeof hash == SHA256_DIGEST_LENGTH);
  const auto* const bytes = reinterpret_cast<const unsigned char*>(token.data());
  if (::SHA256(bytes, token.size(), hash.data()) == nullptr) return std::nullopt;
  return hash;
}

std::optional<token_hash> hash_from_hex(std::string_view digits) noexcept {
  token_hash hash{};
  if (digits.size() != 2 * hash.size()) return std::nullopt;
  for (std::size_t i = 0; i < hash.size(); ++i) {
    const int high = value_of(digits[2 * i]);
    const int low = value_of(digits[2 * i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    hash[i] = static_cast<unsigned char>(high << 4 | low);
  }
  return hash;
}

bool equal(const token_hash& a, const token_hash& b) noexcept {
  return ::CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

} // namespace rowe::access
