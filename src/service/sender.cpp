// SPDX-License-Identifier: Apache-2.0
#include "service/sender.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <optional>
#include <utility>

#include "service/check_sum.hpp"

namespace rowe::service {
namespace {

constexpr unsigned batches_max = 8; // to one peer in one cycle

// Work of one cycle, beyond which the next peer waits for the next cycle: a call of the transport counts as
// one, and so does each 16 KiB. About 200 us on a fast core.
constexpr std::size_t work_per_cycle = 32;
constexpr std::size_t work_of(std::size_t bytes) noexcept { return 1 + bytes / (16 * 1024); }

// The time that a partial frame has for its bytes: the rate is that of a poor radio link.
constexpr std::int64_t partial_bytes_per_second = 64 * 1024;

// Keys are drawn a thousand at a time: one system call for all of them.
constexpr std::size_t mask_bytes = 4096;

// A batch has room for the largest message, with all that may have to go in front of it.
std::size_t buffer_bytes(const limits& bounds) noexcept {
  return std::max(batch_bytes_max, wire_slots::large_bytes(bounds) + wire::frame_header_bytes_max +
                                       sizeof(control_frames) + sizeof(stop_frames));
}

} // namespace

std::size_t sender::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return arena::bytes_for<output>(bounds.connections_max) + arena::bytes_for(buffer_bytes(bounds)) +
         arena::bytes_for<batch_piece>(batch_pieces_max) + arena::bytes_for(mask_bytes);
}

sender::sender(rt::arena& memory, const limits& bounds, const needs& parts) noexcept
    : cycle_{parts.cycle},
      counts_{parts.counts},
      due_{parts.due},
      peers_{parts.peers},
      topics_{parts.topics},
      store_{parts.store},
      out_{parts.out},
      slots_{parts.store.slots()},
      carrier_{parts.carrier},
      random_{parts.random},
      control_frames_{parts.control_frames},
      masks_frames_{parts.masks},
      outputs_{memory.carve<output>(bounds.connections_max)},
      buffer_{memory.carve_bytes(buffer_bytes(bounds))},
      pieces_{memory.carve<batch_piece>(batch_pieces_max)},
      masks_{memory.carve_bytes(mask_bytes)},
      masks_used_{mask_bytes} {}

// ---- who is there

void sender::open(peer_index peer) noexcept {
  outputs_[peer] = {};
  if (!control_frames_) return; // it answers no pings
  std::array<wire::mask_key, 2> nonce;
  for (wire::mask_key& one : nonce) one = next_mask();
  outputs_[peer].credit.begin(std::bit_cast<std::uint64_t>(nonce));
}

void sender::forget(peer_index peer) noexcept {
  if (!has_partial(peer)) return;
  end_partial(peer);
  add(counter::lost_with_peer);
}

void sender::writable(peer_index peer) noexcept {
  out_.of(peer).blocked = false;
  out_.schedule(peer);
}

void sender::ignore_credit(peer_index peer) noexcept {
  if (out_.of(peer).held) out_.schedule(peer);
}

// ---- in turn

// Peers that have still more after their share are put behind those that have not had theirs, and no more
// values are taken from handles before all have had it: in their queues those would push out what was not
// offered yet.
void sender::flush_all() noexcept {
  const bool all = store_.take_lives_no_longer();
  work_ = 0;
  if (turn_left_ == 0) turn_left_ = out_.scheduled();
  for (std::uint32_t left = out_.scheduled(); left != 0; --left) {
    if (!all && work_ >= work_per_cycle) return;
    const peer_index next = out_.take_scheduled();
    if (turn_left_ != 0) --turn_left_;
    if (peers_[next].state != connection::phase::free) flush(next);
  }
}

void sender::flush(peer_index peer) noexcept {
  peer_queues& queues = out_.of(peer);
  // What stays, stays for a reason, and whoever lifts it schedules the peer.
  const bool scheduled = std::exchange(queues.scheduled, true);
  bool more = true;
  for (unsigned round = 0; more && round < batches_max && !queues.blocked; ++round) {
    if (queues.owed != 0) out_.place_owed(peer); // before anything is gathered: it may evict
    batch next{buffer_, pieces_};
    if (gather_urgent(peer, next)) gather_messages(peer, next);
    queues.held = next.held;
    const bool waited = queues.waits_to_begin;
    write(peer, next);
    const bool may_begin_now = waited && !queues.waits_to_begin; // a frame of its own has ended
    const bool owes = queues.owed != 0 && !next.held && !queues.waits_to_begin;
    more = next.more || owes || may_begin_now;
  }
  queues.scheduled = scheduled;
  if (more) out_.schedule(peer);
}

