// SPDX-License-Identifier: Apache-2.0
#include "wire/numbers_codec.hpp"

#include <array>
#include <cstring>
#include <iterator>
#include <optional>
#include <utility>

#include "json/reading/reader.hpp"

namespace numbers {
namespace {

decoded refuse(diagnostic& why, decoded as = decoded::refused) noexcept {
  why = {.code = "bad_request", .text = "nobody understands this"};
  return as;
}

bool take_number(const json::value& from, std::uint32_t& into) noexcept {
  const auto number = json::to_unsigned(from);
  if (!number || *number >= no_number) return false;
  into = static_cast<std::uint32_t>(*number);
  return true;
}

// One element of a list.
bool take(const json::value& element, const decode_buffers& buffers, request& into) noexcept {
  into.by_number = into.what != verb::advertise;
  if (into.what == verb::unsubscribe) return take_number(element, into.tag);
  if (into.what == verb::unadvertise) {
    into.channel_is_peers = true;
    return take_number(element, into.channel);
  }
  json::array_walk two{element.raw};
  json::value first;
  json::value second;
  if (element.type != json::kind::array || !two.next(first) || !two.next(second)) return false;
  if (!take_number(first, into.tag)) return false;
  if (into.what == verb::subscribe) return take_number(second, into.channel);
  const auto name = json::to_string(second, buffers.scratch);
  if (!name || name->empty() || name->size() > buffers.limits.name_bytes_max) return false;
  into.topic = *name;
  return true;
}

message_kind write_list(json::writer& out, std::string_view kind, std::span<const listed> which) noexcept {
  out.append(kind);
  for (const listed& one : which) {
    out.append(four(one.number));
    out.append(four(static_cast<std::uint32_t>(one.name.size())));
    out.append(one.name);
  }
  return message_kind::binary;
}

} // namespace

std::string four(std::uint32_t number) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift);
  return bytes;
}

std::uint32_t number_at(std::string_view bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4 && i < bytes.size(); ++i)
    number |= std::uint32_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  return number;
}

// ---- reading

decoded numbers_decoder::decode(const json::document& text, const decode_buffers& buffers, request& into,
                                diagnostic& why) const noexcept {
  into.codec = numbers::id;
  constexpr std::pair<std::string_view, verb> lists[] = {{"want", verb::subscribe},
                                                         {"drop", verb::unsubscribe},
                                                         {"offer", verb::advertise},
                                                         {"keep", verb::unadvertise}};
  if (!json::is_object(text.text)) return refuse(why, decoded::malformed);
  for (std::uint8_t means = 0; means < std::size(lists); ++means) {
    const auto list = json::find(text, lists[means].first);
    if (buffers.from ? buffers.from.means != means : !list) continue;
    if (list->type != json::kind::array) return refuse(why);
    into.what = lists[means].second;
    into.verb_text = lists[means].first;
    json::array_walk elements =
        buffers.from ? json::array_walk{text.text, buffers.from.at} : json::array_walk{list->raw};
    json::value element;
    if (!elements.next(element)) return refuse(why);
    const auto next = static_cast<std::uint32_t>(elements.place_in(text.text));
    if (json::value more; elements.next(more)) into.next = {next, buffers.from.index + 1, means};
    return take(element, buffers, into) ? decoded::request : refuse(why);
  }
  return refuse(why);
}

decoded numbers_decoder::decode_binary(std::span<const std::byte> message, const decode_buffers&,
                                       request& into, diagnostic& why) const noexcept {
  const std::string_view bytes{reinterpret_cast<const char*>(message.data()), message.size()};
  into.codec = numbers::id;
  if (bytes.starts_with('x') && bytes.size() > 1) {
    into.what = verb::message;
    into.body_raw = bytes.substr(1);
    return decoded::request;
  }
  into.by_number = true;
  if (bytes.starts_with('p') && bytes.size() > 5) {
    into.what = verb::publish;
    into.channel = number_at(bytes.substr(1));
    into.channel_is_peers = true;
    into.body_raw = bytes.substr(5);
    return decoded::request;
  }
  if (bytes.starts_with('c') && bytes.size() >= 9) {
    into.what = verb::call;
    into.service_number = number_at(bytes.substr(1));
    into.id_raw = bytes.substr(5, 4);
    into.body_raw = bytes.substr(9);
    return decoded::request;
  }
  into.by_number = false;
  return refuse(why, decoded::malformed);
}

