// SPDX-License-Identifier: Apache-2.0
// A set of processors, in the two spellings the kernel has for it.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools::fitness {

class cpu_list {
 public:
  static constexpr int cpu_max = 8191; // the kernel's own limit is NR_CPUS, 8192 at most

  cpu_list() = default;
  explicit cpu_list(std::vector<int> cpus);

  // "0-3,7"; an empty text is the empty set. Nothing: it is no such list.
  static std::optional<cpu_list> of_list(std::string_view text);
  // "ff,00000003": hexadecimal words of 32 bits, the highest first.
  static std::optional<cpu_list> of_mask(std::string_view text);

  bool empty() const noexcept { return cpus_.empty(); }
  bool contains(int cpu) const noexcept;
  bool contains_all(const cpu_list& others) const noexcept;
  cpu_list both(const cpu_list& others) const;    // in this one and in the others
  cpu_list without(const cpu_list& others) const; // in this one only
  std::string text() const;                       // "0-3,7"

  auto begin() const noexcept { return cpus_.begin(); }
  auto end() const noexcept { return cpus_.end(); }
  int back() const noexcept { return cpus_.back(); } // of a list that is not empty

 private:
  std::vector<int> cpus_; // in order, each once
};

} // namespace rowe::tools::fitness
