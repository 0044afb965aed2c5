// SPDX-License-Identifier: Apache-2.0
#include "wire/protocols/protocols.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "wire/codec/own_names.hpp"
#include "wire/foxglove/foxglove_codec.hpp"
#include "wire/plain/plain.hpp"
#include "wire/plain/plain_codec.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "wire/rosbridge/rosbridge_encodings.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire {
namespace {

// ---- the JSON formats

constexpr bool decoders_fit(const name_limits& limits) {
  return rosbridge::scratch_bytes(limits) <= decode_scratch_bytes(limits) &&
         plain::scratch_bytes(limits) <= decode_scratch_bytes(limits);
}
static_assert(decoders_fit({.name_bytes_max = 0, .id_bytes_max = 0}) && decoders_fit({}));

constexpr std::string_view stop_marks[] = {"rowe/stop", "rowe\\/stop"};

bool says_stop(std::string_view escaped) noexcept {
  return json::says(escaped, stop_name) || json::says(escaped, stop_name.substr(1));
}

diagnostic diagnose(const refusal& why, const decode_buffers& buffers) noexcept {
  return {.code = why.code(), .text = why.text(buffers.diagnostic)};
}

// Reads text messages of the two JSON formats. Each message is recognised by itself: an object with a string
// member `op` is rosbridge's, everything else is in the plain format.
class json_decoder final : public message_decoder {
 public:
  // The codecs of rosbridge's encodings of messages, by rosbridge_encoding.
  using encodings = std::array<codec_id, 4>;
  constexpr json_decoder(codec_id plain, const encodings& rosbridge) noexcept
      : plain_{plain}, rosbridge_{rosbridge[0]}, encodings_{rosbridge} {}

  decoded decode(const json::document& text, const decode_buffers& buffers, request& into,
                 diagnostic& why) const noexcept override;
  codec_id guess(std::string_view text, codec_id spoke_last) const noexcept override;
  bool may_be_stop(opcode what, std::string_view begins) const noexcept override;

 private:
  decoded decode_rosbridge(const json::document& text, const decode_buffers& buffers, request& into,
                           diagnostic& why) const noexcept;
  decoded decode_other(const json::document& text, const decode_buffers& buffers, request& into,
                       diagnostic& why) const noexcept;

  codec_id plain_;
  codec_id rosbridge_;
  encodings encodings_;
};

decoded json_decoder::decode(const json::document& text, const decode_buffers& buffers, request& into,
                             diagnostic& why) const noexcept {
  // Clients of rosbridge put `op` first. So most of their members are not looked at twice.
  const json::member* const first = text.indexed.empty() ? nullptr : text.indexed.data();
  if (first != nullptr && json::name_is(*first, "op") && first->what.type == json::kind::string)
    return decode_rosbridge(text, buffers, into, why);
  return decode_other(text, buffers, into, why);
}

inline decoded json_decoder::decode_other(const json::document& text, const decode_buffers& buffers,
                                          request& into, diagnostic& why) const noexcept {
  auto op = plain::op_member::none;
  const auto wrong = plain::decode(text, buffers.scratch, buffers.limits, into, op);
  if (op == plain::op_member::text) return decode_rosbridge(text, buffers, into, why);
  into.codec = plain_;
  if (wrong) {
    why = diagnose(*wrong, buffers);
    return decoded::refused;
  }
  if (text.indexed.empty() && !json::is_object(text.text)) {
    why = diagnose({.what = refusal::kind::not_an_object}, buffers);
    return decoded::malformed;
  }
  return decoded::request;
}

inline decoded json_decoder::decode_rosbridge(const json::document& text, const decode_buffers& buffers,
                                              request& into, diagnostic& why) const noexcept {
  const auto wrong = rosbridge::decode(text, buffers.scratch, buffers.limits, into);
  into.codec = rosbridge_;
  into.messages_in = encodings_[into.encoding];
  if (wrong || into.what >= verb::unsupported)
    why = diagnose(wrong ? *wrong : rosbridge::refuse_op(into), buffers);
  if (wrong) return decoded::refused;
  return decoded::request;
}

codec_id json_decoder::guess(std::string_view text, codec_id spoke_last) const noexcept {
  if (rosbridge::names_operation(text)) return rosbridge_;
  return plain::names_id(text) ? plain_ : spoke_last;
}

// Whether a text that begins like this has a "service" or "topic" that is the stop, at its top level and not
// inside another value.
bool json_decoder::may_be_stop(opcode what, std::string_view begins) const noexcept {
  if (what != opcode::text) return false;
  const bool marked = std::any_of(std::begin(stop_marks), std::end(stop_marks), [&](std::string_view mark) {
    return begins.find(mark) != std::string_view::npos;
  });
  if (!marked) return false;
  int depth = 0;
  bool in_value = false;
  std::string_view name;
  for (std::size_t at = 0; at < begins.size(); ++at) {
    switch (begins[at]) {
    case '{':
    case '[': ++depth; break;
    case '}':
    case ']':
      if (--depth <= 0) return false;
      break;
    case ':': in_value = in_value || depth == 1; break;
    case ',': in_value = in_value && depth != 1; break;
    case '"': {
      const std::size_t begin = ++at;
      while (at < begins.size() && begins[at] != '"') at += begins[at] == '\\' ? 2U : 1U;
      if (at >= begins.size()) return false;
      const std::string_view said = begins.substr(begin, at - begin);
      if (depth != 1) break;
      if (!in_value) {
        name = said;
      } else if (name == "service" ? says_stop(said.substr(0, said.find('#')))
                                   : name == "topic" && says_stop(said)) {
        return true;
      }
      break;
    }
    default: break;
    }
  }
  return false;
}

// ---- all protocols

constexpr plain_codec plain{codec_id{0}};
// Of the next four, a peer that asks for several gets the last of those.
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

const protocol_set& protocols_of(websocket_profile profile) noexcept {
  switch (profile) {
  case websocket_profile::hop: return hop_set;
  case websocket_profile::hop_2014: return hop_2014_set;
  case websocket_profile::standard: break;
  }
  return standard_set;
}

} // namespace rowe::wire
