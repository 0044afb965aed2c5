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
#include "service/broker.hpp"
#include "service/call_router.hpp"
#include "service/core_state.hpp"
#include "service/direct_messages.hpp"
#include "service/fragment_ingress.hpp"
#include "service/ingress.hpp"
#include "service/listings.hpp"
#include "service/long_ingress.hpp"
#include "service/receiver.hpp"
#include "service/refusals.hpp"
#include "service/registrations.hpp"
#include "service/stop_service.hpp"
#include "wire/codec.hpp"
#include "wire/protocols.hpp"
#include "wire/refusal.hpp"
#include "wire/request.hpp"
#include "wire/text_out.hpp"
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
    class long_ingress& long_ingress;
    class fragment_ingress& fragment_ingress;
    class direct_messages& direct_messages;
    class broker& broker;
    class listings& listings;
    class registrations& registrations;
    class call_router& call_router;
    class stop_service& stop_service;
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  dispatcher(rt::arena& memory, const needs& parts) noexcept;

  // A message of a peer. Its text may be written to.
  void dispatch(peer_index from, std::span<std::byte> message, bool binary) noexcept;
  // A piece of a long message of a peer; the last one, with which it is complete, is its event.
  void dispatch_piece(peer_index from, const wire::frame_step& step) noexcept;
  // A message that was parked (ingress::park), or of which some is left (ingress::go_on).
  void dispatch_again(peer_index from, std::span<std::byte> message, bool binary) noexcept;
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
  void begin(connection& c) noexcept {
    excess_ = !c.messages.take(state_.cycle.now);
    state_.counts.add(counter::messages_in);
    ++c.messages_in;
  }
  void read(connection& c, std::span<std::byte> message, bool binary) noexcept {
    binary ? read_binary(c, message) : read_text(c, message);
  }
  void read_text(connection& c, std::span<std::byte> message) noexcept;
  void read_binary(connection& c, std::span<std::byte> message) noexcept;
  void read_long(connection& c, const long_arrival& message, bool binary,
                 std::span<const std::byte> front) noexcept;
  void refuse_long(connection& c, wire::request& asked, const long_arrival& message) noexcept;
  void refuse_malformed(connection& c, std::string_view text, const error& why) noexcept;
  void take(connection& c, wire::decoded read, wire::request& asked, const json::document& known,
            const wire::diagnostic& why, std::span<std::byte> message) noexcept;
  stop_verb find_stop(const connection& c, wire::decoded& read, wire::request& asked,
                      const json::document& known, wire::diagnostic& refused) noexcept;
  void carry_out_stop(connection& c, wire::decoded read, const wire::request& asked,
                      const json::document& known, stop_verb of_stop) noexcept;
  void carry_out(connection& c, const wire::request& asked, const json::document& text,
                 const wire::diagnostic& unknown, std::span<std::byte> message) noexcept;
  void take_message(connection& c, const wire::request& asked, const json::document& text,
                    std::span<std::byte> message) noexcept;
  void take_fragments(connection& c, fragment_ingress::due due) noexcept;
  void carry_out_whole(connection& c) noexcept;
  void take_status(connection& c, const wire::request& asked) noexcept;
  bool drops_excess() noexcept;

  core_state& state_;
  refusals& refusals_;
  access_control& access_control_;
  receiver& receiver_;
  ingress& ingress_;
  long_ingress& long_ingress_;
  fragment_ingress& fragment_ingress_;
  direct_messages& direct_messages_;
  broker& broker_;
  listings& listings_;
  registrations& registrations_;
  call_router& call_router_;
  stop_service& stop_service_;
  std::array<char, unknown_text_bytes_max> unknown_text_; // why a number is none
  std::span<char> scratch_;   // the names and the id of the request; only decoders write here
  bool excess_ = false;       // the current message is beyond its peer's rate
  bool heard_before_ = false; // the current message was parked before
};

} // namespace rowe::service
