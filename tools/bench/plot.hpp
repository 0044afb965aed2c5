// SPDX-License-Identifier: Apache-2.0
// A drawing of a distribution: percentiles above, the histogram below, all axes logarithmic but for what they
// say. SVG written by hand, readable in light and dark, with the machine in its title.
#pragma once
#include <string>

#include "compare.hpp"
#include "report.hpp"

namespace rowe::tools::bench {

// `before` may be null; else it is drawn behind.
std::string svg_of(const report& r, const earlier* before);

} // namespace rowe::tools::bench
