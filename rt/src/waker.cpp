// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/waker.hpp>

#include <sys/eventfd.h>

namespace rowe::rt {

void eventfd_signal::raise() const noexcept {
  (void)::eventfd_write(descriptor, 1); // fails only when 2^64 - 2 signals were not waited for
}

} // namespace rowe::rt
