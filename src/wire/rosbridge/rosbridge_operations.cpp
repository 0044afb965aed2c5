// SPDX-License-Identifier: Apache-2.0
#include "wire/rosbridge/rosbridge_operations.hpp"

#include "wire/codec/members.hpp"
#include "wire/rosbridge/rosbridge.hpp"

namespace rowe::wire::rosbridge {

bool names_operation(std::string_view text) noexcept {
  std::size_t from = 0;
  for (bool first = true; const auto value = behind_name(text, R"("op")", from); first = false) {
    const std::size_t name = text.find('"');
    if (first && text.substr(name).starts_with(R"("op")") && value->starts_with('"')) return true;
    if (!value->starts_with('"')) continue;
    const std::string_view word = value->substr(1, value->find('"', 1) - 1);
    if (word.size() + 1 < value->size() && operation_names.find(word) != operation_names.size()) return true;
  }
  return false;
}

} // namespace rowe::wire::rosbridge
