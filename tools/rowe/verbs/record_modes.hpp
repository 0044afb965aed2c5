// SPDX-License-Identifier: Apache-2.0
// What `rowe record` does besides recording: it makes files whole, and asks black boxes to write.
#pragma once
#include <string>
#include <vector>

#include "../console.hpp"
#include "../network/remote.hpp"

namespace rowe::tools {

exit_code repair_recordings(const std::vector<std::string>& files, const console& to);

// `cause` stands in the files.
exit_code ask_for_snapshot(const remote_place& at, const std::string& cause, rt::duration timeout,
                           const console& to);

} // namespace rowe::tools
