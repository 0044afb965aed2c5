// SPDX-License-Identifier: Apache-2.0
#include "service/requests/dispatcher.hpp"

#include "service/incoming/json_fault.hpp"

namespace rowe::service {
namespace {

// Scratch for the longest names a request may have.
std::size_t scratch_bytes(const limits& bounds) noexcept {
  return wire::decode_scratch_bytes({.name_bytes_max = bounds.topic_bytes_max});
}

std::string_view text_of(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

} // namespace

std::size_t dispatcher::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for(scratch_bytes(bounds));
}

dispatcher::dispatcher(rt::arena& memory, const dispatcher_needs& parts) noexcept
    : dispatcher_needs{parts},
      parameters_max_{2 * parameters::count_max(state_.bounds())},
      scratch_{memory.carve<char>(scratch_bytes(state_.bounds()))} {}

// ---- messages

void dispatcher::dispatch(peer_index from, std::span<std::byte> message, bool binary) noexcept {
  connection& c = state_.peers[from];
  request_router_.begin(c);
  read(c, message, binary);
  request_router_.end(c);
}

void dispatcher::dispatch_again(peer_index from, std::span<std::byte> message, bool binary) noexcept {
  connection& c = state_.peers[from];
  const bool in_fragments = fragment_ingress_.comes_again(from);
  if (in_fragments && !fragment_ingress_.was_parked(from)) [[unlikely]] {
    take_fragments(c, fragment_ingress_.go_on(c, message));
  } else {
    if (!c.list) request_router_.begin_again();
    in_fragments ? carry_out_whole(c) : read(c, message, binary);
  }
  request_router_.end(c);
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
  request_router_.begin(c);
  read_long(c, arrival, front);
  request_router_.end(c);
}

// Validates a text of a peer. Its tokens take more time than its bytes. Each byte before a fault takes as
// much as a token, for the fault is looked for byte by byte.
inline status dispatcher::validate(std::string_view text) noexcept {
  const status valid = state_.seams.validator.validate(text);
  const std::size_t before_fault =
      valid || ROWE_MUTANT(fault_work) ? 0 : static_cast<std::size_t>(valid.error().value);
  const std::size_t tokens = state_.seams.validator.tokens() + before_fault;
  if (tokens > tokens_uncharged) state_.cycle.work_bytes += (tokens - tokens_uncharged) * token_work_bytes;
  return valid;
}

// Reads the request of a message, or as many of its list as have their turn.
inline void dispatcher::read_text(connection& c, std::span<std::byte> payload) noexcept {
  const std::string_view text = text_of(payload);
  json::document known{text};
  if (!c.list) [[likely]] { // else it was validated in an earlier turn
    if (const status valid = validate(text); !valid)
      return read_long(c, long_ingress_.malformed(text, valid.error()), payload);
    known = state_.seams.validator.last(); // its members are indexed until the next validation
  }
  for (std::uint32_t left = listed_requests_per_turn;;) {
    // Of a list only the first request is looked at for a stop: that reads all of the text.
    static constexpr json::document none{};
    read_request one{.known = c.list ? none : known, .message = payload};
    diagnostic_buffer diagnostic;
    if (c.list) [[unlikely]]
      request_router_.count_another(c);
    one.read = c.protocol->reads.decode(known, decode_buffers(diagnostic, c.list), one.asked, one.why);
    const auto due = request_router_.take(c, one);
    if (due != fragment_ingress::due::next_fragment) [[unlikely]]
      return take_fragments(c, due);
    if (!one.asked.next || !c.open()) [[likely]] {
      if (c.list) c.list = {};
      return;
    }
    c.list = one.asked.next;
    state_.cycle.work_bytes += read_work_bytes; // as much as a message of its own
    if (--left == 0) return ingress_.go_on({c.id.index});
    known = json::document{text}; // what was indexed may be gone
  }
}

void dispatcher::read_binary(connection& c, std::span<std::byte> message) noexcept {
  json::document body;
  read_request one{.known = body, .message = message};
  diagnostic_buffer diagnostic;
  one.read = c.protocol->reads.decode_binary(message, decode_buffers(diagnostic), one.asked, one.why);
  if (one.read == wire::decoded::unsupported) {
    state_.counts.add(counter::refused_requests);
    return state_.peers.close_later(c, no_binary_diagnostic, wire::close_code::unsupported_data);
  }
  if (const std::string_view text = one.asked.body_raw; one.read == wire::decoded::request && !text.empty()) {
    if (const status valid = validate(text); !valid) {
      one.read = wire::decoded::malformed;
      one.why = {.code = valid.error().name(), .text = explain_fault_in(valid.error(), text, diagnostic)};
    } else if (body = state_.seams.validator.last(); !json::is_object(body.text)) {
      one.read = wire::decoded::malformed;
      one.why = {.code = "not_an_object", .text = "the body must be a JSON object"};
    }
  }
  (void)request_router_.take(c, one); // no fragment
}

bool dispatcher::is_stop(peer_index from, std::span<const std::byte> message, bool binary) noexcept {
  const connection& c = state_.peers[from];
  if (!request_router_.has_stop() ||
      (binary ? !c.protocol->can.binary : !state_.seams.validator.validate_tokens(text_of(message))))
    return false;
  const json::document known = binary ? json::document{} : state_.seams.validator.last();
  read_request one{.known = known};
  diagnostic_buffer diagnostic;
  const wire::decode_buffers buffers = decode_buffers(diagnostic);
  one.read = binary ? c.protocol->reads.decode_binary(message, buffers, one.asked, one.why)
                    : c.protocol->reads.decode(known, buffers, one.asked, one.why);
  return request_router_.is_stop(c, one);
}

// ---- long messages

void dispatcher::read_long(connection& c, const long_arrival& message,
                           std::span<const std::byte> front) noexcept {
  const std::string_view text = text_of(message.envelope);
  json::document known;
  if (!message.binary && state_.seams.validator.validate(text))
    known = state_.seams.validator.last(); // it is
  read_request one{.known = known};
  diagnostic_buffer diagnostic;
  const wire::decode_buffers buffers = decode_buffers(diagnostic);
  one.read = message.binary ? c.protocol->reads.decode_binary(message.envelope, buffers, one.asked, one.why)
                            : c.protocol->reads.decode(known, buffers, one.asked, one.why);
  // Where neither an operation nor an id is known, it is not known what it is.
  if (message.is != long_arrival::verdict::fine && !message.binary && one.asked.what == wire::verb::message)
    one.asked.codec = c.protocol->reads.guess(text_of(front), c.spoke_last);
  request_router_.take_long(c, one, message);
  if (message.body) state_.chunks.release(message.body.text);
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
    read_long(c, long_ingress_.end(peer, long_ingress::way::messages, false, {}), {});
  }
  fragment_ingress_.end(peer, ingress_.parked(peer));
}

} // namespace rowe::service
