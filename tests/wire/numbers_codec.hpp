// SPDX-License-Identifier: Apache-2.0
// A third codec, as small as one can be that has all which rosbridge and the plain format have not: binary
// frames, numbers in place of names, numbers that the peer gives, several requests in one message, and a
// server that speaks first. This file, its source and the row at its end are all of it; nothing in
// src/service knows it.
//
// Integers have four bytes, the lowest first; times eight. To the server:
//   text    {"want":[[TAG,CHANNEL],…]}          subscribes, each under the peer's own TAG
//           {"drop":[TAG,…]}                    unsubscribes
//           {"offer":[[CHANNEL,"/name"],…]}     advertises, under the peer's own CHANNEL
//           {"keep":[CHANNEL,…]}                unadvertises
//   binary  p CHANNEL JSON                      publishes on what the peer has offered
//           c SERVICE ID JSON                   calls
//           x JSON                              a plain message
// To the client, all binary:
//   h NAME                                      hello
//   T, t, S, s: so many times NUMBER BYTES NAME topics and services that were added, or removed (lower case)
//   m TAG TIME JSON                             a topic's message
//   r ID JSON; f ID TEXT; e TEXT                a reply, a failure, an error
#pragma once
#include <string>
#include <string_view>

#include "wire/protocols/protocols.hpp"

namespace numbers {

using namespace rowe::wire;
namespace json = rowe::json;

inline constexpr std::string_view subprotocol = "numbers.v1";
inline constexpr codec_id id{7}; // behind those of the standard profile

std::string four(std::uint32_t number);
std::uint32_t number_at(std::string_view bytes);

class numbers_decoder final : public message_decoder {
 public:
  decoded decode(const json::document& text, const decode_buffers& buffers, request& into,
                 diagnostic& why) const noexcept override;
  decoded decode_binary(std::span<const std::byte> message, const decode_buffers& buffers, request& into,
                        diagnostic& why) const noexcept override;
  std::size_t body_begins(std::byte kind) const noexcept override;
  codec_id guess(std::string_view text, codec_id spoke_last) const noexcept override;
  bool may_be_stop(opcode what, std::string_view begins) const noexcept override;
};

class numbers_codec final : public codec {
 public:
  constexpr numbers_codec() noexcept
      : codec{{.id = numbers::id, .name = "numbers", .fails_as_refusal = false}} {}

  message_head head_of(const delivery& to) const noexcept override;
  message_kind write_call(json::writer& out, std::string_view service, std::string_view id,
                          const call_args& args) const noexcept override;
  message_kind write_reply(json::writer& out, const call_origin& call,
                           const body& value) const noexcept override;
  message_kind write_failure(json::writer& out, const call_origin& call,
                             const diagnostic& why) const noexcept override;
  bool means_no_service(const request& failed, std::string_view diagnostic,
                        std::string_view service) const noexcept override;
  message_kind write_error(json::writer& out, const error_context& to,
                           const diagnostic& why) const noexcept override;
  message_kind write_hello(json::writer& out, const greeting& who) const noexcept override;
  message_kind write_topics(json::writer& out, std::span<const listed> which,
                            bool added) const noexcept override;
  message_kind write_services(json::writer& out, std::span<const listed> which,
                              bool added) const noexcept override;
};

// The protocols of clients that offer no subprotocol, of Foxglove's, and one row more.
const protocol_set& protocols();

} // namespace numbers
