// SPDX-License-Identifier: Apache-2.0
// What a fuzzer checks: a claim that fails ends the process and prints its text, and libFuzzer keeps the
// input.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string_view>

namespace rowe::fuzz {

inline void require(bool claim, const char* words) {
  if (claim) return;
  std::fprintf(stderr, "does not hold: %s\n", words);
  std::abort();
}

// What is empty lies everywhere.
inline bool lies_in(std::string_view part, std::string_view whole) {
  return part.empty() || (std::less_equal<>{}(whole.data(), part.data()) &&
                          std::less_equal<>{}(part.data() + part.size(), whole.data() + whole.size()));
}

} // namespace rowe::fuzz
