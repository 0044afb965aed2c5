// SPDX-License-Identifier: Apache-2.0
#include "wire/codec/time_to_live.hpp"

#include <array>
#include <cassert>
#include <charconv>
#include <cstring>

#include "wire/codec/members.hpp"
#include "wire/codec/request.hpp"

namespace rowe::wire {

std::optional<refusal> read_ttl(const json::value& v, std::int64_t& into_ns) noexcept {
  const auto milliseconds = json::to_double(v);
  if (!milliseconds) return wrong_type(ttl_member, v, "a number of milliseconds");
  if (*milliseconds < 0) {
    return negative(ttl_member, v);
  }
  constexpr double bound = 9.2e18; // a little below what 64 bits hold: 291 years
  const double ns = *milliseconds * 1e6;
  into_ns = ns < bound ? static_cast<std::int64_t>(ns + 0.5) : unlimited;
  return std::nullopt;
}

std::size_t write_ttl(std::span<std::byte> out, std::int64_t left_ns) noexcept {
  constexpr std::string_view name = R"("ttl_ms":)";
  constexpr std::size_t digits_max = 13; // of milliseconds, in 64 bits of nanoseconds
  constexpr std::size_t fraction_bytes = 4;
  static_assert(name.size() + digits_max + fraction_bytes == ttl_text_bytes_max);
  assert(left_ns >= 0 && out.size() >= ttl_text_bytes_max);
  const std::int64_t units = left_ns / ttl_unit.count();
  std::array<char, ttl_text_bytes_max> text;
  std::memcpy(text.data(), name.data(), name.size());
  char* at = std::to_chars(text.data() + name.size(), text.data() + text.size(), units / 1000).ptr;
  if (const auto rest = static_cast<int>(units % 1000); rest != 0) {
    *at++ = '.';
    *at++ = static_cast<char>('0' + rest / 100);
    *at++ = static_cast<char>('0' + rest / 10 % 10);
    *at++ = static_cast<char>('0' + rest % 10);
  }
  const auto bytes = static_cast<std::size_t>(at - text.data());
  std::memcpy(out.data(), text.data(), bytes);
  return bytes;
}

} // namespace rowe::wire
