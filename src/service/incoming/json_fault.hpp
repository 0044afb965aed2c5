// SPDX-License-Identifier: Apache-2.0
// Why a text is no JSON, in words. Pure functions; nothing waits or allocates.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <span>
#include <string_view>

#include <rowe/result.hpp>

namespace rowe::service {

// `there`: what stands where the text is wrong. Some programs write NaN and infinities, which JSON does not
// have.
inline std::string_view explain_fault(const error& why, std::string_view there,
                                      std::span<char> buffer) noexcept {
  for (const std::string_view word : {std::string_view{"NaN"}, std::string_view{"Infinity"}}) {
    if (why.code != errc::malformed || !there.starts_with(word)) continue;
    const int bytes = std::snprintf(
        buffer.data(), buffer.size(),
        "the text is no valid JSON, which has no %s (at byte %lld): send null, or leave the member out",
        word.data(), static_cast<long long>(why.value));
    return {buffer.data(), static_cast<std::size_t>(bytes)};
  }
  return why.message(buffer);
}

inline std::string_view explain_fault_in(const error& why, std::string_view text,
                                         std::span<char> buffer) noexcept {
  const auto at = std::min(static_cast<std::size_t>(why.value), text.size());
  return explain_fault(why, text.substr(at), buffer);
}

} // namespace rowe::service
