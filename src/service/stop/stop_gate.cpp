// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_gate.hpp"

#include <array>
#include <cassert>

#include "wire/codec/own_names.hpp"

namespace rowe::service {
namespace {

constexpr std::array<std::string_view, 4> names{wire::stop_name, wire::stop_reset_name, wire::stop_guard_name,
                                                wire::stop_state_name};

} // namespace

stop_verb stop_gate::service_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i] || name == names[i].substr(1)) return static_cast<stop_verb>(i + 1);
  }
  return stop_verb::none;
}

std::string_view stop_gate::name_of(stop_verb which) noexcept {
  assert(which != stop_verb::none);
  return names[static_cast<std::size_t>(which) - 1];
}

bool stop_gate::asks_to_stop(const json::document& text) noexcept {
  for (const std::string_view member : {"service", "topic"}) {
    auto found = json::find(text, member);
    if (!found || found->type != json::kind::string) continue;
    const std::size_t mark = member == "service" ? found->raw.find('#') : std::string_view::npos;
    if (mark != std::string_view::npos) found->raw = found->raw.substr(0, mark + 1); // in place of the quote
    if (json::text_is(*found, wire::stop_name) || json::text_is(*found, wire::stop_name.substr(1)))
      return true;
  }
  return false;
}

stop_verb stop_gate::find(wire::decoded read, const wire::request& asked,
                          const json::document& text) noexcept {
  using wire::verb;
  const stop_verb called = asked.what == verb::call ? service_named(asked.service) : stop_verb::none;
  const bool published = asked.what == verb::publish && service_named(asked.topic) == stop_verb::stop;
  const bool stops = published || called == stop_verb::stop;
  if (read == wire::decoded::request && asked.what != verb::message)
    return published ? stop_verb::stop : called;
  // If a text is refused, some members may be unread. A refused frame names its service by number.
  return asks_to_stop(text) || (asked.by_number && stops) ? stop_verb::stop : stop_verb::none;
}

stop_verb stop_gate::find(std::string_view service, const wire::call_args& what) noexcept {
  const stop_verb named = service_named(service);
  const bool object = what.is == wire::call_args::form::object;
  return named == stop_verb::none && object && asks_to_stop(what.text) ? stop_verb::stop : named;
}

bool stop_gate::is_for_stop_peers(const wire::request& asked) noexcept {
  using wire::verb;
  switch (asked.what) {
  case verb::call: return true;
  case verb::publish: return service_named(asked.topic) == stop_verb::stop;
  case verb::subscribe:
  case verb::unsubscribe: return service_named(asked.topic) == stop_verb::state;
  default: return false;
  }
}

} // namespace rowe::service
