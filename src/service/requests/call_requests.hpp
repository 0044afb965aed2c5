// SPDX-License-Identifier: Apache-2.0
// Hands the request of a call to its callee: a responder, the receiver, a peer, or the stop. If that fails,
// the call ends. Service thread only; nothing waits or allocates.
#pragma once
#include <string_view>
#include <utility>

#include <rowe/detail/queue_pair.hpp>

#include "service/calls/call_completion.hpp"
#include "service/calls/direct_messages.hpp"
#include "service/calls/long_calls.hpp"
#include "service/incoming/receiver.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "service/stop/stop_service.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

// What is called, and what the call asks of the stop.
struct call_request {
  std::string_view service; // empty: only the text names it
  wire::call_args what;
  long_value value{}; // what a stand-in in the text stands for
  stop_verb of_stop = stop_verb::none;
  bool goal = false;       // of an action,
  std::string_view type{}; // which has this type
};

struct call_requests_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  local_delivery& local_delivery_;
  receiver& receiver_;
  direct_messages& direct_messages_;
  call_completion& call_completion_;
  long_calls& long_calls_;
  stop_service& stop_service_;
};

class call_requests : call_requests_needs {
 public:
  explicit call_requests(const call_requests_needs& parts) noexcept;

  // Sends the request to a peer. Without a peer it waits for the first one that connects.
  void send(call_index call, const connection* to, const wire::codec& in, const call_request& asked) noexcept;
  // Hands it to a responder of this process.
  void hand_to_pair(call_index call, pair_index pair, const wire::call_args& what) noexcept;
  // Hands it to the receiver, as one object, whatever codec it came by.
  void hand_to_receiver(call_index call, const call_request& asked) noexcept;
  // Carries out a stop. Only for calls of this process: a peer's stop is carried out before calls are routed.
  void hand_to_stop(call_index call, const call_request& asked) noexcept;

  // The handle that was given a call last in this cycle, and may answer at once; or none.
  pair_index awaited() const noexcept { return awaited_; }
  pair_index take_awaited() noexcept { return std::exchange(awaited_, {}); }
  void forget_pair(pair_index pair) noexcept {
    if (awaited_ == pair) awaited_ = {};
  }

 private:
  detail::value_header header_of(call_index call) const noexcept;
  void refuse(call_index call, std::string_view why) noexcept {
    call_completion_.fail(call, {errc::refused}, why);
  }

  slot_pool& slots_;
  pair_index awaited_{};
};

} // namespace rowe::service
