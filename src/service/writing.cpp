// SPDX-License-Identifier: Apache-2.0
// What is written to peers: each connection on the list gets what its queues have ready, many frames in one
// call of the transport, urgent first and the subscriptions of one priority in turn.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <optional>
#include <utility>

#include "service/core.hpp"
#include "service/shares.hpp"

namespace rowe::service {
namespace {

constexpr unsigned batches_max = 8; // to one connection in one cycle

// Work of one cycle, beyond which the next connection waits for the next cycle: a call of the carrier counts
// as one, and so does each 16 KiB. About 200 us on a fast core.
constexpr std::size_t write_work_per_cycle = 32;
constexpr std::size_t write_work_of(std::size_t bytes) noexcept { return 1 + bytes / (16 * 1024); }

// How long a frame may be under way while others wait for its slot: some time, and some for its bytes. The
// rate is that of a poor radio link.
constexpr rt::duration begun_patience = std::chrono::milliseconds{500};
constexpr std::int64_t begun_bytes_per_second = 64 * 1024;

} // namespace

void core::list(connection& c) noexcept {
  if (c.listed || c.blocked) return;
  c.listed = true;
  listed_.push(c.id.index);
}

// A message to a thousand peers is a thousand calls of the carrier: a stop must not wait for all of them.
// Connections that have still more after their share are put behind those that have not had theirs, and no
// more values are taken from lanes before all have had it: in their queues those would push out what was not
// offered yet. What has no time to live is for this cycle only, so that goes to all in it.
void core::offer_all() noexcept {
  const bool all = std::exchange(offers_to_all_, false);
  written_in_turn_ = 0;
  if (turn_left_ == 0) turn_left_ = listed_.count;
  for (std::uint32_t left = listed_.count; left != 0; --left) {
    if (!all && written_in_turn_ >= write_work_per_cycle) return;
    connection& c = peers_[peer_index{listed_.pop()}];
    if (turn_left_ != 0) --turn_left_;
    c.listed = false;
    if (c.state != connection::phase::free) offer(c);
  }
}

void core::offer(connection& c) noexcept {
  // What stays, stays for a reason, and whoever lifts it puts the connection on the list.
  const bool listed = std::exchange(c.listed, true);
  bool more = true;
  for (unsigned round = 0; more && round < batches_max && !c.blocked; ++round) {
    if (c.owed != 0) place_owed(c); // before anything is gathered: it may take messages out of queues
    batch next{joined_, pieces_};
    if (gather_urgent(c, next)) gather_messages(c, next);
    c.held = next.held;
    const bool waited = c.waits_to_begin;
    write(c, next);
    const bool may_begin_now = waited && !c.waits_to_begin; // a frame of its own has ended
    const bool owes = c.owed != 0 && !next.held && !c.waits_to_begin;
    more = next.more || owes || may_begin_now;
  }
  c.listed = listed;
  if (more) list(c);
}

// The latched value of one of the subscriptions that may be written now and wait for theirs.
void core::place_owed(connection& c) noexcept {
  for (const ready_list& on : c.ready) {
    for (std::uint32_t i = on.head; i != no_index; i = router_.subscription_at(i).next_ready) {
      if (router_.subscription_at(i).owes_last) return place_latched(router_.subscription_at(i));
    }
  }
}

void core::offer_urgent(connection& c) noexcept {
  if (!c.blocked) {
    batch next{joined_, pieces_};
    (void)gather_urgent(c, next);
    write(c, next);
  }
  list(c);
}

void core::write(connection& c, batch& what) noexcept {
  const std::span<const std::byte> whole = what.whole();
  const std::size_t taken = what.count != 0 ? carrier_.write(c.id, {&whole, 1}) : 0;
  if (what.count != 0) written_in_turn_ += write_work_of(taken);
  add(counter::bytes_out, taken);
  c.credit.wrote(taken, now_);
  c.blocked = taken < what.bytes;
  settle(c, what, taken);
  if (c.begun.slot != no_index) hand_over_rest(c);
}

// What is written next, in the order in which it is: what was begun, control frames, the stop. False when no
// message may follow.
bool core::gather_urgent(connection& c, batch& into) noexcept {
  if (!gather_begun(c, into)) return false;
  // A frame that is begun goes on before any other.
  const bool stop_first = c.stop_out.begun();
  if (stop_first) into.add(c.stop_out.rest(), {.is = batch_piece::origin::stop});
  if (!ping_if_wanted(c, into.bytes)) into.more = true; // then the next batch begins with it
  if (!c.control.rest().empty()) into.add(c.control.rest(), {.is = batch_piece::origin::control});
  if (!c.open()) return false;
  if (!stop_first && !c.stop_out.rest().empty())
    into.add(c.stop_out.rest(), {.is = batch_piece::origin::stop});
  return true;
}

// Then messages, by their priority.
void core::gather_messages(connection& c, batch& into) noexcept {
  // A server must know of a topic before anything is published on it.
  const priority direct = c.ours == side::client ? priority::urgent : priority::normal;
  for (std::size_t p = 0; p < c.ready.size(); ++p) {
    const bool answers = p == static_cast<std::size_t>(direct) && !c.direct.empty();
    if (!answers && c.letters[p].empty() && c.ready[p].head == no_index) continue;
    into.credit = c.unheard ? SIZE_MAX : c.credit.room(static_cast<priority>(p));
    if (answers && !gather_queue(c, c.direct, no_index, into)) return;
    if (!c.letters[p].empty() && !gather_queue(c, c.letters[p], no_index, into)) return;
    for (std::uint32_t i = c.ready[p].head; i != no_index; i = router_.subscription_at(i).next_ready) {
      if (!gather_queue(c, router_.subscription_at(i).waiting, i, into)) return;
    }
  }
}

// The rest of the frame that a socket has the beginning of. Nothing may come before it. False when nothing
// may follow either.
bool core::gather_begun(connection& c, batch& into) noexcept {
  if (c.begun.slot == no_index) return true;
  return gather_frame(masks(c), c.begun.written, into,
                      {.slot = c.begun.slot,
                       .key = c.begun.key,
                       .is = batch_piece::origin::begun,
                       .unslashed = c.begun.unslashed});
}

// As much of a queue as the batch has room for; of a throttled one, one message. False when the batch is
// full, or the peer's credit is used up. A frame is begun as long as there is any credit, however long it is.
bool core::gather_queue(connection& c, queue& from, std::uint32_t of, batch& into) noexcept {
  drop_dead(from);
  const bool one = of != no_index && router_.subscription_at(of).throttle > rt::duration{0};
  const bool unslashed = of != no_index && router_.subscription_at(of).unslashed;
  const bool masked = masks(c);
  for (entry_id at = from.entries.head; at; at = entries_.after(at)) {
    const slot_ref slot = entries_.at(at);
    if (!is_due(slot)) continue; // dropped when it comes to the front
    if ((into.full() || into.bytes >= into.credit) && !may_begin(c, into)) return false;
    if (!slots_.may_begin(slots_.class_of(slot.index)) && !may_begin_in(c, slot.index)) break;
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
bool core::may_begin(connection& c, batch& into) noexcept {
  if (into.bytes >= into.credit && c.credit.ping_under_way()) {
    c.credit.held_back();
    into.held = true;
    return false;
  }
  if (!into.full() && into.bytes < into.credit) return true;
  into.more = true;
  return false;
}

// Clients mask their frames; Hop of 2014 cannot read masked ones.
bool core::masks(const connection& c) const noexcept {
  return c.ours == side::client && options_.profile != peer_profile::hop_2014;
}

// The frame of a slot, or what is left of it behind `skip` bytes. As a server the header stands in front of
// the text already, for all peers alike; as a client the frame is masked on its way into the batch. False
// when that has no room for it.
bool core::gather_frame(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept {
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
bool core::gather_unslashed(bool masked, std::size_t skip, batch& into, const batch_piece& of) noexcept {
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
  const auto add = [&](std::span<const std::byte> part, bool is_payload) {
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
  add(std::span{header}.first(header_bytes), false);
  add(payload.first(slash_at), true);
  add(payload.subspan(slash_at + 1), true);
  return true;
}

// Books what the socket took: whole frames are done with, one may be begun, the rest stays queued where it
// is.
void core::settle(connection& c, batch& sent, std::size_t taken) noexcept {
  for (std::size_t i = 0; i < sent.count; ++i) {
    const batch_piece& piece = sent.pieces[i];
    const std::size_t part = std::min<std::size_t>(taken, piece.bytes);
    taken -= part;
    const bool whole = part == piece.bytes;
    switch (piece.is) {
    case batch_piece::origin::stop: c.stop_out.advance(part); break;
    case batch_piece::origin::control: c.control.written += part; break;
    case batch_piece::origin::begun:
      c.begun.written += part;
      if (!whole) break;
      note_sent(c, c.begun.slot);
      end_begun(c);
      break;
    case batch_piece::origin::message:
      if (part != 0) settle_message(c, piece, part);
    }
    if (!whole) break;
  }
  settle_ready(c);
}

// The socket has taken the first `part` bytes of a message, or all of it.
void core::settle_message(connection& c, const batch_piece& piece, std::size_t part) noexcept {
  drop_dead(*piece.from); // what stands in front of it was passed over when it was gathered
  assert(entries_.front(*piece.from).index == piece.slot);
  (void)entries_.pop(*piece.from); // its reference is released below, or goes on as the begun frame's
  if (piece.subscription != no_index) settle_sent(router_.subscription_at(piece.subscription));
  if (part == piece.bytes) {
    note_sent(c, piece.slot);
    return release(piece.slot);
  }
  slots_.begin(piece.slot);
  c.begun = {
      .slot = piece.slot, .written = part, .key = piece.key, .unslashed = piece.unslashed, .since = now_};
}

void core::note_sent(connection& c, std::uint32_t slot) noexcept {
  add(counter::messages_out);
  ++c.messages_out;
  if (!is_letter(slot)) return;
  letter& l = letters_.at(slot);
  l.sent = true;
  tell(std::exchange(l.sender, {}), l.own, {}); // one peer is enough: the others may not read for long
}

// ---- what sockets have in hand
//
// A frame that is begun keeps its slot until its last byte is out, and a peer that does not read never takes
// that. So of each size class only some may be begun at once; who has to wait for others begins when one of
// them is done, or is cut for taking too long while somebody waits.

rt::time_point core::begun_due(const connection& c) noexcept {
  const auto bytes = static_cast<std::int64_t>(slots_.text(c.begun.slot).size());
  return c.begun.since + begun_patience + rt::duration{std::chrono::seconds{bytes}} / begun_bytes_per_second;
}

// Whether a frame of the slot may be begun once the connection's own that is begun is out; if not, it waits.
bool core::may_begin_in(connection& c, std::uint32_t slot) noexcept {
  const slot_class of = slots_.class_of(slot);
  if (slots_.may_begin(of) || slots_.begun(slot) != 0) return true;
  const bool in_its_place =
      c.begun.slot != no_index && slots_.class_of(c.begun.slot) == of && slots_.begun(c.begun.slot) == 1;
  if (in_its_place) return true;
  c.waits_to_begin = begins_wait_ = true;
  if (!timers_.armed(timer::partial_frames)) timers_.arm(timer::partial_frames, now_ + begun_patience);
  return false;
}

// A large slot is worth system calls: where sockets have one already, or may have no more, the carrier keeps
// the rest of the frame itself, if it can.
void core::hand_over_rest(connection& c) noexcept {
  const slot_class of = slots_.class_of(c.begun.slot);
  if (of != slot_class::large || (slots_.count_begun(of) < 2 && slots_.may_begin(of))) return;
  batch rest{joined_, pieces_};
  (void)gather_begun(c, rest); // it goes alone
  const std::size_t taken = carrier_.write_rest(c.id, rest.whole());
  add(counter::bytes_out, taken);
  c.credit.wrote(taken, now_);
  settle(c, rest, taken);
}

// The last byte is out, or its peer gone.
void core::end_begun(connection& c) noexcept {
  const std::uint32_t slot = std::exchange(c.begun, {}).slot;
  slots_.end(slot);
  release(slot);
  if (begins_wait_) look_again_from(c.id.index + 1);
}

// Who waits to begin a frame looks whether it may now, from one connection on.
void core::look_again_from(std::uint32_t first) noexcept {
  begins_wait_ = false; // until one finds that it may not
  for (std::uint32_t i = 0; i < peers_.size(); ++i) {
    connection& c = peers_[peer_index{(first + i) % peers_.size()}];
    if (std::exchange(c.waits_to_begin, false)) list(c);
  }
}

// Now and then while somebody waits to begin: behind offer_all(), which has asked all of them once more.
void core::cut_those_in_the_way() noexcept {
  begun_due_ = false;
  if (!begins_wait_) return;
  rt::time_point next = now_ + begun_patience;
  for (connection& c : peers_) {
    if (!c.open() || c.begun.slot == no_index || slots_.may_begin(slots_.class_of(c.begun.slot))) continue;
    if (const rt::time_point due = begun_due(c); due > now_) {
      next = std::min(next, due);
    } else {
      add(counter::stalled_peers);
      cut(c, "it reads a message too slowly, and others wait for its slot");
    }
  }
  timers_.arm(timer::partial_frames, next);
}

// A throttled subscription's next message is due a period after this one was, or after now if that is long
// past.
void core::settle_sent(subscription& of) noexcept {
  of.served = true;
  if (of.throttle == rt::duration{0}) return;
  const bool in_step = now_ - of.next_due < of.throttle;
  of.sent_at = in_step ? of.next_due : now_;
  of.next_due = rt::deadline_after(of.sent_at, of.throttle);
}

// Takes subscriptions off the ready lists that have nothing to write now, and puts those that were served
// behind those that were not, so that they take turns.
void core::settle_ready(connection& c) noexcept {
  for (ready_list& on : c.ready) {
    std::uint32_t i = std::exchange(on, {}).head;
    std::uint32_t served = no_index;
    std::uint32_t* last_served = &served;
    while (i != no_index) {
      subscription& s = router_.subscription_at(i);
      const std::uint32_t next = std::exchange(s.next_ready, no_index);
      drop_dead(s.waiting); // else one with nothing to write would stay on the list, and list() nobody
      if (s.served) {
        *last_served = i;
        last_served = &s.next_ready;
      } else {
        s.ready = false;
        make_ready(i);
      }
      i = next;
    }
    while (served != no_index) {
      subscription& s = router_.subscription_at(served);
      s.ready = s.served = false;
      const std::uint32_t next = std::exchange(s.next_ready, no_index);
      make_ready(served);
      served = next;
    }
  }
}

} // namespace rowe::service
