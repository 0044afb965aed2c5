// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/urgent_frames.hpp"

#include <array>
#include <bit>
#include <cstring>

namespace rowe::service {

urgent_frames::urgent_frames(rt::arena& memory, const urgent_frames_needs& parts) noexcept
    : urgent_frames_needs{parts}, outputs_{memory.carve<output>(state_.bounds().connections_max)} {}

void urgent_frames::open(peer_index peer) noexcept {
  outputs_[peer] = {};
  if (!state_.peers[peer].protocol->can.control_frames) return; // it answers no pings
  std::array<wire::mask_key, 2> nonce;
  for (wire::mask_key& one : nonce) one = mask_keys_.next();
  outputs_[peer].credit.begin(std::bit_cast<std::uint64_t>(nonce));
}

// ---- pending frames

bool urgent_frames::add_control(peer_index peer, wire::opcode what,
                                std::span<const std::byte> payload) noexcept {
  if (!state_.peers[peer].protocol->can.control_frames) return false;
  const wire::role ours = masks(peer) ? wire::role::client : wire::role::server;
  const std::size_t bytes = wire::frame_header_bytes(payload.size(), ours) + payload.size();
  std::byte* const at = outputs_[peer].control.place(what, bytes);
  if (at == nullptr) return true; // RFC 6455 does not ask for it
  if (ours == wire::role::client) {
    const wire::mask_key key = mask_keys_.next();
    const std::size_t header = wire::write_frame_header(at, what, payload.size(), key);
    wire::mask_copy({at + header, payload.size()}, payload, key);
  } else {
    const std::size_t header = wire::write_frame_header(at, what, payload.size());
    if (!payload.empty()) std::memcpy(at + header, payload.data(), payload.size());
  }
  return true;
}

bool urgent_frames::add_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept {
  std::array<std::byte, wire::control_bytes_max> body;
  const std::size_t bytes = wire::close_payload(code, reason, body);
  return add_control(peer, wire::opcode::close, std::span{body}.first(bytes));
}

bool urgent_frames::add_stop_reply(peer_index peer, std::span<const char> text, wire::opcode what) noexcept {
  wire::mask_key key;
  if (masks(peer)) key = mask_keys_.next();
  return outputs_[peer].stop.add_answer(text, masks(peer) ? &key : nullptr, what);
}

bool urgent_frames::add_stop_state(peer_index peer, std::span<const char> text, wire::opcode what) noexcept {
  wire::mask_key key;
  if (masks(peer)) key = mask_keys_.next();
  return outputs_[peer].stop.add_state(text, masks(peer) ? &key : nullptr, what);
}

// ---- writing

bool urgent_frames::gather(peer_index peer, bool open, const partial_frame& behind, batch& into) noexcept {
  output& to = outputs_[peer];
  // A partial frame goes on before any other.
  const bool stop_first = to.stop.begun();
  if (stop_first) into.add(to.stop.rest(), {.is = batch_piece::origin::stop});
  // A ping that has to wait begins the next batch.
  if (open && to.credit.wants_ping(state_.cycle.now) && !gather_ping(peer, into.bytes)) into.more = true;
  if (!to.control.rest().empty()) into.add(to.control.rest(), {.is = batch_piece::origin::control});
  if (!open) return false;
  if (!stop_first && !to.stop.rest().empty() && !behind.is_continued())
    into.add(to.stop.rest(), {.is = batch_piece::origin::stop});
  return true;
}

// A frame that was begun goes on before any other. Control frames do not say whether one was begun.
void urgent_frames::gather_begun(peer_index peer, batch& into) noexcept {
  const output& of = outputs_[peer];
  if (of.stop.begun()) into.add(of.stop.rest(), {.is = batch_piece::origin::stop});
  if (!of.control.rest().empty()) into.add(of.control.rest(), {.is = batch_piece::origin::control});
}

// Adds a ping to the control frames; `in_front` bytes are written before these. False: it has to wait until
// the control frames that are there are written.
bool urgent_frames::gather_ping(peer_index peer, std::size_t in_front) noexcept {
  output& to = outputs_[peer];
  if (!to.control.rest().empty()) return false;
  const wire::role ours = masks(peer) ? wire::role::client : wire::role::server;
  const std::size_t frame = wire::frame_header_bytes(credit::ping_bytes, ours) + credit::ping_bytes;
  (void)add_control(peer, wire::opcode::ping,
                    to.credit.ping(in_front + frame, state_.cycle.now)); // credit: it may
  return true;
}

bool urgent_frames::may_go_on(peer_index peer, batch& into) noexcept {
  credit& its = outputs_[peer].credit;
  if (into.bytes >= into.credit && its.ping_under_way()) {
    its.held_back();
    into.out_of_credit = true;
    return false;
  }
  if (!into.full() && into.bytes < into.credit) return true;
  into.more = true;
  return false;
}

// ---- liveness

void urgent_frames::take_pong(peer_index peer, std::span<const std::byte> payload) noexcept {
  output& to = outputs_[peer];
  // It answers no ping of ours; it only shows that the peer is alive.
  if (!to.credit.take_pong(payload, state_.cycle.now)) return;
  to.unresponsive = false;
  if (const std::size_t wanted = to.credit.send_buffer(to.send_buffer); wanted != to.send_buffer) {
    to.send_buffer = wanted;
    state_.seams.transport.limit_send_buffer(state_.peers[peer].id, wanted);
  }
  if (outbox_.of(peer).out_of_credit || to.credit.settling()) outbox_.schedule(peer);
}

void urgent_frames::check_responsive(peer_index peer) noexcept {
  output& to = outputs_[peer];
  if (to.credit.wants_ping(state_.cycle.now)) outbox_.schedule(peer);
  if (to.unresponsive || state_.peers[peer].unheard || !to.credit.unresponsive(state_.cycle.now)) return;
  to.unresponsive = true;
  state_.counts.add(counter::slow_peers);
}

} // namespace rowe::service
