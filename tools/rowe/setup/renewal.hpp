// SPDX-License-Identifier: Apache-2.0
// Certificates end; where the root's key was kept, a new one is made in time. The robot's key stays the same,
// so one file is replaced, by one rename, and who pinned the key goes on.
#pragma once
#include <chrono>
#include <string>
#include <vector>

#include "certificate.hpp"

namespace rowe::tools {

// Before its end; one that was made for less than three times that is renewed in the last third.
inline constexpr std::chrono::days renewal_time{30};

struct renewal {
  enum class outcome {
    not_due,
    renewed,
    without_root, // due, but the root's key was not kept
    failed,
  };
  outcome what = outcome::failed;
  calendar_time end = {};                 // of the certificate that there is now
  std::vector<std::string> left_out = {}; // names and addresses that the root may not vouch for
  std::string wrong = {};                 // when failed
};

// A new certificate in the folder that `rowe setup` made, for `days`, or for as many as the old one if that
// is 0. It has the names of the old one, the addresses that the machine has now, and those of the old one
// that are not private: a router's, perhaps. Reads and writes files: not for a thread that must not wait.
renewal renew(const std::string& path, calendar_time now, int days = 0);

// The same, if it is due: near its end, or when it is not good yet.
renewal renew_if_due(const std::string& path, calendar_time now);

} // namespace rowe::tools
