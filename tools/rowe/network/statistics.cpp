// SPDX-License-Identifier: Apache-2.0
#include "statistics.hpp"

#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {
constexpr std::size_t losses_max = 256; // more than an endpoint has
}

std::vector<counted_loss> losses_in(json_value stats) {
  std::vector<counted_loss> all;
  const auto losses = stats.find("losses");
  if (!losses || losses->kind() != json_kind::object) return all;
  for (const auto [name, value] : losses->members()) {
    if (all.size() == losses_max) break;
    const auto count = value.get<std::uint64_t>();
    std::string called = plain_text_of(name);
    const bool is_chosen = called == "throttled" || called == "replaced";
    all.push_back({std::move(called), count ? *count : 0, is_chosen});
  }
  return all;
}

} // namespace rowe::tools