// What does not wait for the rest of the cycle; messages follow then.
void sender::flush_urgent(peer_index peer) noexcept {
  if (!out_.of(peer).blocked) {
    batch next{buffer_, pieces_};
    (void)gather_urgent(peer, next);
    write(peer, next);
  }
  out_.schedule(peer);
}

void sender::write(peer_index peer, batch& what) noexcept {
  const std::span<const std::byte> whole = what.whole();
  const std::size_t taken = what.count != 0 ? carrier_.write(peers_[peer].id, {&whole, 1}) : 0;
  if (what.count != 0) work_ += work_of(taken);
  add(counter::bytes_out, taken);
  outputs_[peer].credit.wrote(taken, cycle_.now);
  out_.of(peer).blocked = taken < what.bytes;
  commit(peer, what, taken);
  if (has_partial(peer)) hand_over_rest(peer);
}

// ---- gathering

// What is written next, in the order in which it is: a partial frame, control frames, the stop. False when no
// message may follow.
bool sender::gather_urgent(peer_index peer, batch& into) noexcept {
  if (!gather_partial(peer, into)) return false;
  output& to = outputs_[peer];
  // A frame that is begun goes on before any other.
  const bool stop_first = to.stop.begun();
  if (stop_first) into.add(to.stop.rest(), {.is = batch_piece::origin::stop});
  if (!gather_ping(peer, into.bytes)) into.more = true; // then the next batch begins with it
  if (!to.control.rest().empty()) into.add(to.control.rest(), {.is = batch_piece::origin::control});
  if (!peers_[peer].open()) return false;
  if (!stop_first && !to.stop.rest().empty()) into.add(to.stop.rest(), {.is = batch_piece::origin::stop});
  return true;
}

// Then messages, by their priority.
void sender::gather_messages(peer_index peer, batch& into) noexcept {
  peer_queues& from = out_.of(peer);
  const connection& c = peers_[peer];
  const auto subscriptions = topics_.subscriptions();
  // A server must know of a topic before anything is published on it.
  const priority replies_at = c.ours == side::client ? priority::urgent : priority::normal;
  for (std::size_t p = 0; p < from.ready.size(); ++p) {
    const bool replies = p == static_cast<std::size_t>(replies_at) && !from.replies.empty();
    if (!replies && from.direct[p].empty() && from.ready[p].empty()) continue;
    into.credit = c.unheard ? SIZE_MAX : outputs_[peer].credit.room(static_cast<priority>(p));
    if (replies && !gather_queue(peer, from.replies, no_index, into)) return;
    if (!from.direct[p].empty() && !gather_queue(peer, from.direct[p], no_index, into)) return;
    for (subscription_id i = from.ready[p].head; i; i = subscriptions[i].next_ready) {
      if (!gather_queue(peer, subscriptions[i].waiting, i.value, into)) return;
    }
  }
}

// The rest of the partial frame. Nothing may come before it. False when nothing may follow either.
bool sender::gather_partial(peer_index peer, batch& into) noexcept {
  const partial_frame& frame = outputs_[peer].partial;
  if (frame.slot == no_index) return true;
  return gather_frame(masks(peer), frame.written, into,
                      {.slot = frame.slot,
                       .key = frame.key,
                       .is = batch_piece::origin::partial,
                       .unslashed = frame.unslashed});
}

// As much of a queue as the batch has room for; of a throttled one, one message. False when the batch is
// full, or the peer's credit is used up. A frame is begun as long as there is any credit, however long it is.
bool sender::gather_queue(peer_index peer, queue& from, std::uint32_t of, batch& into) noexcept {
  out_.drop_expired(from);
  const bool one = of != no_index && topics_.subscription_at(of).throttle > rt::duration{0};
  const bool unslashed = of != no_index && topics_.subscription_at(of).unslashed;
  const bool masked = masks(peer);
  const queue_entries& entries = out_.entries();
  for (entry_id at = from.entries.head; at; at = entries.after(at)) {
    const slot_ref slot = entries.at(at);
    if (!store_.is_due(slot)) continue; // dropped when it comes to the front
    if ((into.full() || into.bytes >= into.credit) && !may_go_on(peer, into)) return false;
    if (!slots_.may_begin(slots_.class_of(slot.index)) && !may_begin(peer, slot.index)) break;
    batch_piece piece{.from = &from,
                      .subscription = of,
                      .slot = slot.index,
                      .is = batch_piece::origin::message,
                      .unslashed = unslashed};
    if (masked) piece.key = next_mask();
    if (!gather_frame(masked, 0, into, piece)) {
      into.more = true;
      return false;
    }
    if (one) break;
  }
  return true;
}