// Only what is published may be long.
std::size_t numbers_decoder::body_begins(std::byte kind) const noexcept {
  return kind == std::byte{'p'} ? 5 : 0;
}

codec_id numbers_decoder::guess(std::string_view, codec_id) const noexcept { return numbers::id; }

bool numbers_decoder::may_be_stop(opcode what, std::string_view begins) const noexcept {
  return what == opcode::binary && begins.starts_with('c') && number_at(begins.substr(1)) == 1;
}

// ---- writing

message_head numbers_codec::head_of(const delivery& to) const noexcept {
  message_head head{.size = 13, .as = message_kind::binary};
  head.bytes[0] = std::byte{'m'};
  for (std::size_t i = 0; i < 4; ++i) head.bytes[1 + i] = std::byte(to.tag >> (8 * i));
  for (std::size_t i = 0; i < 8; ++i) head.bytes[5 + i] = std::byte(to.published_ns >> (8 * i));
  return head;
}

message_kind numbers_codec::write_call(json::writer&, std::string_view, std::string_view,
                                       const call_args&) const noexcept {
  return message_kind::none; // its peers provide nothing
}

message_kind numbers_codec::write_reply(json::writer& out, const call_origin& call,
                                        const body& value) const noexcept {
  out.append("r");
  out.append(call.id_raw);
  value.write(out);
  return message_kind::binary;
}

message_kind numbers_codec::write_failure(json::writer& out, const call_origin& call,
                                          const diagnostic& why) const noexcept {
  out.append("f");
  out.append(call.id_raw);
  out.append(why.text);
  return message_kind::binary;
}

bool numbers_codec::means_no_service(const request&, std::string_view, std::string_view) const noexcept {
  return false;
}

message_kind numbers_codec::write_error(json::writer& out, const error_context& to,
                                        const diagnostic& why) const noexcept {
  if (to.to_server) return message_kind::none;
  out.append("e");
  out.append(why.text);
  return message_kind::binary;
}

message_kind numbers_codec::write_hello(json::writer& out, const greeting& who) const noexcept {
  out.append("h");
  out.append(who.name);
  return message_kind::binary;
}

message_kind numbers_codec::write_topics(json::writer& out, std::span<const listed> which,
                                         bool added) const noexcept {
  return write_list(out, added ? "T" : "t", which);
}

message_kind numbers_codec::write_services(json::writer& out, std::span<const listed> which,
                                           bool added) const noexcept {
  return write_list(out, added ? "S" : "s", which);
}

// ---- the row

const protocol_set& protocols() {
  static constexpr numbers_decoder reads;
  static constexpr numbers_codec writes;
  static const protocol_set& standard = protocols_of(rowe::websocket_profile::standard);
  static const auto codecs = [&] {
    std::array<const codec*, static_cast<std::size_t>(numbers::id) + 1> all{};
    std::copy(standard.codecs.begin(), standard.codecs.end(), all.begin());
    all.back() = &writes;
    return all;
  }();
  static const std::array<protocol, 4> rows{standard.find(""), standard.find("foxglove.sdk.v1"),
                                            standard.find("foxglove.websocket.v1"),
                                            protocol{.subprotocol = subprotocol,
                                                     .reads = reads,
                                                     .first = writes,
                                                     .topics = writes,
                                                     .can = {.binary = true, .listing = true}}};
  static const protocol_set set{.codecs = codecs,
                                .protocols = rows,
                                .offers = standard.offers,
                                .accepts = standard.accepts,
                                .messages = standard.messages,
                                .calls_to_server = standard.calls_to_server,
                                .envelope = standard.envelope,
                                .message_bytes_max = standard.message_bytes_max};
  return set;
}

} // namespace numbers
