// SPDX-License-Identifier: Apache-2.0
#include "canvas.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rowe::tools {
namespace {

struct dash_lengths {
  double drawn = 0;
  double left_out = 0;
};
dash_lengths lengths_of(dashes broken) noexcept {
  return broken == dashes::long_ones ? dash_lengths{8, 4} : dash_lengths{2, 3};
}

std::uint8_t mixed(std::uint8_t below, std::uint8_t above, double part) noexcept {
  return static_cast<std::uint8_t>(std::lround(below + (above - below) * part));
}

// How much of the pixel at `at` lies between `low` and `high`.
double share_of(double at, double low, double high) noexcept {
  return std::clamp(std::min(at + 1, high) - std::max(at, low), 0.0, 1.0);
}

} // namespace

void canvas::cover(std::ptrdiff_t x, std::ptrdiff_t y, double part, rgb colour) {
  if (x < 0 || y < 0 || std::cmp_greater_equal(x, width_) || std::cmp_greater_equal(y, height_)) return;
  rgb& pixel = pixels_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)];
  pixel = {mixed(pixel.red, colour.red, part), mixed(pixel.green, colour.green, part),
           mixed(pixel.blue, colour.blue, part)};
}

void canvas::fill(const box& one, rgb colour) {
  const double right = one.corner.x + one.width, bottom = one.corner.y + one.height;
  for (double y = std::floor(one.corner.y); y < bottom; ++y) {
    for (double x = std::floor(one.corner.x); x < right; ++x) {
      const double part = share_of(x, one.corner.x, right) * share_of(y, one.corner.y, bottom);
      cover(static_cast<std::ptrdiff_t>(x), static_cast<std::ptrdiff_t>(y), part * one.opacity, colour);
    }
  }
}

void canvas::mask(std::ptrdiff_t x, std::ptrdiff_t y, double part) {
  if (x < 0 || y < 0 || std::cmp_greater_equal(x, width_) || std::cmp_greater_equal(y, height_)) return;
  const std::size_t pixel = static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x);
  const auto covered = static_cast<std::uint8_t>(std::lround(part * 255));
  if (mask_[pixel] == 0 && covered != 0) masked_.push_back(pixel);
  mask_[pixel] = std::max(mask_[pixel], covered);
}

// Along its longer side, a column or a row of pixels after the other: only pixels near to it are looked at.
void canvas::mask_line(place from, place to, double radius) {
  const double dx = to.x - from.x, dy = to.y - from.y;
  const double length_2 = dx * dx + dy * dy;
  const double reach = radius + 1;
  const bool is_flat = std::abs(dx) >= std::abs(dy);
  const auto [first, last] = is_flat ? std::minmax(from.x, to.x) : std::minmax(from.y, to.y);
  const double most = static_cast<double>(is_flat ? width_ : height_);
  for (double along = std::max(std::floor(first - reach), 0.0); along <= std::min(last + reach, most);
       ++along) {
    const double slope = is_flat ? (dx == 0 ? 0 : dy / dx) : dx / dy;
    const double middle =
        (is_flat ? from.y + (along + 0.5 - from.x) * slope : from.x + (along + 0.5 - from.y) * slope);
    // A line that is at 45 degrees is this much wider across.
    const double across_reach = reach * 1.5 + 0.5;
    for (double across = std::floor(middle - across_reach); across <= middle + across_reach; ++across) {
      const double x = (is_flat ? along : across) + 0.5, y = (is_flat ? across : along) + 0.5;
      const double t =
          length_2 == 0 ? 0 : std::clamp(((x - from.x) * dx + (y - from.y) * dy) / length_2, 0.0, 1.0);
      const double distance = std::hypot(x - from.x - t * dx, y - from.y - t * dy);
      const double part = std::clamp(radius + 0.5 - distance, 0.0, 1.0);
      if (part > 0) mask(static_cast<std::ptrdiff_t>(x), static_cast<std::ptrdiff_t>(y), part);
    }
  }
}

void canvas::cover_masked(rgb colour) {
  for (const std::size_t at : masked_) {
    const double part = std::exchange(mask_[at], std::uint8_t{0}) / 255.0;
    rgb& pixel = pixels_[at];
    pixel = {mixed(pixel.red, colour.red, part), mixed(pixel.green, colour.green, part),
             mixed(pixel.blue, colour.blue, part)};
  }
  masked_.clear();
}

void canvas::draw(const stroke& one, rgb colour) {
  // A straight line of whole pixels, as those of a grid, is drawn sharp.
  if (one.points.size() == 2 && one.width == 1 && one.broken == dashes::none) {
    const auto [from, to] = std::pair{one.points[0], one.points[1]};
    if (from.x == to.x || from.y == to.y) {
      const place corner{std::floor(std::min(from.x, to.x)), std::floor(std::min(from.y, to.y))};
      const double wide = std::max(std::round(std::abs(to.x - from.x)), 1.0);
      const double high = std::max(std::round(std::abs(to.y - from.y)), 1.0);
      fill({.corner = corner, .width = wide, .height = high}, colour);
      return;
    }
  }
  const double radius = one.width / 2;
  const dash_lengths dash = lengths_of(one.broken);
  double done = 0; // of the line's length
  for (std::size_t i = 1; i < one.points.size(); ++i) {
    const place from = one.points[i - 1], to = one.points[i];
    if (one.broken == dashes::none) {
      mask_line(from, to, radius);
      continue;
    }
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    const double period = dash.drawn + dash.left_out;
    const auto at = [&](double along) {
      const double t = length == 0 ? 0 : std::clamp(along / length, 0.0, 1.0);
      return place{from.x + (to.x - from.x) * t, from.y + (to.y - from.y) * t};
    };
    for (double begin = -std::fmod(done, period); begin < length; begin += period) {
      if (begin + dash.drawn > 0) mask_line(at(begin), at(begin + dash.drawn), radius);
    }
    done += length;
  }
  cover_masked(colour);
}

void canvas::draw(const dot& one, rgb colour) {
  const double reach = one.radius + 1;
  for (double y = std::floor(one.centre.y - reach); y <= one.centre.y + reach; ++y) {
    for (double x = std::floor(one.centre.x - reach); x <= one.centre.x + reach; ++x) {
      const double distance = std::hypot(x + 0.5 - one.centre.x, y + 0.5 - one.centre.y);
      const double part = std::clamp(one.radius + 0.5 - distance, 0.0, 1.0);
      if (part > 0) cover(static_cast<std::ptrdiff_t>(x), static_cast<std::ptrdiff_t>(y), part, colour);
    }
  }
}

} // namespace rowe::tools
