// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rowe::tools {

// How a verb ends; scripts rely on these (`rowe help` lists them).
enum class exit_code : int {
  done = 0,          // did it
  failed = 1,        // the thing asked for failed, or its output cannot be written
  usage = 2,         // the arguments make no sense
  no_connection = 3, // could not connect; the reason is printed
  timed_out = 4,     // no answer within --timeout
  exceeded = 5,      // a stated bound was exceeded
  lost = 6,          // a message expired or was dropped before it was sent
  interrupted = 130, // Ctrl-C before any result
};

} // namespace rowe::tools
