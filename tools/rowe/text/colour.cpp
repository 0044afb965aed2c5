// SPDX-License-Identifier: Apache-2.0
#include "colour.hpp"

#include <unistd.h>

#include <cstdlib>

namespace rowe::tools::colour {
namespace {

when chosen = when::automatic;

bool has_value(const char* name) noexcept {
  const char* const value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

// Select Graphic Rendition (ECMA-48, 8.3.117).
std::string with(std::string_view rendition, std::string_view text) {
  if (!is_on() || text.empty()) return std::string{text};
  return std::string{"\x1b["}.append(rendition).append("m").append(text).append("\x1b[0m");
}

} // namespace

void choose(when wanted) noexcept { chosen = wanted; }

bool is_on() noexcept {
  if (chosen != when::automatic) return chosen == when::always;
  if (has_value("NO_COLOR") || ::isatty(STDOUT_FILENO) == 0) return false;
  const char* const kind = std::getenv("TERM");
  return kind != nullptr && std::string_view{kind} != "dumb";
}

std::string heading(std::string_view text) { return with("1", text); }
std::string good(std::string_view text) { return with("32", text); }
std::string bad(std::string_view text) { return with("31", text); }
std::string dim(std::string_view text) { return with("2", text); }

} // namespace rowe::tools::colour
