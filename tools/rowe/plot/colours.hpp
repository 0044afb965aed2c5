// SPDX-License-Identifier: Apache-2.0
// The colours of pictures: those of the page, by day and by night.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "picture.hpp"

namespace rowe::tools {

struct rgb {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  // "#0a58c2".
  std::string text() const;
};

using palette = std::array<rgb, tones>;

constexpr std::size_t place_of(tone one) noexcept { return static_cast<std::size_t>(one); }

// From a style sheet that has them as variables, "--ink: #12161b;": first those of the day, then those of the
// night that differ.
struct palettes {
  palette light{};
  palette dark{};
};
palettes palettes_in(std::string_view css);

// Those of src/page/colours.css.
const palettes& page_palettes();

// Of the n-th line of an axis, and how it is broken. There are so many looks.
inline constexpr std::size_t looks_max = 12;
tone colour_of_line(std::size_t n) noexcept;
dashes dashes_of_line(std::size_t n) noexcept;

} // namespace rowe::tools
