// SPDX-License-Identifier: Apache-2.0
// Carries out the messages of peers: decodes them to requests, and gives each request to its part. A stop
// comes before all else, even in a message that is refused or exceeds its peer's rate. Every refusal is
// counted, and answered with a status that names the value and the limit. Service thread only; nothing waits
// or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/access_control.hpp"
#include "service/advertisements.hpp"
#include "service/broker.hpp"
#include "service/call_router.hpp"
#include "service/core_state.hpp"
#include "service/direct_messages.hpp"
#include "service/ingress.hpp"
#include "service/listings.hpp"
#include "service/receiver.hpp"
#include "service/refusals.hpp"
#include "service/service_providers.hpp"
#include "service/stop_service.hpp"
#include "service/subscriptions.hpp"
#include "wire/codec.hpp"
#include "wire/protocols.hpp"
#include "wire/refusal.hpp"
#include "wire/request.hpp"
#include "json/reader.hpp"

namespace rowe::service {

class dispatcher {
 public:
  struct needs {
    core_state& state;
    class refusals& refusals;
    class access_control& access_control;
    class receiver& receiver;
    class ingress& ingress;
    class direct_messages& direct_messages;
    class broker& broker;
    class subscriptions& subscriptions;
    class advertisements& advertisements;
    class service_providers& service_providers;
    class listings& listings;
    class call_router& call_router;
    class stop_service& stop_service;
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  dispatcher(rt::arena& memory, const needs& parts) noexcept;

  // A message of a peer.
  void dispatch(peer_index from, std::span<const std::byte> message, bool binary) noexcept;
  // A message that was parked (ingress::park).
  void dispatch_again(peer_index from, std::span<const std::byte> message, bool binary) noexcept;
  // Whether dispatch() would carry out a stop. It makes the same decisions and changes nothing. It decodes
  // the message as a request, so it must not be called while another one is carried out.
  bool is_stop(peer_index from, std::span<const std::byte> message, bool binary) noexcept;

 private:
  using diagnostic_buffer = std::array<char, wire::refusal::text_bytes_max>;

  wire::decode_buffers decode_buffers(diagnostic_buffer& diagnostic, std::uint32_t from) const noexcept {
    return {.scratch = scratch_,
            .diagnostic = diagnostic,
            .limits = {.name_bytes_max = state_.bounds().topic_bytes_max},
            .from = from};
  }
  void read(connection& c, std::span<const std::byte> message, bool binary) noexcept {
    binary ? read_binary(c, message) : read_text(c, message);
  }
  void read_text(connection& c, std::span<const std::byte> message) noexcept;
  void read_binary(connection& c, std::span<const std::byte> message) noexcept;
  void refuse_malformed(connection& c, std::string_view text, const error& why) noexcept;
  void take(connection& c, wire::decoded read, wire::request& asked, const json::document& known,
            const wire::diagnostic& why) noexcept;
  stop_verb find_stop(const connection& c, wire::decoded& read, wire::request& asked,
                      const json::document& known, wire::diagnostic& refused) noexcept;
  void carry_out_stop(connection& c, wire::decoded read, const wire::request& asked,
                      const json::document& known, stop_verb of_stop) noexcept;
  void carry_out(connection& c, const wire::request& asked, const json::document& text,
                 const wire::diagnostic& unknown) noexcept;
  void take_message(connection& c, const wire::request& asked, const json::document& text) noexcept;
  void take_status(connection& c, const wire::request& asked) noexcept;
  bool drops_excess() noexcept;

  core_state& state_;
  refusals& refusals_;
  access_control& access_control_;
  receiver& receiver_;
  ingress& ingress_;
  direct_messages& direct_messages_;
  broker& broker_;
  subscriptions& subscriptions_;
  advertisements& advertisements_;
  service_providers& service_providers_;
  listings& listings_;
  call_router& call_router_;
  stop_service& stop_service_;
  std::span<char> scratch_;   // the names and the id of the request; only decoders write here
  bool excess_ = false;       // the current message is beyond its peer's rate
  bool heard_before_ = false; // the current message was parked before
};

} // namespace rowe::service
