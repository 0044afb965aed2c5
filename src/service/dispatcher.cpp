// SPDX-License-Identifier: Apache-2.0
#include "service/dispatcher.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "service/json_fault.hpp"
#include "service/service_limits.hpp"
#include "service/stop_gate.hpp"
#include "json/writer.hpp"

namespace rowe::service {
namespace {

// Scratch for the longest names a request may have.
std::size_t scratch_bytes(const limits& bounds) noexcept {
  return wire::decode_scratch_bytes({.name_bytes_max = bounds.topic_bytes_max});
}

std::string_view text_of(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The text as its sender gave it to a rowe endpoint, which put the time to live in front. So a program may
// send on what it received. The valid text lies in the message, where a brace is written.
std::string_view without_ttl(std::string_view text, std::span<std::byte> message) noexcept {
  if (!text.starts_with(R"({"ttl_ms":)")) return text;
  const std::size_t at = text.find_first_of(",}"); // behind a number, so in no string
  assert(at != std::string_view::npos);
  text.remove_prefix(text[at] == '}' ? at - 1 : at);
  message[static_cast<std::size_t>(text.data() - text_of(message).data())] = std::byte{'{'};
  return text;
}

constexpr std::string_view long_list_diagnostic =
    "the message lists too many requests, or is too long for so many: use several messages";

} // namespace

std::size_t dispatcher::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for(scratch_bytes(bounds));
}

dispatcher::dispatcher(rt::arena& memory, const needs& parts) noexcept
    : state_{parts.state},
      refusals_{parts.refusals},
      access_control_{parts.access_control},
      receiver_{parts.receiver},
      ingress_{parts.ingress},
      long_ingress_{parts.long_ingress},
      fragment_ingress_{parts.fragment_ingress},
      direct_messages_{parts.direct_messages},
      broker_{parts.broker},
      listings_{parts.listings},
      registrations_{parts.registrations},
      call_router_{parts.call_router},
      stop_service_{parts.stop_service},
      scratch_{memory.carve<char>(scratch_bytes(state_.bounds()))} {}

// ---- messages

void dispatcher::dispatch(peer_index from, std::span<std::byte> message, bool binary) noexcept {
  connection& c = state_.peers[from];
  begin(c);
  read(c, message, binary);
  if (std::exchange(excess_, false)) refusals_.note_excess(c);
}

void dispatcher::dispatch_again(peer_index from, std::span<std::byte> message, bool binary) noexcept {
  connection& c = state_.peers[from];
  if (fragment_ingress_.comes_again(from)) [[unlikely]] {
    if (!fragment_ingress_.was_parked(from)) return take_fragments(c, fragment_ingress_.go_on(c, message));
    heard_before_ = true;
    carry_out_whole(c);
  } else {
    heard_before_ = true;
    read(c, message, binary);
  }
  heard_before_ = false;
}

void dispatcher::dispatch_piece(peer_index from, const wire::frame_step& step) noexcept {
  long_ingress_.take(from, step);
  if (step.event == wire::frame_event::piece) return;
  connection& c = state_.peers[from];
  const bool binary = step.event == wire::frame_event::binary;
  if (binary && !c.protocol->can.binary) {
    long_ingress_.forget(from);
    state_.counts.add(counter::refused_requests);
    return state_.peers.close_later(c, no_binary_diagnostic, wire::close_code::unsupported_data);
  }
  const std::span<const std::byte> front = ingress_.front(from);
  const long_arrival arrival = long_ingress_.end(from, long_ingress::way::frames, binary, front);
  begin(c);
  read_long(c, arrival, binary, front);
  if (std::exchange(excess_, false)) refusals_.note_excess(c);
  if (arrival.body) state_.chunks.release(arrival.body);
}

inline void dispatcher::read_text(connection& c, std::span<std::byte> payload) noexcept {
  const std::string_view text = text_of(payload);
  if (const status valid = state_.seams.validator.validate(text); !valid) {
    state_.counts.add(counter::malformed);
    if (drops_excess()) return;
    return refuse_malformed(c, text, valid.error());
  }
  json::document known = state_.seams.validator.last(); // its members are noted until the next validation
  const limits& bounds = state_.bounds(); // no list is longer than what a peer may hold of what is listed
  std::uint32_t left =
      std::max(bounds.subscriptions_per_connection_max, bounds.advertisements_per_connection_max);
  std::size_t bytes_left = 4 * bounds.message_bytes_max; // for each, the text is read again
  for (std::uint32_t from = 0;;) {
    wire::request asked;
    wire::diagnostic why;
    diagnostic_buffer diagnostic;
    const wire::decoded read = c.protocol->reads.decode(known, decode_buffers(diagnostic, from), asked, why);
    take(c, read, asked, known, why, payload);
    from = asked.next;
    if (from == 0 || !c.open()) return;
    if (!heard_before_ && !c.messages.take(state_.cycle.now)) excess_ = true; // each counts as a message
    state_.cycle.work_bytes += read_work_bytes;                               // likewise
    if (--left == 0 || text.size() > bytes_left) {
      if (drops_excess()) return;
      return refusals_.refuse(c, asked.codec, {}, {.code = "refused", .text = long_list_diagnostic});
    }
    bytes_left -= text.size();
    known = json::document{text}; // what was noted may be gone
  }
}

void dispatcher::read_binary(connection& c, std::span<std::byte> message) noexcept {
  wire::request asked;
  wire::diagnostic why;
  diagnostic_buffer diagnostic;
  wire::decoded read = c.protocol->reads.decode_binary(message, decode_buffers(diagnostic, 0), asked, why);
  if (read == wire::decoded::unsupported) {
    state_.counts.add(counter::refused_requests);
    return state_.peers.close_later(c, no_binary_diagnostic, wire::close_code::unsupported_data);
  }
  json::document body;
  if (read == wire::decoded::request && !asked.body_raw.empty()) {
    if (const status valid = state_.seams.validator.validate(asked.body_raw); !valid) {
      read = wire::decoded::malformed;
      why = {.code = valid.error().name(),
             .text = explain_fault_in(valid.error(), asked.body_raw, diagnostic)};
    } else if (body = state_.seams.validator.last(); !json::is_object(body.text)) {
      read = wire::decoded::malformed;
      why = {.code = "not_an_object", .text = "the body must be a JSON object"};
    }
  }
  take(c, read, asked, body, why, message);
}

// Only messages of topics may be long. A long stop is a stop: also one that found no room, or that may not be
// so long. Of such a message only some is known, so nothing else that it asks for is done.
void dispatcher::read_long(connection& c, const long_arrival& message, bool binary,
                           std::span<const std::byte> front) noexcept {
  using verdict = long_arrival::verdict;
  diagnostic_buffer diagnostic;
  const std::string_view text = text_of(message.envelope);
  const bool fine = message.is == verdict::fine;
  json::document known;
  if (!binary && state_.seams.validator.validate(text)) known = state_.seams.validator.last(); // it is valid
  wire::request asked;
  wire::diagnostic why;
  const wire::decode_buffers buffers = decode_buffers(diagnostic, 0);
  wire::decoded read = binary ? c.protocol->reads.decode_binary(message.envelope, buffers, asked, why)
                              : c.protocol->reads.decode(known, buffers, asked, why);
  // Where neither an operation nor an id is known, it is not known what it is.
  if (!fine && !binary && asked.what == wire::verb::message)
    asked.codec = c.protocol->reads.guess(text_of(front), c.spoke_last);
  c.spoke_last = asked.codec;
  if (read == wire::decoded::malformed || message.is == verdict::malformed)
    state_.counts.add(counter::malformed);
  stop_verb of_stop = ROWE_MUTANT(long_stop) ? stop_verb::none : find_stop(c, read, asked, known, why);
  if (!fine && (of_stop != stop_verb::stop || (message.is == verdict::malformed && !binary) ||
                (ROWE_MUTANT(long_stop_room) && message.is == verdict::no_room)))
    of_stop = stop_verb::none;
  if (of_stop != stop_verb::none) return carry_out_stop(c, read, asked, known, of_stop);
  if (message.is == verdict::no_room) state_.counts.add(counter::no_chunks);
  if (message.is == verdict::far_behind || message.is == verdict::other_long ||
      message.is == verdict::unsupported)
    state_.counts.add(counter::too_big);
  if (drops_excess() || (ROWE_MUTANT(long_told) && message.is == verdict::no_room)) return;
  if (read != wire::decoded::request && (fine || (binary && asked.what == wire::verb::unknown)))
    return refusals_.refuse(c, asked, why);
  if (fine && asked.what == wire::verb::publish &&
      asked.body_raw.data() == text.data() + message.stand_in_at) {
    if (access_control_.permits(c, asked)) broker_.relay(c, asked, message.body);
    return;
  }
  if (fine) state_.counts.add(counter::too_big);
  refuse_long(c, asked, message);
}

// Who waits for the answer to a call is told at once.
void dispatcher::refuse_long(connection& c, wire::request& asked, const long_arrival& message) noexcept {
  using wire::verb;
  diagnostic_buffer buffer;
  const wire::diagnostic why = message.refusal(state_.bounds(), asked, buffer);
  const bool answerable =
      asked.by_number || !asked.service.empty() || asked.form == wire::call_args::form::object;
  if ((asked.what == verb::call || asked.what == verb::send_goal) && answerable) {
    state_.counts.add(counter::calls_in);
    return refusals_.refuse_call(c, asked, why);
  }
  refusals_.refuse(c, asked.codec, asked.id_raw, why);
  if (asked.what != verb::reply && asked.what != verb::goal_result) return;
  std::array<char, wire::error_bytes_max> quoted;
  json::writer words{quoted};
  words.string(why.text);
  asked.failed = true;
  asked.code = why.code;
  asked.body_raw = {quoted.data(), words.bytes()};
  call_router_.take_reply(c, asked);
}

// Takes one request of a message. `known`: the part of the message that is JSON.
inline void dispatcher::take(connection& c, wire::decoded read, wire::request& asked,
                             const json::document& known, const wire::diagnostic& why,
                             std::span<std::byte> message) noexcept {
  c.spoke_last = asked.codec;
  if (read == wire::decoded::malformed) state_.counts.add(counter::malformed);
  // A peer that uses the codec of plain messages also takes them.
  const bool speaks_messages =
      asked.codec == state_.seams.protocols.messages.id() && read != wire::decoded::malformed;
  if (speaks_messages && !c.stop_only && !std::exchange(c.takes_messages, true))
    direct_messages_.deliver_pending({c.id.index});
  wire::diagnostic refused = why;
  const stop_verb of_stop = find_stop(c, read, asked, known, refused);
  if (of_stop != stop_verb::none) carry_out_stop(c, read, asked, known, of_stop);
  if (read == wire::decoded::request) {
    if (of_stop == stop_verb::none) carry_out(c, asked, known, refused, message);
  } else if (!drops_excess()) {
    refusals_.refuse(c, asked, refused);
  }
}

// What the request asks of the stop, if anything. Before that, names replace numbers; a request with an
// unknown number is refused.
inline stop_verb dispatcher::find_stop(const connection& c, wire::decoded& read, wire::request& asked,
                                       const json::document& known, wire::diagnostic& refused) noexcept {
  if (asked.by_number) {
    const unknown_number unknown = listings_.put_names(c, asked);
    if (!unknown.why.empty() && read == wire::decoded::request) {
      read = wire::decoded::refused;
      wire::text_out text{unknown_text_};
      refused = {.code = "unknown_number", .text = text.add(unknown.why).add(unknown.number).text()};
    }
  }
  // A peer on stop_path is never called, so a message of it that looks like an answer is a plain message.
  const bool object = asked.form == wire::call_args::form::object;
  if (c.stop_only && asked.what == wire::verb::reply && object) asked.what = wire::verb::message;
  if (!stop_service_.in_use()) return stop_verb::none;
  const stop_verb found = stop_gate::find(read, asked, known);
  return c.stop_only && !stop_gate::is_for_stop_peers(found) ? stop_verb::none : found;
}

// Comes before all else, whatever the peer's rate is. Only a call is answered.
inline void dispatcher::carry_out_stop(connection& c, wire::decoded read, const wire::request& asked,
                                       const json::document& known, stop_verb of_stop) noexcept {
  const wire::verb what = read == wire::decoded::request ? asked.what : wire::verb::message;
  if (what != wire::verb::call)
    return stop_service_.carry_out_unanswered(c, what == wire::verb::publish ? asked.body_raw : known.text);
  if (!heard_before_) state_.counts.add(counter::calls_in);
  stop_service_.carry_out_call(c, asked, of_stop);
}

void dispatcher::refuse_malformed(connection& c, std::string_view text, const error& why) noexcept {
  std::array<char, detail::diagnostic_bytes_max> buffer;
  refusals_.refuse(c, c.protocol->reads.guess(text, c.spoke_last), {},
                   {.code = why.name(), .text = explain_fault_in(why, text, buffer)});
}

// `unknown`: the diagnostic if nobody here carries out the request.
inline void dispatcher::carry_out(connection& c, const wire::request& asked, const json::document& text,
                                  const wire::diagnostic& unknown, std::span<std::byte> message) noexcept {
  using wire::verb;
  if (asked.what == verb::message) return take_message(c, asked, text, message);
  // A server may ask nothing else. It is counted, and not answered: two ends might refuse refusals for ever.
  if (c.ours == side::client && is_for_servers(asked.what))
    return state_.counts.add(counter::refused_requests);
  if (asked.what == verb::call && !heard_before_) state_.counts.add(counter::calls_in);
  if (drops_excess()) return;
  if (c.stop_only && !stop_gate::is_for_stop_peers(asked))
    return refusals_.refuse(c, asked.codec, asked.id_raw, {.code = "refused", .text = stop_only_diagnostic});
  if (!access_control_.permits(c, asked)) return;
  if (asked.fragment_size != 0) [[unlikely]]
    fragment_ingress_.ask({c.id.index}, asked.fragment_size);
  switch (asked.what) {
  case verb::publish: return broker_.relay(c, asked);
  case verb::call:
    if (!call_router_.take_call(c, asked)) ingress_.park({c.id.index});
    return;
  case verb::send_goal: state_.counts.add(counter::calls_in); return call_router_.take_goal(c, asked);
  case verb::cancel_goal: return call_router_.cancel_goal(c, asked);
  case verb::goal_feedback: return call_router_.take_feedback(c, asked);
  case verb::goal_result:
  case verb::reply: return call_router_.take_reply(c, asked);
  case verb::fragment: return take_fragments(c, fragment_ingress_.take(c, asked, message));
  case verb::status: return take_status(c, asked);
  case verb::set_level: refusals_.set_level({c.id.index}, asked.level); return;
  case verb::subscribe:
  case verb::unsubscribe:
  case verb::advertise:
  case verb::unadvertise:
  case verb::advertise_service:
  case verb::unadvertise_service:
  case verb::advertise_action:
  case verb::unadvertise_action:
  case verb::get_parameters:
  case verb::set_parameters:
  case verb::subscribe_parameters:
  case verb::unsubscribe_parameters:
  case verb::subscribe_graph:
  case verb::unsubscribe_graph: return registrations_.carry_out(c, asked);
  case verb::message:
  case verb::unsupported:
  case verb::unknown: break;
  }
  refusals_.refuse(c, asked.codec, asked.id_raw, unknown);
}

// ---- fragments

void dispatcher::take_fragments(connection& c, fragment_ingress::due due) noexcept {
  if (due == fragment_ingress::due::rest) return ingress_.go_on({c.id.index});
  if (due == fragment_ingress::due::whole) carry_out_whole(c);
}

// A message all of whose fragments came is read as if it had come as it is. If it is parked, the last of its
// fragments comes again.
void dispatcher::carry_out_whole(connection& c) noexcept {
  const peer_index peer{c.id.index};
  if (const std::span<std::byte> text = fragment_ingress_.text(peer); !text.empty()) {
    read_text(c, text);
  } else {
    const long_arrival arrival = long_ingress_.end(peer, long_ingress::way::messages, false, {});
    read_long(c, arrival, false, {});
    if (arrival.body) state_.chunks.release(arrival.body);
  }
  fragment_ingress_.end(peer, ingress_.parked(peer));
}

void dispatcher::take_status(connection& c, const wire::request& asked) noexcept {
  if (!refusals_.admits_event({c.id.index})) return state_.counts.add(counter::events_lost);
  const auto plain = json::to_string(json::root(asked.body_raw), scratch_);
  state_.events.report(event::kind::status_from_peer, c.peer(), plain.value_or(asked.body_raw), {},
                       c.identity);
}

// A plain message: it goes to the receiver.
inline void dispatcher::take_message(connection& c, const wire::request& asked, const json::document& text,
                                     std::span<std::byte> message) noexcept {
  if (drops_excess()) return;
  if (c.stop_only)
    return refusals_.refuse(c, asked.codec, {}, {.code = "refused", .text = stop_only_diagnostic});
  if (!access_control_.permits(c, asked)) return;
  switch (receiver_.admit({c.id.index})) {
  case admission::now: break;
  case admission::later: return ingress_.park({c.id.index});
  case admission::never: return state_.counts.add(counter::inbox_full);
  }
  // Its status is not needed: a message that is too long is counted there.
  (void)receiver_.deliver(
      {.stamped_ns = rt::nanoseconds_of(c.said_at),
       .expires_ns = rt::nanoseconds_of(state_.options.inbound_expiry(c.said_at, asked.ttl_ns)),
       .what = detail::entry::message,
       .peer = {c.id.index, c.id.generation}},
      without_ttl(text.text, message));
}

bool dispatcher::is_stop(peer_index from, std::span<const std::byte> message, bool binary) noexcept {
  const connection& c = state_.peers[from];
  if (!stop_service_.in_use() ||
      (binary ? !c.protocol->can.binary : !state_.seams.validator.validate(text_of(message))))
    return false;
  const json::document known = binary ? json::document{} : state_.seams.validator.last();
  wire::request asked;
  wire::diagnostic why;
  diagnostic_buffer diagnostic;
  const wire::decode_buffers buffers = decode_buffers(diagnostic, 0);
  wire::decoded read = binary ? c.protocol->reads.decode_binary(message, buffers, asked, why)
                              : c.protocol->reads.decode(known, buffers, asked, why);
  return find_stop(c, read, asked, known, why) == stop_verb::stop;
}

// True, and counted, if the message exceeds its peer's rate and is no stop.
bool dispatcher::drops_excess() noexcept {
  if (excess_) state_.counts.add(counter::over_rate);
  return excess_;
}

} // namespace rowe::service
