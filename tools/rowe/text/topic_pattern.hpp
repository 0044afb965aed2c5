// SPDX-License-Identifier: Apache-2.0
// Names of topics, as people choose among them: `*` stands for any text without a slash, `**` for any text,
// as in the rights of roles (docs/network.md).
#pragma once
#include <string_view>

namespace rowe::tools {

// "x" and "/x" are the same name.
constexpr std::string_view without_slash(std::string_view name) noexcept {
  return name.starts_with('/') ? name.substr(1) : name;
}
constexpr bool is_same_topic(std::string_view one, std::string_view other) noexcept {
  return without_slash(one) == without_slash(other);
}

// Whether the pattern describes the name. Takes the last star further where what follows does not match, and
// when a `*` can go no further, the last `**`.
bool topic_matches(std::string_view pattern, std::string_view name) noexcept;

} // namespace rowe::tools
