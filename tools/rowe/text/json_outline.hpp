// SPDX-License-Identifier: Apache-2.0
// JSON for reading: the indented form that `rostopic echo` made familiar,
//
//   header:
//     seq: 7
//     frame_id: "odom"
//   covariance: [0.1, 0, 0]
//
// Numbers and strings keep the spelling they have on the wire, but for control characters that would reach a
// terminal.
#pragma once
#include <string>
#include <string_view>

namespace rowe::tools {

// `json` must be valid, as what a subscriber takes is; its nesting is bounded by the endpoint's limit. Ends
// in a newline.
std::string outline_of(std::string_view json);

} // namespace rowe::tools
