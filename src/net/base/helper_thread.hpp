// SPDX-License-Identifier: Apache-2.0
// A thread for what may take long or allocate, so that the service thread does not have to. It has ordinary
// scheduling whatever its maker has, and all signals blocked. Set-up.
#pragma once
#include <pthread.h>

#include <csignal>

namespace rowe::net {

// Starts `body(argument)` under `name`, which has at most 15 bytes. Returns 0, or the errno of the failure.
inline int start_helper(pthread_t& made, const char* name, void* (*body)(void*), void* argument) noexcept {
  pthread_attr_t attributes;
  ::pthread_attr_init(&attributes);
  // The thread that makes it may be real-time; the helper must not be.
  ::pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  ::pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
  sigset_t all;
  sigset_t before;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  const int failure = ::pthread_create(&made, &attributes, body, argument);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ::pthread_attr_destroy(&attributes);
  if (failure == 0) (void)::pthread_setname_np(made, name); // a debugging aid
  return failure;
}

} // namespace rowe::net
