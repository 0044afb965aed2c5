// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/wake_bell.hpp>

#include <sys/eventfd.h>

namespace rowe::rt {

void eventfd_bell::ring() const noexcept {
  (void)::eventfd_write(descriptor, 1); // fails only when 2^64 - 2 rings were not heard
}

} // namespace rowe::rt
