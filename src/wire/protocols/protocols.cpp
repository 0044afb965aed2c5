// SPDX-License-Identifier: Apache-2.0
#include "wire/protocols/protocols.hpp"

#include <algorithm>
#include <array>

#include "wire/foxglove/foxglove_codec.hpp"
#include "wire/foxglove/foxglove_decoder.hpp"
#include "wire/plain/plain_codec.hpp"
#include "wire/protocols/json_decoder.hpp"
#include "wire/rosbridge/rosbridge_encodings.hpp"

namespace rowe::wire {
namespace {

constexpr plain_codec plain{codec_id{0}};
constexpr rosbridge_json_codec rosbridge{codec_id{1}};
constexpr rosbridge_png_codec rosbridge_png{codec_id{2}};
constexpr rosbridge_cbor_codec rosbridge_cbor{codec_id{3}};
constexpr rosbridge_cbor_raw_codec rosbridge_cbor_raw{codec_id{4}};
constexpr foxglove_json_codec foxglove{codec_id{5}, codec_id{6}};
constexpr foxglove_times_codec foxglove_timed{codec_id{6}};
constexpr std::array<const codec*, 7> codecs{
    &plain, &rosbridge, &rosbridge_png, &rosbridge_cbor, &rosbridge_cbor_raw, &foxglove, &foxglove_timed};
constexpr json_decoder json_texts{
    plain.id(), {rosbridge.id(), rosbridge_png.id(), rosbridge_cbor.id(), rosbridge_cbor_raw.id()}};
constexpr foxglove_decoder foxglove_texts{foxglove.id()};

constexpr bool are_in_order() {
  for (std::size_t i = 0; i < codecs.size(); ++i) {
    if (codecs[i]->id() != codec_id{static_cast<std::uint8_t>(i)}) return false;
  }
  return true;
}
static_assert(are_in_order() && codecs.size() <= codecs_max);

// A client that offers this subprotocol takes plain messages. A server that does not know it, such as
// rosbridge_server, selects none.
constexpr std::array<std::string_view, 1> own_subprotocols{"rowe.v1"};

// Foxglove's own has had two names; the newer one first, because a client that offers both speaks it.
constexpr std::array<std::string_view, 3> standard_subprotocols{own_subprotocols[0], "foxglove.sdk.v1",
                                                                "foxglove.websocket.v1"};
constexpr protocol row_of_foxglove(std::string_view subprotocol) noexcept {
  return {.subprotocol = subprotocol,
          .reads = foxglove_texts,
          .first = foxglove,
          .topics = foxglove,
          .can = {.binary = true, .losses = true, .listing = true, .clock = true, .ttl_in_messages = false}};
}
constexpr std::array<protocol, 4> standard{
    {{.subprotocol = {}, .reads = json_texts, .first = plain, .topics = rosbridge, .can = {}},
     {.subprotocol = own_subprotocols[0],
      .reads = json_texts,
      .first = plain,
      .topics = rosbridge,
      .can = {.takes_messages = true, .ttl_in_topics = true}},
     row_of_foxglove(standard_subprotocols[1]),
     row_of_foxglove(standard_subprotocols[2])}};
constexpr protocol_set standard_set{.codecs = codecs,
                                    .protocols = standard,
                                    .offers = own_subprotocols,
                                    .accepts = standard_subprotocols,
                                    .messages = plain,
                                    .calls_to_server = rosbridge,
                                    .envelope = rosbridge,
                                    .message_bytes_max = SIZE_MAX};

// Hop programs use the plain format, have neither topics nor control frames, and have their own subprotocols.
constexpr std::array<protocol, 1> hop{{{.subprotocol = {},
                                        .reads = json_texts,
                                        .first = plain,
                                        .topics = rosbridge,
                                        .can = {.control_frames = false,
                                                .topics = false,
                                                .takes_messages = true,
                                                .ttl_in_messages = false,
                                                .state_as_message = true}}}};
// Those of 2014 do not mask either.
constexpr std::array<protocol, 1> hop_2014{{{.subprotocol = {},
                                             .reads = json_texts,
                                             .first = plain,
                                             .topics = rosbridge,
                                             .can = {.control_frames = false,
                                                     .masks = false,
                                                     .unmasked_accepted = true,
                                                     .topics = false,
                                                     .takes_messages = true,
                                                     .ttl_in_messages = false,
                                                     .state_as_message = true}}}};

constexpr protocol_set set_of_hop(std::span<const protocol> protocols) noexcept {
  return {.codecs = codecs,
          .protocols = protocols,
          .offers = {},
          .accepts = own_subprotocols,
          .messages = plain,
          .calls_to_server = plain,
          .envelope = rosbridge,
          .message_bytes_max = 65535}; // Hop writes nine length bytes beyond that, and reads none
}
constexpr protocol_set hop_set = set_of_hop(hop);
constexpr protocol_set hop_2014_set = set_of_hop(hop_2014);

} // namespace

const protocol& protocol_set::find(std::string_view subprotocol) const noexcept {
  const auto known = std::find_if(protocols.begin(), protocols.end(),
                                  [&](const protocol& one) { return one.subprotocol == subprotocol; });
  return known == protocols.end() ? protocols.front() : *known;
}

bool protocol_set::any(bool capabilities::*what) const noexcept {
  return std::any_of(protocols.begin(), protocols.end(),
                     [what](const protocol& one) { return one.can.*what; });
}

const protocol_set& protocols_of(peer_profile profile) noexcept {
  switch (profile) {
  case peer_profile::hop: return hop_set;
  case peer_profile::hop_2014: return hop_2014_set;
  case peer_profile::standard: break;
  }
  return standard_set;
}

} // namespace rowe::wire
