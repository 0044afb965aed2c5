// SPDX-License-Identifier: Apache-2.0
// Which machine a number comes from, in one line: without it no number is worth anything, so none is printed
// without it.
#pragma once
#include <string>
#include <vector>

namespace rowe::tools::bench {

struct machine {
  std::string host;
  std::string boot_id;    // one boot of one kernel: two processes that have the same share their clock
  std::string kernel;     // "6.1.0-18-rt-arm64"
  std::string processor;  // "aarch64, 4 CPUs"
  std::string real_time;  // "PREEMPT_RT", else what the kernel says it is: "PREEMPT_DYNAMIC"
  std::string governor;   // of the CPUs that are used: "performance"; "none" where there is no cpufreq
  std::string isolated;   // "2-3"; "none"
  std::string clock;      // "tsc, 21 ns"
  std::string hypervisor; // its name, "yes"; "none"
  std::string load;       // one-minute load average when the run began

  // What is worth knowing before any number is believed, each a sentence. Cheap facts only: `rowe doctor`
  // looks at everything.
  std::vector<std::string> warnings;

  bool is_real_time() const noexcept { return real_time == "PREEMPT_RT"; }
  std::string line() const;
};

// Reads it below `root` (empty: this machine; tests bring a tree of their own). `cpus`: those that are used.
machine machine_at(const std::string& root, const std::vector<int>& cpus);
machine this_machine(const std::vector<int>& cpus);

} // namespace rowe::tools::bench
