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

#include <rowe/json_value.hpp>

namespace rowe::tools {

// Ends in a newline.
std::string outline_of(json_value json);
// The same below a key.
std::string outline_of(std::string_view key, json_value json);

} // namespace rowe::tools
