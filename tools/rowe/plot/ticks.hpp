// SPDX-License-Identifier: Apache-2.0
// Where an axis has its marks: at whole multiples of 1, 2 or 5 times a power of ten.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace rowe::tools {

struct tick {
  double at = 0;
  std::string label{};
};

// At most so many, from `low` to `high`; none where that is no range of finite numbers. All labels have as
// many digits as are needed to tell one from the next.
std::vector<tick> ticks_between(double low, double high, std::size_t most);

// A range that shows all of [low, high] with some air around it; of a single value, too.
struct axis_range {
  double low = 0;
  double high = 1;
};
axis_range with_air(double low, double high);

} // namespace rowe::tools
