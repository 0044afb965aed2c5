// SPDX-License-Identifier: Apache-2.0
// A picture as a list of what is drawn, one on top of the other, in pixels from the upper left corner. From
// it both an SVG and a PNG are made.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace rowe::tools {

// What a colour is for. The page has the colours themselves (src/page/colours.css).
enum class tone : std::uint8_t { surface, line, grid, quiet, ink, one, two, three, four, stop, warn, count };
inline constexpr auto tones = static_cast<std::size_t>(tone::count);

struct place {
  double x = 0;
  double y = 0;
};

struct box {
  place corner{};
  double width = 0;
  double height = 0;
  tone colour = tone::ink;
  double opacity = 1;
};

enum class dashes : std::uint8_t { none, long_ones, short_ones };

struct stroke {
  std::vector<place> points{};
  tone colour = tone::ink;
  double width = 1;
  dashes broken = dashes::none;
  std::string of{}; // the series that it is a part of; empty: of none
};

struct dot {
  place centre{};
  double radius = 2;
  tone colour = tone::ink;
};

enum class side : std::uint8_t { left, middle, right };

struct words {
  place base{}; // on the line that the letters stand on
  std::string text{};
  side anchor = side::left; // what of the text is at `base`
  tone colour = tone::ink;
  double size = 12;
};

using picture_part = std::variant<box, stroke, dot, words>;

struct picture {
  std::size_t width = 0;
  std::size_t height = 0;
  std::string title{};
  std::vector<picture_part> parts{};
};

// About how wide a text is: a picture is laid out before a font is known.
double width_of(std::string_view text, double size) noexcept;

} // namespace rowe::tools
