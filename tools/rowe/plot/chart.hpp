// SPDX-License-Identifier: Apache-2.0
// The picture of what was plotted: an axis of time with a lane for each --field above it, or a path.
#pragma once
#include <cstddef>
#include <string>

#include "picture.hpp"
#include "series.hpp"

namespace rowe::tools {

struct chart_options {
  std::size_t width = 1200;
  std::size_t height = 600;
  std::string title{};
};

// So many columns of pixels are for the lines. How much of them the labels of the axes take is known at the
// end only, so a column of samples may be some hundredths of a pixel wider or narrower than one of pixels.
std::size_t columns_of_lines(std::size_t width) noexcept;

// How high a picture has to be for so many lanes.
std::size_t height_for(std::size_t lanes) noexcept;

picture chart_of(const plotted_data& data, const chart_options& how);

// What the axis of time counts: "s since 2026-11-30T05:09:58.000+01:00", or "s" where nobody knows the date.
std::string caption_of_time(const plotted_data& data);

} // namespace rowe::tools
