// SPDX-License-Identifier: Apache-2.0
// Pixels, and what is drawn into them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "colours.hpp"
#include "picture.hpp"

namespace rowe::tools {

class canvas {
 public:
  canvas(std::size_t width, std::size_t height)
      : width_{width}, height_{height}, pixels_(width * height), mask_(width * height) {}

  void fill(const box& one, rgb colour);
  // With soft edges; where a line crosses itself it is no darker.
  void draw(const stroke& one, rgb colour);
  void draw(const dot& one, rgb colour);
  // Covers a pixel by a part from 0 to 1; what lies outside is left out.
  void cover(std::ptrdiff_t x, std::ptrdiff_t y, double part, rgb colour);

  std::size_t width() const noexcept { return width_; }
  std::size_t height() const noexcept { return height_; }
  // Row by row from the top, three bytes each.
  const std::vector<rgb>& pixels() const noexcept { return pixels_; }

 private:
  void mask_line(place from, place to, double radius);
  void mask(std::ptrdiff_t x, std::ptrdiff_t y, double part);
  void cover_masked(rgb colour);

  std::size_t width_;
  std::size_t height_;
  std::vector<rgb> pixels_;
  std::vector<std::uint8_t> mask_;  // how far the stroke that is being drawn covers a pixel
  std::vector<std::size_t> masked_; // the pixels that it covers at all
};

} // namespace rowe::tools
