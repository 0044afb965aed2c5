// SPDX-License-Identifier: Apache-2.0
#include "service/long_arrival.hpp"

#include "wire/text_out.hpp"
#include "json/scanner.hpp"

namespace rowe::service {

wire::diagnostic long_arrival::refusal(const limits& bounds, std::span<char> buffer) const noexcept {
  wire::text_out text{buffer};
  switch (is) {
  case verdict::fine: return {};
  case verdict::malformed: return {.code = wrong.name(), .text = wrong.message(buffer)};
  case verdict::no_object:
    return {.code = "not_an_object", .text = "a message must be a JSON object with members"};
  case verdict::no_room:
    text.add("a message of ")
        .add(static_cast<std::int64_t>(bytes))
        .add(" bytes was dropped: others use the room for long messages now; ");
    text.add("send it again later, or raise long_slots (").add(bounds.long_slots).add(")");
    return {.code = "full", .text = text.text()};
  case verdict::far_behind:
    text.add("the long member of a long message must be one of its first ");
    text.add(static_cast<std::int64_t>(json::scanner::members_max));
    return {.code = "too_big", .text = text.text()};
  case verdict::other_long:
    text.add("only one member of a long message may be long: the others have ")
        .add(static_cast<std::int64_t>(bytes));
    text.add(" bytes, and may have ").add(static_cast<std::int64_t>(long_envelope_bytes_max));
    return {.code = "too_big", .text = text.text()};
  case verdict::unsupported: break;
  }
  text.add("the limit message_bytes_max is ").add(bounds.message_bytes_max);
  text.add(": only what is published may be longer");
  return {.code = "too_big", .text = text.text()};
}

} // namespace rowe::service
