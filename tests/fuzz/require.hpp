// SPDX-License-Identifier: Apache-2.0
// What a fuzzer checks: a claim that fails ends the process and prints its text, and libFuzzer keeps the
// input.
#pragma once
#include <cstdio>
#include <cstdlib>

namespace rowe::fuzz {

inline void require(bool claim, const char* words) {
  if (claim) return;
  std::fprintf(stderr, "does not hold: %s\n", words);
  std::abort();
}

} // namespace rowe::fuzz
