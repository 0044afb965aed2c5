// SPDX-License-Identifier: Apache-2.0
#include "witness.hpp"

#if ROWE_TRIPWIRE
#include <rowe/rt/tripwire.hpp>
#else
#include <sys/resource.h>
#endif

namespace rowe::tools::bench {

#if ROWE_TRIPWIRE

struct witness::watch {
  rt::tripwire::scope wire = rt::tripwire::arm();

  thread_usage seen() {
    const rt::tripwire::report r = wire.disarm();
    return {r.page_faults, r.waits, r.preemptions, r.allocations, r.locks};
  }
};

#else

struct witness::watch {
  thread_usage before = now();

  static thread_usage now() {
    rusage used{};
    (void)::getrusage(RUSAGE_THREAD, &used);
    return {static_cast<std::uint64_t>(used.ru_minflt + used.ru_majflt),
            static_cast<std::uint64_t>(used.ru_nvcsw),
            static_cast<std::uint64_t>(used.ru_nivcsw),
            {},
            {}};
  }
  thread_usage seen() const {
    const thread_usage after = now();
    return {after.page_faults - before.page_faults,
            after.waits - before.waits,
            after.preemptions - before.preemptions,
            {},
            {}};
  }
};

#endif

witness::witness() : watch_{std::make_unique<watch>()} {}
witness::~witness() = default;
thread_usage witness::seen() { return watch_->seen(); }

} // namespace rowe::tools::bench
