// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/long_arrival.hpp"

#include "service/base/service_limits.hpp"
#include "service/incoming/json_fault.hpp"
#include "json/reading/scanner.hpp"

namespace rowe::service {

wire::diagnostic long_arrival::refusal(const limits& bounds, const wire::request& asked,
                                       std::span<char> buffer) const noexcept {
  using wire::verb;
  wire::text_out text{buffer};
  std::string_view what = asked.verb_text;
  if (what.empty() && asked.what == verb::publish) what = "publish";
  if (what.empty() && asked.what == verb::call) what = "call";
  const std::string_view name = asked.topic.empty() ? asked.service : asked.topic;
  text.add_name(what, verb_bytes_shown).add(what.empty() || name.empty() ? "" : " ");
  text.add_name(name, event_topic_bytes_shown).add(what.empty() && name.empty() ? "" : ": ");
  explain(bounds, text);
  return {.code = code(), .text = text.text()};
}

std::string_view long_arrival::code() const noexcept {
  switch (is) {
  case verdict::malformed: return wrong.name();
  case verdict::no_object: return "not_an_object";
  case verdict::no_room: return "full";
  case verdict::fine:
  case verdict::far_behind:
  case verdict::other_long:
  case verdict::unsupported: break;
  }
  return "too_big";
}

void long_arrival::explain(const limits& bounds, wire::text_out& into) const noexcept {
  const auto number = [](std::size_t of) { return static_cast<std::int64_t>(of); };
  switch (is) {
  case verdict::malformed: {
    std::array<char, detail::diagnostic_bytes_max> fault;
    into.add(explain_fault(wrong, {wrong_text.data(), wrong_text.size()}, fault));
    return;
  }
  case verdict::no_object: into.add("a message must be a JSON object with members"); return;
  case verdict::no_room:
    into.add("a message of ").add(number(bytes));
    into.add(" bytes was dropped: others use the room for long messages now; ");
    into.add("send it again later, or raise long_slots (").add(bounds.long_slots).add(")");
    return;
  case verdict::far_behind:
    into.add("the long member of a long message must be one of its first ");
    into.add(number(json::scanner::members_max));
    return;
  case verdict::other_long:
    into.add("only one member of a long message may be long: the others have ").add(number(others));
    into.add(" bytes, and may have ").add(number(long_envelope_bytes_max));
    return;
  case verdict::fine:
  case verdict::unsupported: break;
  }
  into.add("a message of ").add(number(bytes)).add(" bytes exceeds the limit message_bytes_max of ");
  into.add(bounds.message_bytes_max).add(": only messages of topics, and calls, may be longer");
}

} // namespace rowe::service
