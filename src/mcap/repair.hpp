// SPDX-License-Identifier: Apache-2.0
// Makes a recording whole again that a program left without its end, or that is damaged. Allocates, and waits
// for the disk.
#pragma once
#include <cstdint>
#include <functional>
#include <string>

#include "mcap/scan.hpp"

namespace rowe::mcap {

struct repair_result {
  std::string wrong; // not empty: nothing was repaired, and why
  std::string path;  // of the whole recording
  bool was_whole = false;
  bool in_place = false;      // else the damaged file stands beside it, as it was
  std::uint64_t messages = 0; // that were saved
  findings found;
};

// What only lacks its end gets it, in the file itself. What is damaged elsewhere is copied without the
// damaged parts, to NAME.repaired.mcap beside it. Either is read back, message by message, before it counts
// as done.
repair_result repair(const std::string& path,
                     const std::function<void(std::uint64_t bytes, std::uint64_t of)>& on_progress = {});

} // namespace rowe::mcap
