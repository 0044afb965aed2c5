// SPDX-License-Identifier: Apache-2.0
#include "service/calls/long_calls.hpp"

#include <cstdint>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "wire/codec/codec.hpp"
#include "wire/protocols/protocols.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

void long_calls::track(call_index index, slot_id slot) noexcept {
  // Takes the outcome of the slot's former message, which may have been this call's own request.
  direct_messages_.track_reply(slot, {}, {}, state_.calls.ref(index));
  call& of = state_.calls.at(index);
  of.request = {slot, long_outbox_.generation_of(slot)};
  of.long_written = of.long_lost = false;
}

void long_calls::take_reply(const connection& c, const wire::request& said,
                            const long_value& value) noexcept {
  const bool of_goal = said.what == wire::verb::goal_result;
  const call_index index = call_completion_.goals().find_answered(c, said.id_raw, of_goal);
  if (!index) return;
  call& open = state_.calls.at(index);
  if (of_goal) open.goal_status = said.goal_status;
  if (open.caller.who != call_endpoint::kind::peer) return refuse(index, value);
  const connection* const caller = state_.peers.find(open.caller.connection());
  if (caller == nullptr || !caller->open()) {
    state_.counts.add(counter::replies_unsent);
    return call_completion_.close(index);
  }
  const wire::codec& codec = state_.seams.protocols.of(open.caller.speaks);
  const wire::call_origin asked = state_.calls.origin(index);
  const auto slot = long_outbox_.reply({caller->id.index}, value, [&](json::writer& into) {
    return codec.write_reply(into, asked, wire::body{said.body_raw});
  });
  if (!slot) return fail(index, value, slot.error());
  open.deadline = rt::deadline_after(state_.cycle.now, state_.options.call_timeout); // to begin to write it
  state_.due.disarm(index);
  state_.due.arm(index, open.deadline);
  open.callee = {}; // nobody answers it any more
  open.answered = true;
  track(index, *slot);
}

void long_calls::fail(call_index index, const long_value& value, const error& why) noexcept {
  const auto bytes = static_cast<std::int64_t>(state_.chunks.bytes(value.text));
  wire::text_of<wire::no_service_bytes_max> text;
  if (why.code == errc::full) {
    text.add("no room: a message of ").add(bytes).add(" bytes was dropped: others use the room for long ");
    text.add("messages now; call again later, or raise long_slots (")
        .add(state_.bounds().long_slots)
        .add(")");
  } else if (why.value > why.limit) {
    text.add("the call without its long value has ")
        .add(why.value)
        .add(" bytes, and may have ")
        .add(why.limit);
  } else {
    text.add("a relayed message must not contain ").add(long_mark);
  }
  call_completion_.fail(index, why, text.text());
}

void long_calls::refuse(call_index index, const long_value& value) noexcept {
  state_.counts.add(counter::too_big);
  const auto bytes = static_cast<std::int64_t>(state_.chunks.bytes(value.text));
  const auto most = static_cast<std::int64_t>(state_.bounds().message_bytes_max);
  wire::text_of<detail::diagnostic_bytes_max> why;
  why.add("a value of ").add(bytes).add(" bytes exceeds the limit message_bytes_max of ").add(most);
  why.add(": only calls between peers may be longer");
  call_completion_.fail(index, {errc::too_big, bytes, most}, why.text());
}

bool long_calls::waits_for_answer(call_index index) noexcept {
  const call& late = state_.calls.at(index);
  if (late.answered) return long_outbox_.is_being_written(late.request);
  const bool between_peers =
      late.caller.who == call_endpoint::kind::peer && late.callee.who == call_endpoint::kind::peer;
  if (!between_peers || !long_ingress_.began_by({late.callee.index}, late.deadline)) return false;
  state_.due.arm(index, state_.cycle.now + long_answer_look_period);
  return true;
}

bool long_calls::take_due(call_index index) noexcept {
  call& one = state_.calls.at(index);
  if (one.long_written) {
    call_completion_.close(index);
    return true;
  }
  if (std::exchange(one.long_lost, false)) {
    if (!ROWE_MUTANT(long_answer_lost)) call_completion_.fail_for_room(index);
    return true;
  }
  return waits_for_answer(index);
}

} // namespace rowe::service
