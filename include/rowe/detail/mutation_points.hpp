// SPDX-License-Identifier: Apache-2.0
// Places where a test undoes a fix, to see that the simulation would have found the fault
// (tests/sim/mutants.hpp lists them). ROWE_MUTANT(name) is the constant false, except in the test that is
// compiled with ROWE_MUTANTS: there it says whether this is the mutant that runs.
#pragma once

#ifdef ROWE_MUTANTS
#include <cstdint>
#include <string_view>

namespace rowe::detail {

// FNV-1a, as service/state/topic_table.hpp.
constexpr std::uint64_t mutant_key(std::string_view name) noexcept {
  std::uint64_t key = 14695981039346656037U;
  for (const char c : name) key = (key ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return key;
}

inline std::uint64_t mutant_that_runs = 0; // written once, before anything runs

} // namespace rowe::detail

#define ROWE_MUTANT(name) (::rowe::detail::mutant_that_runs == ::rowe::detail::mutant_key(#name))
#else
#define ROWE_MUTANT(name) false
#endif
