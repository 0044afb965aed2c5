// SPDX-License-Identifier: Apache-2.0
// Decides who answers a call. The call comes from a handle or a thread of this process, or from a peer by any
// codec. It goes to a responder, to the receiver, to a peer or to the stop, or the endpoint answers it
// itself. call_completion.hpp reports its end to the caller. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/rt/clock.hpp>

#include "service/calls/call_completion.hpp"
#include "service/calls/long_calls.hpp"
#include "service/incoming/receiver.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/requests/call_requests.hpp"
#include "service/requests/endpoint_services.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/stop/stop_service.hpp"
#include "wire/codec/request.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

// A call of a handle or a thread of this process.
struct call_start {
  call_endpoint caller{};
  detail::call_ref own{};
  std::string_view service; // empty: the text names it
  wire::call_args what;
  detail::peer_ref to{}; // generation 0: whoever provides the service
  rt::time_point began{};
  rt::time_point deadline = rt::never;
};

struct call_router_needs {
  core_state& state_;
  const service_directory& service_directory_;
  refusals& refusals_;
  receiver& receiver_;
  local_delivery& local_delivery_;
  call_completion& call_completion_;
  long_calls& long_calls_;
  call_requests& call_requests_;
  endpoint_services& endpoint_services_;
  stop_service& stop_service_;
};

class call_router : call_router_needs {
 public:
  explicit call_router(const call_router_needs& parts) noexcept : call_router_needs{parts} {}

  // Takes a call of a peer that is within its rate and not for the stop. False: the receiver has no room now,
  // but it takes messages; the call was not taken.
  bool take_call(connection& c, const wire::request& asked) noexcept { return take_call(c, asked, {}); }
  // Takes a goal of a peer that is within its rate.
  void take_goal(connection& c, const wire::request& asked) noexcept { take_goal(c, asked, {}); }
  // Takes a call or a goal with a long value, for a service of a peer.
  void take_long(connection& c, const wire::request& asked, const long_value& value) noexcept;
  void cancel_goal(connection& c, const wire::request& asked) noexcept {
    call_completion_.goals().cancel(c, asked);
  }
  void take_feedback(const connection& c, const wire::request& said) noexcept {
    call_completion_.goals().take_feedback(c, said);
  }
  // Takes a peer's answer to a call or a goal that was given to it, perhaps with a long value.
  void take_reply(connection& c, const wire::request& said, const long_value& value = {}) noexcept {
    value && !said.failed ? long_calls_.take_reply(c, said, value) : call_completion_.take_reply(c, said);
  }
  void start(const call_start& asked) noexcept;

 private:
  // Other peers may cause `busy`, so a peer is not disconnected when it asks again.
  enum class cause : std::uint8_t { peer, busy };
  void refuse(connection& c, const wire::request& asked, cause by, std::string_view code,
              std::string_view why) noexcept;
  bool take_call(connection& c, const wire::request& asked, const long_value& value) noexcept;
  void take_goal(connection& c, const wire::request& asked, const long_value& value) noexcept;
  bool refuses_more(connection& c, const wire::request& asked) noexcept;
  void add(counter which) noexcept { state_.counts.add(which); }
  rt::time_point time_limit(rt::time_point since, std::int64_t time_ns) const noexcept;
  bool goes_to_receiver(std::string_view service) const noexcept;
  result<std::string_view> service_of(const call_start& asked, std::span<char> buffer) noexcept;
  void route(call_index call, const call_request& asked, detail::peer_ref to) noexcept;
  void ask_anyone(call_index call, const call_request& asked) noexcept;
};

} // namespace rowe::service