// Whether one more frame may be begun; if not, the batch says what for it waits.
bool sender::may_go_on(peer_index peer, batch& into) noexcept {
  credit& its = outputs_[peer].credit;
  if (into.bytes >= into.credit && its.ping_under_way()) {
    its.held_back();
    into.held = true;
    return false;
  }
  if (!into.full() && into.bytes < into.credit) return true;
  into.more = true;
  return false;
}

// The frame of a slot, or what is left of it behind `skip` bytes. As a server the header stands in front of
// the text already, for all peers alike; as a client the frame is masked on its way into the batch. False
// when that has no room for it.
bool sender::gather_frame(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept {
  const auto payload = std::as_bytes(slots_.text(of.slot));
  if (of.unslashed) [[unlikely]]
    return gather_unslashed(masked, skip, into, of);
  const wire::role ours = masked ? wire::role::client : wire::role::server;
  const std::size_t header = wire::frame_header_bytes(payload.size(), ours);
  const std::size_t bytes = header + payload.size() - skip;
  if (!into.fits(bytes)) return false;
  if (!masked) {
    into.add({payload.data() - header + skip, bytes}, of);
    return true;
  }
  std::byte* at = into.place(bytes, of);
  if (skip < header) {
    std::array<std::byte, wire::frame_header_bytes_max> whole;
    (void)wire::write_frame_header(whole.data(), wire::opcode::text, payload.size(),
                                   of.key); // its size is `header`
    std::memcpy(at, whole.data() + skip, header - skip);
    at += header - skip;
    skip = header;
  }
  const auto rest = payload.subspan(skip - header);
  (void)wire::mask_copy({at, rest.size()}, rest, of.key, skip - header);
  return true;
}

// The same of a topic's message for a peer that calls the topic by its name without the slash: that byte is
// left out on the way into the batch.
bool sender::gather_unslashed(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept {
  constexpr std::size_t slash_at = wire::rosbridge::publish_name_at;
  const auto payload = std::as_bytes(slots_.text(of.slot));
  assert(payload[slash_at] == std::byte{'/'});
  std::array<std::byte, wire::frame_header_bytes_max> header;
  const auto key = masked ? std::optional{of.key} : std::nullopt;
  const std::size_t header_bytes =
      wire::write_frame_header(header.data(), wire::opcode::text, payload.size() - 1, key);
  const std::size_t bytes = header_bytes + payload.size() - 1 - skip;
  if (!into.fits(bytes)) return false;
  std::byte* at = into.place(bytes, of);
  std::size_t masked_so_far = 0;
  const auto add_part = [&](std::span<const std::byte> part, bool is_payload) {
    const std::size_t passed = std::min(skip, part.size());
    skip -= passed;
    const auto rest = part.subspan(passed);
    if (is_payload && masked) {
      (void)wire::mask_copy({at, rest.size()}, rest, of.key, masked_so_far + passed);
    } else if (!rest.empty()) {
      std::memcpy(at, rest.data(), rest.size());
    }
    if (is_payload) masked_so_far += part.size();
    at += rest.size();
  };
  add_part(std::span{header}.first(header_bytes), false);
  add_part(payload.first(slash_at), true);
  add_part(payload.subspan(slash_at + 1), true);
  return true;
}

// ---- what the socket took

// Whole frames are done with, one may be partial, the rest stays queued where it is.
void sender::commit(peer_index peer, batch& sent, std::size_t taken) noexcept {
  output& to = outputs_[peer];
  for (std::size_t i = 0; i < sent.count; ++i) {
    const batch_piece& piece = sent.pieces[i];
    const std::size_t part = std::min<std::size_t>(taken, piece.bytes);
    taken -= part;
    const bool whole = part == piece.bytes;
    switch (piece.is) {
    case batch_piece::origin::stop: to.stop.advance(part); break;
    case batch_piece::origin::control: to.control.written += part; break;
    case batch_piece::origin::partial:
      to.partial.written += part;
      if (!whole) break;
      count_message_out(peer);
      store_.note_sent(to.partial.slot);
      end_partial(peer);
      break;
    case batch_piece::origin::message:
      if (part != 0) commit_message(peer, piece, part);
    }
    if (!whole) break;
  }
  out_.rotate_ready(peer);
}

// The socket has taken the first `part` bytes of a message, or all of it.
void sender::commit_message(peer_index peer, const batch_piece& piece, std::size_t part) noexcept {
  out_.take_front(*piece.from, piece.slot, piece.subscription);
  if (part == piece.bytes) {
    count_message_out(peer);
    store_.note_sent(piece.slot);
    return store_.release(piece.slot);
  }
  slots_.begin(piece.slot);
  outputs_[peer].partial = {.slot = piece.slot,
                            .written = part,
                            .key = piece.key,
                            .unslashed = piece.unslashed,
                            .since = cycle_.now};
}

void sender::count_message_out(peer_index peer) noexcept {
  add(counter::messages_out);
  ++peers_[peer].messages_out;
}

// ---- partial frames

bool sender::any_partial() const noexcept {
  for (const peer_index i : peers_.ids()) {
    if (peers_[i].state != connection::phase::free && has_partial(i)) return true;
  }
  return false;
}

rt::time_point sender::partial_due(const partial_frame& frame) noexcept {
  const auto bytes = static_cast<std::int64_t>(slots_.text(frame.slot).size());
  return frame.since + partial_time_min +
         rt::duration{std::chrono::seconds{bytes}} / partial_bytes_per_second;
}

// Whether a frame of the slot may be begun once the peer's own partial frame is out; if not, it waits.
bool sender::may_begin(peer_index peer, std::uint32_t slot) noexcept {
  const slot_class of = slots_.class_of(slot);
  if (slots_.may_begin(of) || slots_.begun(slot) != 0) return true;
  const std::uint32_t own = outputs_[peer].partial.slot;
  if (own != no_index && slots_.class_of(own) == of && slots_.begun(own) == 1) return true; // in its place
  out_.of(peer).waits_to_begin = waits_to_begin_ = true;
  if (!due_.armed(timer::partial_frames)) due_.arm(timer::partial_frames, cycle_.now + partial_time_min);
  return false;
}

// A large slot is worth system calls: where sockets have one already, or may have no more, the transport
// keeps the rest of the frame itself, if it can.
void sender::hand_over_rest(peer_index peer) noexcept {
  const slot_class of = slots_.class_of(outputs_[peer].partial.slot);
  if (of != slot_class::large || (slots_.count_begun(of) < 2 && slots_.may_begin(of))) return;
  batch rest{buffer_, pieces_};
  (void)gather_partial(peer, rest); // it goes alone
  const std::size_t taken = carrier_.write_rest(peers_[peer].id, rest.whole());
  add(counter::bytes_out, taken);
  outputs_[peer].credit.wrote(taken, cycle_.now);
  commit(peer, rest, taken);
}

// The last byte is out, or its peer gone.
void sender::end_partial(peer_index peer) noexcept {
  const std::uint32_t slot = std::exchange(outputs_[peer].partial, {}).slot;
  slots_.end(slot);
  store_.release(slot);
  if (waits_to_begin_) look_again_from(peer.value + 1);
}

// Who waits to begin a frame looks whether it may now, from one peer on.
void sender::look_again_from(std::uint32_t first) noexcept {
  waits_to_begin_ = false; // until one finds that it may not
  for (std::uint32_t i = 0; i < peers_.size(); ++i) {
    const peer_index peer{(first + i) % peers_.size()};
    if (std::exchange(out_.of(peer).waits_to_begin, false)) out_.schedule(peer);
  }
}

void sender::partial_frames_due() noexcept {
  stalled_due_ = true;
  look_again_from(0);
}

// ---- frames that pass messages

wire::mask_key sender::next_mask() noexcept {
  wire::mask_key key;
  if (masks_used_ + key.size() > masks_.size()) {
    random_.fill(masks_);
    masks_used_ = 0;
  }
  std::memcpy(key.data(), masks_.data() + masks_used_, key.size());
  masks_used_ += key.size();
  return key;
}

void sender::send_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept {
  place_control(peer, what, payload);
  out_.schedule(peer);
}

void sender::place_control(peer_index peer, wire::opcode what, std::span<const std::byte> payload) noexcept {
  if (!control_frames_) return;
  const wire::role ours = masks(peer) ? wire::role::client : wire::role::server;
  const std::size_t bytes = wire::frame_header_bytes(payload.size(), ours) + payload.size();
  std::byte* const at = outputs_[peer].control.place(what, bytes);
  if (at == nullptr) return;
  if (ours == wire::role::client) {
    const wire::mask_key key = next_mask();
    const std::size_t header = wire::write_frame_header(at, what, payload.size(), key);
    wire::mask_copy({at + header, payload.size()}, payload, key);
  } else {
    const std::size_t header = wire::write_frame_header(at, what, payload.size());
    if (!payload.empty()) std::memcpy(at + header, payload.data(), payload.size());
  }
}

void sender::send_close(peer_index peer, std::uint16_t code, std::string_view reason) noexcept {
  if (has_partial(peer) || !control_frames_) return;
  std::array<std::byte, wire::control_bytes_max> body;
  const std::size_t bytes = wire::close_payload(code, reason, body);
  send_control(peer, wire::opcode::close, std::span{body}.first(bytes));
  flush(peer);
}

void sender::add_stop_reply(peer_index peer, std::span<const char> text) noexcept {
  wire::mask_key key;
  if (masks(peer)) key = next_mask();
  if (text.empty() || !outputs_[peer].stop.add_answer(text, masks(peer) ? &key : nullptr))
    return add(counter::stop_answers_lost);
  count_message_out(peer);
  flush_urgent(peer);
}

void sender::add_stop_state(peer_index peer, std::span<const char> text) noexcept {
  if (text.empty()) return;
  wire::mask_key key;
  if (masks(peer)) key = next_mask();
  if (!outputs_[peer].stop.add_state(text, masks(peer) ? &key : nullptr)) return;
  count_message_out(peer);
  out_.schedule(peer);
}

// ---- liveness: one kind of ping for two questions

// Puts a ping among the control frames if it is time for one; `in_front` bytes are written before these.
// False when it has to wait until the control frames that are there are gone.
bool sender::gather_ping(peer_index peer, std::size_t in_front) noexcept {
  output& to = outputs_[peer];
  if (!peers_[peer].open() || !to.credit.wants_ping(cycle_.now)) return true;
  if (!to.control.rest().empty()) return false;
  const wire::role ours = masks(peer) ? wire::role::client : wire::role::server;
  const std::size_t frame = wire::frame_header_bytes(credit::ping_bytes, ours) + credit::ping_bytes;
  place_control(peer, wire::opcode::ping, to.credit.ping(in_front + frame, cycle_.now));
  return true;
}

void sender::take_pong(peer_index peer, std::span<const std::byte> payload) noexcept {
  output& to = outputs_[peer];
  // Of nobody's ping: having been heard is all it is for.
  if (!to.credit.take_pong(payload, cycle_.now)) return;
  to.unresponsive = false;
  if (to.low_rtt != to.credit.near()) {
    to.low_rtt = !to.low_rtt;
    carrier_.set_near(peers_[peer].id, to.low_rtt);
  }
  if (out_.of(peer).held || to.credit.settling()) out_.schedule(peer);
}

void sender::check_responsive(peer_index peer) noexcept {
  output& to = outputs_[peer];
  if (to.credit.wants_ping(cycle_.now)) out_.schedule(peer);
  if (to.unresponsive || peers_[peer].unheard || !to.credit.slow(cycle_.now)) return;
  to.unresponsive = true;
  add(counter::slow_peers);
}

// ---- for tests

// Each slot has as many partial frames as it says. Whoever has something to write is scheduled, or waits for
// something that will schedule it: room in the transport, a pong, or the end of a partial frame.
bool sender::check() const noexcept {
  std::uint64_t partial = 0;
  std::uint64_t counted = 0;
  const auto any_due = [this](const queue& in) {
    for (entry_id at = in.entries.head; at; at = out_.entries().after(at)) {
      if (store_.is_due(out_.entries().at(at))) return true;
    }
    return false;
  };
  for (const peer_index i : peers_.ids()) {
    const output& to = outputs_[i];
    if (peers_[i].state == connection::phase::free) continue;
    if (has_partial(i)) partial += weight(to.partial.slot);
    const peer_queues& queues = out_.of(i);
    if (!peers_[i].open() || queues.scheduled || queues.blocked) continue;
    if (has_partial(i) || !to.control.rest().empty() || !to.stop.rest().empty()) return false;
    const bool others_end = waits_to_begin_ && due_.armed(timer::partial_frames);
    if ((queues.held && to.credit.ping_under_way()) || (queues.waits_to_begin && others_end)) continue;
    if (any_due(queues.replies) || std::any_of(queues.direct.begin(), queues.direct.end(), any_due))
      return false;
    for (const ready_list& on : queues.ready) {
      for (subscription_id s = on.head; s; s = topics_.subscriptions()[s].next_ready) {
        const subscription& one = topics_.subscriptions()[s];
        if (one.owes_last || any_due(one.waiting)) return false;
      }
    }
  }
  for (std::uint32_t slot = 0; slot < slots_.count(); ++slot) counted += weight(slot) * slots_.begun(slot);
  return partial == counted && turn_left_ <= out_.scheduled();
}

} // namespace rowe::service
