// SPDX-License-Identifier: Apache-2.0
// Trajectories in the text form of the TUM RGB-D benchmark: one pose a line, `time tx ty tz qx qy qz qw`
// (seconds, metres, a quaternion), separated by blanks or tabs; lines that begin with # are comments. Nearly
// every tool that estimates or records motion writes it.
//
// Read strictly: a file is wholly a trajectory or it is refused with the number of the line. Numbers become
// the nearest doubles. Times are kept in whole nanoseconds taken from the decimal text, because a double
// holds a time of this century to 238 ns only.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

struct tum_pose {
  std::int64_t time_ns = 0;            // since the file's own origin, usually 1970; 0 or more
  std::array<double, 3> position{};    // x y z
  std::array<double, 4> orientation{}; // x y z w
};

struct tum_fault {
  std::size_t line = 0; // counted from 1; 0: the file as a whole
  std::string what;     // a sentence; empty: no fault
};

struct tum_file {
  std::vector<tum_pose> poses;
  tum_fault fault;
};

// The trajectory in `text`. Times must not go back, and lie below 2^32 s, as a ROS stamp does; a text without
// a pose is a fault.
tum_file read_tum(std::string_view text);

// The same of the file at `path`; a file that cannot be read is a fault.
tum_file read_tum_file(const std::string& path);

} // namespace rowe::tools
