// SPDX-License-Identifier: Apache-2.0
// Which codecs an endpoint uses with which peers. A third format is a decoder, a codec, and a row in
// protocols.cpp.
#pragma once
#include <cstddef>
#include <span>
#include <string_view>

#include <rowe/options.hpp>

#include "wire/codec/codec.hpp"

namespace rowe::wire {

// What the peer of a connection can take, and what must be announced to it.
struct capabilities {
  bool control_frames = true; // pings, pongs and close frames
  bool masks = true;          // frames of a client
  bool unmasked_accepted = false;
  bool topics = true;          // we announce to a server which topics and services we want and offer
  bool takes_messages = false; // plain messages, before it said one itself
  bool binary = false;         // binary messages have a meaning
  bool losses = false;         // a report to it says that messages for it were dropped
  bool listing = false;        // we announce to a client who we are, and which topics and services there are
  bool clock = false;          // a client gets the time all along, and shows what it gets at that time
  bool ttl_in_messages = true; // plain messages say what is left of their time to live;
  bool ttl_in_topics = false;  // so do those of topics, which rosbridge has not
  bool state_as_message = false; // it knows no topics: the stop's state is a plain message, unasked
};

// What a connection is bound to when it is opened.
struct protocol {
  std::string_view subprotocol; // WebSocket's; empty: none
  const message_decoder& reads;
  const codec& first;  // answers a text that is no JSON, before the peer has used a codec
  const codec& topics; // speaks with a peer about its topics and services
  capabilities can;
};

// The protocols of an endpoint, and what it must know before there is a connection.
struct protocol_set {
  std::span<const codec* const> codecs;      // by their ids
  std::span<const protocol> protocols;       // the first: of whoever has no subprotocol, or another one
  std::span<const std::string_view> offers;  // subprotocols: as a client;
  std::span<const std::string_view> accepts; // as a server
  const codec& messages;                     // of plain messages, and of calls in the object form
  const codec& calls_to_server;              // of other calls
  const codec& envelope;                     // around topics' messages
  std::size_t message_bytes_max;             // of one message to a peer

  const codec& of(codec_id which) const noexcept { return *codecs[static_cast<std::size_t>(which)]; }
  const protocol& find(std::string_view subprotocol) const noexcept;
  // Whether any of its protocols has the capability.
  bool any(bool capabilities::*what) const noexcept;
};

const protocol_set& protocols_of(websocket_profile profile) noexcept;

} // namespace rowe::wire
