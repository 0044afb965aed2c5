// SPDX-License-Identifier: Apache-2.0
// What an endpoint's statistics (/rowe/stats) say of messages that did not arrive.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include <rowe/json_value.hpp>

namespace rowe::tools {

struct counted_loss {
  std::string name;
  std::uint64_t count = 0;
  bool is_chosen = false; // somebody asked for fewer messages: it is no loss
};

// All that it counts, those that are 0 as well.
std::vector<counted_loss> losses_in(json_value stats);

} // namespace rowe::tools
