// SPDX-License-Identifier: Apache-2.0
// An address of loopback at which no other test listens, for tests that leave a port and come back to it: on
// 127.0.0.1 another program may have been given it meanwhile.
#pragma once
#include <unistd.h>

#include <string>

namespace rowe::tests {

inline std::string own_address() {
  const auto process = static_cast<unsigned>(::getpid()); // 22 bits at most
  return "127." + std::to_string(1 + process / 65536) + "." + std::to_string(process / 256 % 256) + "." +
         std::to_string(process % 256);
}

} // namespace rowe::tests
