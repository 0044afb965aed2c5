// SPDX-License-Identifier: Apache-2.0
// Calls between peers whose arguments or answers are long. Such a request, and such an answer, waits in a
// queue of its peer's for long ones, and may lose its room to others. So its slot is tracked: a call ends
// when its long answer was written, and fails if its request or its answer was lost. Service thread only;
// nothing waits or allocates.
#pragma once

#include "service/base/stand_in.hpp"
#include "service/calls/call_completion.hpp"
#include "service/calls/direct_messages.hpp"
#include "service/incoming/long_ingress.hpp"
#include "service/outgoing/long_outbox.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct long_calls_needs {
  core_state& state_;
  long_outbox& long_outbox_;
  const long_ingress& long_ingress_;
  direct_messages& direct_messages_;
  call_completion& call_completion_;
};

class long_calls : long_calls_needs {
 public:
  explicit long_calls(const long_calls_needs& parts) noexcept : long_calls_needs{parts} {}

  // Sends the request of a call to a peer. `write(json::writer&)` writes it with the stand-in.
  template <class Write>
  void send(call_index call, const connection& to, wire::codec_id in, const long_value& value,
            Write&& write) noexcept {
    const auto slot = long_outbox_.reply({to.id.index}, value, write);
    if (!slot) return fail(call, value, slot.error());
    state_.counts.add(counter::calls_out);
    state_.calls.at(call).callee = call_endpoint::of(to.id, in);
    track(call, *slot);
  }
  // A peer answers a call or a goal with a long value.
  void take_reply(const connection& c, const wire::request& said, const long_value& value) noexcept;
  // Ends a call with a value that only calls between peers may have.
  void refuse(call_index call, const long_value& value) noexcept;

  // A call is due. Ends one whose long answer was written, and fails one that lost its request or answer.
  // True: that was it, or its answer began in time and is still coming, or being written. False: its time is
  // over.
  bool take_due(call_index call) noexcept;

 private:
  void fail(call_index call, const long_value& value, const error& why) noexcept;
  void track(call_index call, slot_id slot) noexcept;
  bool waits_for_answer(call_index call) noexcept;
};

} // namespace rowe::service
