// SPDX-License-Identifier: Apache-2.0
#include "wire/protocols.hpp"

#include <algorithm>
#include <array>

#include "wire/bare_codec.hpp"
#include "wire/json_decoder.hpp"
#include "wire/rosbridge_codec.hpp"

namespace rowe::wire {
namespace {

constexpr bare_codec bare{codec_id{0}};
constexpr rosbridge_codec rosbridge{codec_id{1}};
constexpr std::array<const codec*, 2> codecs{&bare, &rosbridge};
constexpr json_decoder json_texts{bare.id(), rosbridge.id()};

constexpr bool are_in_order() {
  for (std::size_t i = 0; i < codecs.size(); ++i) {
    if (codecs[i]->id() != codec_id{static_cast<std::uint8_t>(i)}) return false;
  }
  return true;
}
static_assert(are_in_order());

// A client that offers this subprotocol takes plain messages. A server that does not know it, such as
// rosbridge_server, selects none.
constexpr std::array<std::string_view, 1> own_subprotocols{"rowe.v1"};

constexpr std::array<protocol, 2> standard{
    {{.subprotocol = {}, .reads = json_texts, .first = bare, .topics = rosbridge, .can = {}},
     {.subprotocol = own_subprotocols[0],
      .reads = json_texts,
      .first = bare,
      .topics = rosbridge,
      .can = {.takes_messages = true}}}};
constexpr protocol_set standard_set{.codecs = codecs,
                                    .protocols = standard,
                                    .offers = own_subprotocols,
                                    .accepts = own_subprotocols,
                                    .messages = bare,
                                    .calls_to_server = rosbridge,
                                    .envelope = rosbridge,
                                    .message_bytes_max = SIZE_MAX};

// Hop's programs use bare JSON, have neither topics nor control frames, and have their own subprotocols.
constexpr std::array<protocol, 1> hop{
    {{.subprotocol = {},
      .reads = json_texts,
      .first = bare,
      .topics = rosbridge,
      .can = {.control_frames = false, .topics = false, .takes_messages = true, .state_as_message = true}}}};
// Those of 2014 do not mask either.
constexpr std::array<protocol, 1> hop_2014{{{.subprotocol = {},
                                             .reads = json_texts,
                                             .first = bare,
                                             .topics = rosbridge,
                                             .can = {.control_frames = false,
                                                     .masks = false,
                                                     .unmasked_accepted = true,
                                                     .topics = false,
                                                     .takes_messages = true,
                                                     .state_as_message = true}}}};

constexpr protocol_set set_of_hop(std::span<const protocol> protocols) noexcept {
  return {.codecs = codecs,
          .protocols = protocols,
          .offers = {},
          .accepts = own_subprotocols,
          .messages = bare,
          .calls_to_server = bare,
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
