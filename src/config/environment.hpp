// SPDX-License-Identifier: Apache-2.0
// The variables of keys: ROWE_ENDPOINT_PORT sets endpoint.port.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace rowe::config {

// The index of the key whose variable this is; keys().size(): none.
std::size_t find_variable(std::string_view variable);

// What is wrong with a variable that no key has; empty if it is not meant for us: only those that begin with
// ROWE_ and a section's name are.
std::string unknown_variable(std::string_view variable);

} // namespace rowe::config
