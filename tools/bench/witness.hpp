// SPDX-License-Identifier: Apache-2.0
// What happened to a thread while it measured, besides what it measured: a page fault or an allocation on the
// real-time thread is a finding, whatever the latencies say.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>

namespace rowe::tools::bench {

struct thread_usage {
  std::uint64_t page_faults = 0; // minor and major
  std::uint64_t waits = 0;       // voluntary context switches
  std::uint64_t preemptions = 0; // involuntary ones
  // Calls of malloc, free and their kin, and of locks, by whatever library; nothing where this build cannot
  // count them (a sanitizer has its own malloc).
  std::optional<std::uint64_t> allocations;
  std::optional<std::uint64_t> locks;
};

// Watches the calling thread from here until seen() or its own end. One at a time a thread.
class witness {
 public:
  witness();
  witness(const witness&) = delete;
  witness& operator=(const witness&) = delete;
  ~witness();

  thread_usage seen();

 private:
  struct watch;
  std::unique_ptr<watch> watch_;
};

} // namespace rowe::tools::bench
