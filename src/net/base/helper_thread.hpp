// SPDX-License-Identifier: Apache-2.0
// A thread for what may take long or allocate, so that the service thread does not have to. It has ordinary
// scheduling whatever its maker has, and all signals blocked. Set-up.
#pragma once
#include <pthread.h>

namespace rowe::net {

// Starts `body(argument)` under `name`, which has at most 15 bytes. Returns 0, or the errno of the failure.
int start_helper(pthread_t& made, const char* name, void* (*body)(void*), void* argument) noexcept;

} // namespace rowe::net
