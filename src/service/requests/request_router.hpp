// SPDX-License-Identifier: Apache-2.0
// Folder requests: what a request asks for, and which part carries it out. Its results are stored elsewhere.
// Gives each request of a peer to the part that carries it out, once dispatcher.hpp has read it. A stop comes
// before all else, even in a message that is refused or exceeds its peer's rate. Every refusal is counted,
// and answered with a status that names the value and the limit. Service thread; never waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <utility>

#include "service/calls/direct_messages.hpp"
#include "service/graph/listings.hpp"
#include "service/incoming/access_control.hpp"
#include "service/incoming/fragment_ingress.hpp"
#include "service/incoming/ingress.hpp"
#include "service/incoming/long_arrival.hpp"
#include "service/incoming/receiver.hpp"
#include "service/incoming/refusals.hpp"
#include "service/requests/call_router.hpp"
#include "service/requests/registrations.hpp"
#include "service/state/core_state.hpp"
#include "service/stop/stop_service.hpp"
#include "service/topics/broker.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

struct read_request {
  const json::document& known;    // the part of its message that is JSON
  std::span<std::byte> message{}; // all of it; it may be written to
  wire::decoded read{};
  wire::diagnostic why{}; // if it is refused, or nobody here carries it out
  wire::request asked{};
};

struct request_router_needs {
  core_state& state_;
  refusals& refusals_;
  access_control& access_control_;
  receiver& receiver_;
  ingress& ingress_;
  fragment_ingress& fragment_ingress_;
  direct_messages& direct_messages_;
  broker& broker_;
  listings& listings_;
  registrations& registrations_;
  call_router& call_router_;
  stop_service& stop_service_;
};

class request_router : request_router_needs {
 public:
  explicit request_router(const request_router_needs& parts) noexcept : request_router_needs{parts} {}

  // ---- the message that is read now

  // It is the peer's, and counts against its rate.
  void begin(connection& c) noexcept {
    excess_ = !c.messages.take(state_.cycle.now);
    state_.counts.add(counter::messages_in);
    ++c.messages_in;
  }
  // One more request of it; each counts as a message.
  void count_another(connection& c) noexcept {
    if (!heard_before_ && !c.messages.take(state_.cycle.now)) excess_ = true;
  }
  // It was parked, and did count.
  void begin_again() noexcept { heard_before_ = true; }
  void end(connection& c) noexcept {
    heard_before_ = false;
    if (std::exchange(excess_, false)) refusals_.note_excess(c);
  }
  // Whether it exceeds its peer's rate; then it is dropped and counted, unless it is a stop.
  bool drops_excess() noexcept {
    if (excess_) state_.counts.add(counter::over_rate);
    return excess_;
  }
  // The same for one that was read: who asks with a number gets an error. If its peer has gone, it is dropped
  // where nobody else would see what comes of it.
  bool drops(connection& c, const wire::request& asked) noexcept {
    if (!c.gone || !wire::is_for_who_asks(asked.what)) {
      if (excess_) refusals_.fail_excess(c, asked);
      return drops_excess();
    }
    state_.counts.add(counter::left_behind);
    return true;
  }

  // ---- its requests

  using due = fragment_ingress::due;
  // Carries out a request. Returns what is due if it is a fragment.
  due take(connection& c, read_request& one) noexcept;
  // The same for one in a long message. Of a message that is not fine only some is known, so nothing but a
  // stop is done.
  void take_long(connection& c, read_request& one, const long_arrival& message) noexcept;
  // Whether take() would carry out a stop. Changes nothing but the request.
  bool is_stop(const connection& c, read_request& one) noexcept;
  // Whether there is a stop.
  bool has_stop() const noexcept { return stop_service_.in_use(); }

 private:
  stop_verb find_stop(const connection& c, read_request& one) noexcept;
  void carry_out_stop(connection& c, const read_request& one, stop_verb of_stop) noexcept;
  due carry_out(connection& c, const read_request& one) noexcept;
  void take_message(connection& c, const read_request& one) noexcept;
  void take_status(connection& c, const wire::request& asked) noexcept;
  bool takes_long(connection& c, wire::request& asked, const long_arrival& message) noexcept;
  void refuse_long(connection& c, wire::request& asked, const long_arrival& message) noexcept;

  std::array<char, unknown_text_bytes_max> unknown_text_; // why a number is none
  bool excess_ = false;                                   // the message is beyond its peer's rate
  bool heard_before_ = false;                             // the message was parked before
};

} // namespace rowe::service
