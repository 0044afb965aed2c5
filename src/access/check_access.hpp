// SPDX-License-Identifier: Apache-2.0
// What is wrong with the access options, and where: check_access() for those who report the place. Set-up:
// allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <rowe/access.hpp>

namespace rowe::access {

struct fault {
  enum class place : std::uint8_t { options, role, identity, local_role };
  place where = place::options;
  std::size_t index = 0; // of the role or the identity
  std::string text;      // in words that name the value and what is allowed
};

// One for each role and identity at most, and check_access() says the first; empty: nothing is wrong. If
// there are too many roles or identities, that alone.
std::vector<fault> faults_of(const access_options& options);

} // namespace rowe::access
