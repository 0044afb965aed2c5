// SPDX-License-Identifier: Apache-2.0
#include "stops.hpp"

#include <string_view>

namespace rowe::tools {
namespace {

std::string text_at(json_value object, std::string_view member) {
  const auto text = object.get<std::string>(member);
  return text ? *text : std::string{};
}
std::uint64_t count_at(json_value object, std::string_view member) {
  const auto count = object.get<std::uint64_t>(member);
  return count ? *count : 0;
}

} // namespace

void note_stop_state(json_value state, std::int64_t time_ns, std::vector<recorded_stop>& into) {
  const auto word = state.get<std::string>("state");
  if (!word) return;
  const std::uint64_t number = count_at(state, "number");
  const bool open = !into.empty() && into.back().until_ns == 0;
  if (*word != "stopped") {
    if (open) into.back().until_ns = time_ns;
    return;
  }
  if (open && into.back().number == number) return;
  if (open) into.back().until_ns = time_ns;
  into.push_back({.number = number,
                  .cause = text_at(state, "cause"),
                  .source = text_at(state, "source"),
                  .seen_ns = time_ns});
}

std::optional<recorded_loss> loss_in(json_value said) {
  const auto topic = said.get<std::string>("topic");
  const std::uint64_t count = count_at(said, "messages");
  if (!topic || count == 0) return std::nullopt;
  return recorded_loss{*topic, count};
}

} // namespace rowe::tools
