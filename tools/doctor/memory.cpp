// SPDX-License-Identifier: Apache-2.0
// What moves memory about while a loop runs.
#include <array>

#include "../rowe/console.hpp"
#include "check.hpp"

namespace rowe::tools::fitness {
namespace {

finding huge_pages(const machine& on) {
  constexpr std::string_view path = "/sys/kernel/mm/transparent_hugepage/enabled";
  const reading file = on.files.read(path);
  if (!file) return unseen(path, file.error);
  const std::size_t open = file.text.find('[');
  const std::size_t close = file.text.find(']');
  if (open == std::string::npos || close == std::string::npos || close < open) {
    return {.found = joined("not visible here (", path, " chooses nothing)"), .visible = false};
  }
  const std::string chosen = file.text.substr(open + 1, close - open - 1);
  return {.mark = chosen == "always" ? level::warn : level::ok,
          .found = chosen,
          .commands = {joined("echo madvise > ", path)}};
}

finding same_pages(const machine& on) {
  constexpr std::string_view path = "/sys/kernel/mm/ksm/run";
  const auto run = on.files.number(path);
  if (!run) return unseen(path, on.files.read(path).error);
  return {.mark = *run == 1 ? level::warn : level::ok,
          .found = *run == 1 ? "merges pages" : "off",
          .commands = {joined("echo 2 > ", path)}};
}

finding numa_balancing(const machine& on) {
  return setting(on, "/proc/sys/kernel/numa_balancing", 0, level::warn);
}

finding swap(const machine& on) {
  const reading file = on.files.read("/proc/swaps");
  if (!file) return unseen("/proc/swaps", file.error);
  const auto lines = lines_of(file.text);
  if (lines.size() < 2) return {.found = "none"};
  finding result{.mark = level::warn, .commands = {"swapoff -a"}};
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto words = words_of(lines[i]);
    if (!words.empty()) result.found.append(joined(result.found.empty() ? "" : ", ", words.front()));
  }
  return result;
}

finding compaction(const machine& on) {
  return setting(on, "/proc/sys/vm/compaction_proactiveness", 0, level::info);
}

finding locked_pages(const machine& on) {
  return setting(on, "/proc/sys/vm/compact_unevictable_allowed", 0, level::warn);
}

finding fork_after_start(const machine&) {
  return {.mark = level::info, .found = "your program's: no fork, system or popen once the loop runs"};
}

// clang-format off
constexpr std::array<check, 7> memory_table{{
    {.name = "huge_pages", .title = "transparent huge pages", .wanted = "madvise or never",
     .why = "the kernel assembles huge pages while a program runs, and its pages fault meanwhile",
     .change = "allow them on request only", .examine = huge_pages},
    {.name = "same_pages", .title = "merging of equal pages", .wanted = "off",
     .why = "a merged page faults when it is written to", .change = "switch KSM off", .examine = same_pages},
    {.name = "numa_balancing", .title = "NUMA balancing", .wanted = "0",
     .why = "it makes pages fault on purpose, to see who uses them", .change = "switch it off",
     .examine = numa_balancing},
    {.name = "swap", .title = "swap", .wanted = "none",
     .why = "what is not locked can be swapped out, the program's own code and heap too",
     .change = "do without, or lock the whole program", .examine = swap},
    {.name = "compaction", .title = "compaction in advance", .wanted = "0",
     .why = "a thread of the kernel moves pages about in the background", .change = "switch it off",
     .examine = compaction},
    {.name = "locked_pages", .title = "compaction of locked pages", .wanted = "0",
     .why = "locked memory is moved, too, and a loop that touches it then waits",
     .change = "keep it from locked pages (PREEMPT_RT kernels do by default)", .examine = locked_pages},
    {.name = "fork", .title = "fork after start", .wanted = "none",
     .why = "after it each page of the stack and the heap faults at its next store (rowe's own are shared)",
     .change = "start other programs before the loop, or from another process", .examine = fork_after_start},
}};
// clang-format on

} // namespace

std::span<const check> memory_checks() { return memory_table; }

} // namespace rowe::tools::fitness
