// SPDX-License-Identifier: Apache-2.0
// Colours on stdout: where it is a terminal that has them, unless $NO_COLOR is set (https://no-color.org), or
// as --color says. Every verb has that option. What a colour means is always said in words, too.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace rowe::tools::colour {

inline constexpr std::array<std::string_view, 3> words{"auto", "always", "never"};
enum class when : std::uint8_t { automatic, always, never };

// Before anything is printed.
void choose(when wanted) noexcept;
bool is_on() noexcept;

// The text with its colour, where there are colours.
std::string heading(std::string_view text); // bold
std::string good(std::string_view text);    // green
std::string bad(std::string_view text);     // red
std::string dim(std::string_view text);

} // namespace rowe::tools::colour
