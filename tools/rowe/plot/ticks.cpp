// SPDX-License-Identifier: Apache-2.0
#include "ticks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "../text/times.hpp"

namespace rowe::tools {
namespace {

constexpr double written_out_below = 1e7; // what is larger has an exponent
constexpr int decimals_most = 6;          // likewise what needs more
constexpr double air = 0.05;              // of a range, above and below it

// The power of ten of a step, exactly: log10 alone may be wrong by one at 1000 and the like.
int power_of(double step) {
  int power = static_cast<int>(std::floor(std::log10(step)));
  while (std::pow(10.0, power + 1) <= step * (1 + 1e-9)) ++power;
  return power;
}

struct nice_step {
  double size = 0;
  int power = 0;
};

// The smallest that is no smaller.
nice_step step_from(double smallest) {
  const int power = power_of(smallest);
  const double unit = std::pow(10.0, power);
  for (const int factor : {1, 2, 5}) {
    if (factor * unit >= smallest * (1 - 1e-9)) return {factor * unit, power};
  }
  return {10 * unit, power + 1};
}

std::string label_of(double value, int power, bool with_exponent) {
  if (value == 0) return "0";
  if (!with_exponent) return decimal_text(value, std::max(0, -power));
  const int digits = std::max(0, power_of(std::abs(value)) - power);
  std::array<char, 40> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value,
                                     std::chars_format::scientific, std::min(digits, 15));
  std::string label{text.data(), written.ptr};
  // "1.5e+09" is "1.5e9".
  const std::size_t exponent = label.find('e') + 1;
  if (label[exponent] == '+') label.erase(exponent, 1);
  const std::size_t first_digit = exponent + (label[exponent] == '-' ? 1 : 0);
  if (label[first_digit] == '0' && label.size() > first_digit + 1) label.erase(first_digit, 1);
  return label;
}

} // namespace

std::vector<tick> ticks_between(double low, double high, std::size_t most) {
  std::vector<tick> all;
  if (!std::isfinite(low) || !std::isfinite(high) || !(low < high) || most == 0) return all;
  const double span = high / 2 - low / 2; // halves: the whole may be beyond what a double holds
  if (!(span > std::max(std::abs(low), std::abs(high)) * 1e-14)) return all;
  nice_step step = step_from(span / (static_cast<double>(most) / 2));
  for (;;) {
    const double first = std::ceil(low / step.size - 1e-9), last = std::floor(high / step.size + 1e-9);
    if (last - first + 1 <= static_cast<double>(most)) {
      const double largest = std::max(std::abs(first), std::abs(last)) * step.size;
      const bool with_exponent = largest >= written_out_below || -step.power > decimals_most;
      for (double i = first; i <= last; ++i) {
        const double at = i * step.size;
        if (std::isfinite(at)) all.push_back({at, label_of(at, step.power, with_exponent)});
      }
      return all;
    }
    step = step_from(step.size * 1.5);
  }
}

axis_range with_air(double low, double high) {
  if (!(low < high)) {
    const double around = low == 0 ? 1 : std::abs(low) * air;
    return {low - around, low + around};
  }
  const double more = high * air - low * air;
  return {low - more, high + more};
}

} // namespace rowe::tools
