// SPDX-License-Identifier: Apache-2.0
// What is written to peers. A message is encoded once into a slot; each subscription queues the slot's
// number; each connection writes what its subscriptions have ready, several frames in one call of the
// transport, urgent first and the subscriptions of one priority in turn. Whether a message may still be sent
// is decided here, by the clock, when it is handed over; the wheel only gives the slots of those back that
// nobody came to send.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <utility>

#include "service/core.hpp"
#include "service/publishing.hpp"

namespace rowe::service {
namespace {

constexpr std::size_t pieces_max = 64;             // of one batch
constexpr std::size_t batch_bytes_max = 64 * 1024; // a batch ends with the frame that reaches it
constexpr unsigned batches_max = 8;                // to one connection in one cycle

// Work of one cycle, beyond which the next connection waits for the next cycle: a call of the carrier counts
// as one, and so does each 16 KiB. About 200 us on a fast core.
constexpr std::size_t write_work_per_cycle = 32;
constexpr std::size_t write_work_of(std::size_t bytes) noexcept { return 1 + bytes / (16 * 1024); }

} // namespace

// What one call of the transport is given, and where each piece came from.
struct core::batch {
  struct source {
    // Where it is taken off: a queue, the stop's frames (of_stop), or neither: control frames, or the rest of
    // the frame that was begun.
    queue* from = nullptr;
    bool of_stop = false;
    std::uint32_t subscription = no_index;
    std::uint32_t slot = no_index;
    std::size_t bytes = 0;
    wire::mask_key key{};
  };

  std::array<std::span<const std::byte>, pieces_max> pieces;
  std::array<source, pieces_max> sources;
  std::size_t count = 0;
  std::size_t bytes = 0;
  std::size_t masked = 0; // bytes of the core's masking room in use
  std::size_t room = 0;   // what the peer's credit allows at the priority that is being gathered
  bool more = false;      // something was left out that another batch may take at once
  bool held = false;      // something was left out until the peer has read more

  bool full() const noexcept { return count == pieces_max || bytes >= batch_bytes_max; }
  void add(std::span<const std::byte> piece, const source& of) noexcept {
    pieces[count] = piece;
    sources[count] = of;
    sources[count].bytes = piece.size();
    ++count;
    bytes += piece.size();
  }
};

// ---- towards the queues

void core::deliver(std::uint32_t topic_index, std::uint32_t slot) noexcept {
  topic& on = router_.at(topic_index);
  if (on.latched) {
    forget_last(on);
    slots_.keep(slot);
    on.last = slots_.ref(slot);
  }
  for (std::uint32_t i = on.first_subscription; i != no_index; i = router_.subscription_at(i).next_on_topic) {
    if (accepts(router_.subscription_at(i))) push(i, slot);
  }
}

// rosbridge's throttle: what comes within the period of the last one written is discarded, unless the peer
// asked for a queue.
bool core::accepts(subscription& s) noexcept {
  if (!s.discards || now_ >= s.next_due) return true;
  add(counter::throttled);
  return false;
}

void core::push(std::uint32_t index, std::uint32_t slot) noexcept {
  subscription& s = router_.subscription_at(index);
  while (drop_dead_front(s.waiting)) continue;
  while (s.waiting.count >= s.depth) {
    // Why it goes: the peer wants the newest only, or less often, or does not read fast enough.
    const bool chosen = s.throttle > rt::duration{0} && !connections_[s.connection].behind();
    add(s.merges || s.discards ? counter::replaced : chosen ? counter::throttled : counter::outbox_full);
    drop_front(s.waiting);
  }
  if (!entries_.push(s.waiting, slots_.ref(slot))) return add(counter::outbox_full);
  slots_.retain(slot);
  make_ready(index);
}

void core::make_ready(std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  if (s.ready || s.waiting.empty()) return;
  if (now_ < s.next_due) {
    if (!std::exchange(s.timed, true)) arm(timer::subscription, index, s.next_due);
    return;
  }
  if (std::exchange(s.timed, false)) disarm(timer::subscription, index);
  connection& c = connections_[s.connection];
  s.ready_as = router_.at(s.topic).priority;
  ready_list& on = c.ready[static_cast<std::size_t>(s.ready_as)];
  s.ready = true;
  s.next_ready = no_index;
  (on.head == no_index ? on.head : router_.subscription_at(on.tail).next_ready) = index;
  on.tail = index;
  list(c);
}

void core::send_direct(connection& c, std::string_view text) noexcept {
  if (text.empty()) return add(counter::outbox_full);
  (void)answer(c, [&](json::writer& into) { into.append(text); }); // what is lost is counted there
}

void core::send_control(connection& c, wire::opcode what, std::span<const std::byte> payload) noexcept {
  place_control(c, what, payload);
  list(c);
}

void core::place_control(connection& c, wire::opcode what, std::span<const std::byte> payload) noexcept {
  if (options_.profile != peer_profile::standard) return; // Hop's programs know text frames only
  const wire::role ours = masks(c) ? wire::role::client : wire::role::server;
  const std::size_t bytes = wire::frame_header_bytes(payload.size(), ours) + payload.size();
  std::byte* const at = c.control.place(what, bytes);
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

wire::mask_key core::next_mask() noexcept {
  wire::mask_key key;
  if (masks_used_ + key.size() > masks_.size()) {
    random_.fill(masks_);
    masks_used_ = 0;
  }
  std::memcpy(key.data(), masks_.data() + masks_used_, key.size());
  masks_used_ += key.size();
  return key;
}

// A slot's text is complete: the frame header goes in front of it, and the wheel learns when it ends.
void core::seal(std::uint32_t slot, std::size_t bytes, rt::time_point expires) noexcept {
  slots_.finish(slot, bytes, expires);
  (void)wire::write_frame_header_before(reinterpret_cast<std::byte*>(slots_.text(slot).data()),
                                        wire::opcode::text,
                                        bytes); // where it starts follows from `bytes`
  if (expires != rt::never) arm(timer::slot, slot, expires + rt::duration{1});
  if (expires == now_) offers_to_all_ = true;
}

// ---- giving back

// What only its own letter holds any more has no deliveries left: it is settled.
void core::release(std::uint32_t slot) noexcept {
  if (slots_.release(slot)) return disarm(timer::slot, slot);
  if (letters_.under_way(slot) && slots_.references(slot) == 1) settle_letter(slot);
}

// The clock decides; the wheel only noticed.
void core::expire_slot(std::uint32_t slot) noexcept {
  if (slots_.expires(slot) >= now_) return arm(timer::slot, slot, slots_.expires(slot) + rt::duration{1});
  const auto deliveries = slots_.expire(slot);
  // In the middle of being written: it goes when the socket has it all, or with its connection.
  if (!deliveries) return arm(timer::slot, slot, now_ + std::chrono::milliseconds{10});
  disarm(timer::slot, slot);
  const bool waited = letters_.under_way(slot) && *deliveries == 0;
  add(counter::expired, *deliveries + (waited ? 1 : 0));
  if (letters_.under_way(slot)) expire_letter(slot);
}

// Drops the message at the front if it is gone or its time is. False when the queue begins with one to be
// sent.
bool core::drop_dead_front(queue& from) noexcept {
  if (from.empty()) return false;
  const slot_ref front = entries_.front(from);
  if (slots_.alive(front)) {
    if (slots_.expires(front.index) >= now_) return false;
    expire_slot(front.index); // for all queues at once, and counted
    if (slots_.alive(front)) {
      // Another peer's socket is in the middle of it, so it goes for this peer alone.
      add(counter::expired);
      release(front.index);
    }
  }
  (void)entries_.pop(from); // the reference is given back already
  return true;
}

void core::drop_front(queue& from) noexcept { release(entries_.pop(from).index); }

void core::drop_all(queue& from, counter as) noexcept {
  while (!from.empty()) {
    if (drop_dead_front(from)) continue;
    add(as);
    drop_front(from);
  }
}

// Frees a slot for so many bytes at the cost of peers that do not read: a message that is the oldest in the
// queue of one of them is dropped there and wherever else it is the oldest. So a few that do not read cannot
// take all slots away from those that do. Looks at each subscription once at most, and first where it found
// one last: that peer has more as a rule.
bool core::reclaim(std::size_t bytes) noexcept {
  const auto from_one = [&](auto&& takes_from) {
    for (std::size_t i = 0; i < connections_.size(); ++i) {
      connection& c = connections_[(reclaimed_at_ + i) % connections_.size()];
      if (!c.open() || !takes_from(c)) continue;
      reclaimed_at_ = c.id.index;
      return true;
    }
    return false;
  };
  return from_one([&](connection& c) { return c.behind() && reclaim_message(c, bytes); }) ||
         from_one([&](connection& c) { return reclaim_answer(c, bytes); });
}

bool core::reclaim_message(connection& c, std::size_t bytes) noexcept {
  for (std::uint32_t i = c.first_subscription; i != no_index;
       i = router_.subscription_at(i).next_on_connection) {
    queue& waiting = router_.subscription_at(i).waiting;
    while (drop_dead_front(waiting)) continue;
    if (waiting.empty() || slots_.room(entries_.front(waiting).index).size() < bytes) continue;
    const slot_ref oldest = entries_.front(waiting);
    const std::uint32_t topic = router_.subscription_at(i).topic;
    for (std::uint32_t k = router_.at(topic).first_subscription; k != no_index;
         k = router_.subscription_at(k).next_on_topic) {
      subscription& same = router_.subscription_at(k);
      if (!connections_[same.connection].behind() || same.waiting.empty() ||
          entries_.front(same.waiting) != oldest || !slots_.alive(oldest)) {
        continue;
      }
      add(counter::outbox_full);
      drop_front(same.waiting);
    }
    if (slots_.has_free(bytes)) return true;
  }
  return false;
}

// The oldest one; not one whose sender waits to hear of it.
bool core::reclaim_answer(connection& c, std::size_t bytes) noexcept {
  while (drop_dead_front(c.direct)) continue;
  if (c.direct.count <= (c.behind() ? 0 : direct_depth_behind)) return false;
  const std::uint32_t oldest = entries_.front(c.direct).index;
  if (letters_.under_way(oldest) || slots_.room(oldest).size() < bytes) return false;
  add(counter::outbox_full);
  drop_front(c.direct);
  return slots_.has_free(bytes);
}

void core::remove_subscription(connection& c, std::uint32_t index) noexcept {
  subscription& s = router_.subscription_at(index);
  const std::uint32_t topic = s.topic;
  drop_all(s.waiting, counter::lost_with_peer);
  if (s.timed) {
    disarm(timer::subscription, index);
    s.timed = false;
  }
  if (s.ready) {
    ready_list& on = c.ready[static_cast<std::size_t>(s.ready_as)];
    std::uint32_t before = no_index;
    for (std::uint32_t i = on.head; i != index; i = router_.subscription_at(i).next_ready) before = i;
    (before == no_index ? on.head : router_.subscription_at(before).next_ready) = s.next_ready;
    if (on.tail == index) on.tail = before;
    s.ready = false;
  }
  router_.remove_subscription(index, c.first_subscription);
  --c.subscriptions;
  update_wanted(topic);
  let_go_topic(topic);
}

// Gives back what a latched topic keeps for late subscribers.
void core::forget_last(topic& on) noexcept {
  if (on.last.index == no_index || !slots_.alive(on.last)) return;
  slots_.unkeep(on.last.index);
  release(on.last.index);
}

void core::let_go_topic(std::uint32_t index) noexcept {
  topic& held = router_.at(index);
  if (held.holders == 1) forget_last(held);
  (void)router_.let_go(index); // whether it was the last one matters to nobody here
}

// ---- towards the socket

void core::list(connection& c) noexcept {
  if (c.listed || c.blocked) return;
  c.listed = true;
  listed_.push(c.id.index);
}

// A message to a thousand peers is a thousand calls of the carrier: a stop must not wait for all of them.
// Connections that have still more after their share are put behind those that have not had theirs. What has
// no time to live is for this cycle only, so that goes to all in it.
void core::offer_all() noexcept {
  const bool all = std::exchange(offers_to_all_, false);
  written_in_turn_ = 0;
  for (std::uint32_t left = listed_.count; left != 0; --left) {
    if (!all && written_in_turn_ >= write_work_per_cycle) return;
    connection& c = connections_[listed_.pop()];
    c.listed = false;
    if (c.state != connection::phase::free) offer(c);
  }
}

void core::offer(connection& c) noexcept {
  // What stays, stays for a reason, and whoever lifts it puts the connection on the list.
  const bool listed = std::exchange(c.listed, true);
  bool more = true;
  for (unsigned round = 0; more && round < batches_max && !c.blocked; ++round) {
    batch next;
    if (gather_urgent(c, next)) gather_messages(c, next);
    c.held = next.held;
    more = next.more;
    write(c, next);
  }
  c.listed = listed;
  if (more) list(c);
}

void core::offer_urgent(connection& c) noexcept {
  if (!c.blocked) {
    batch next;
    (void)gather_urgent(c, next);
    write(c, next);
  }
  list(c);
}

void core::write(connection& c, batch& what) noexcept {
  const std::size_t taken =
      what.count != 0 ? carrier_.write(c.id, std::span{what.pieces}.first(what.count)) : 0;
  if (what.count != 0) written_in_turn_ += write_work_of(taken);
  add(counter::bytes_out, taken);
  c.credit.wrote(taken, now_);
  c.blocked = taken < what.bytes;
  settle(c, what, taken);
}

// What is written next, in the order in which it is: what was begun, control frames, the stop. False when no
// message may follow.
bool core::gather_urgent(connection& c, batch& into) noexcept {
  if (!gather_begun(c, into)) return false;
  // A frame that is begun goes on before any other.
  const bool stop_first = c.stop_out.begun();
  if (stop_first) into.add(c.stop_out.rest(), {.of_stop = true});
  if (!ping_if_wanted(c, into.bytes)) into.more = true; // then the next batch begins with it
  if (!c.control.rest().empty()) into.add(c.control.rest(), {});
  if (!c.open()) return false;
  if (!stop_first && !c.stop_out.rest().empty()) into.add(c.stop_out.rest(), {.of_stop = true});
  return true;
}

// Then messages, by their priority.
void core::gather_messages(connection& c, batch& into) noexcept {
  // A server must know of a topic before anything is published on it.
  const priority direct = c.ours == side::client ? priority::urgent : priority::normal;
  for (std::size_t p = 0; p < c.ready.size(); ++p) {
    into.room = c.credit.room(static_cast<priority>(p));
    if (p == static_cast<std::size_t>(direct) && !gather_queue(c, c.direct, no_index, into)) return;
    if (!gather_queue(c, c.letters[p], no_index, into)) return;
    for (std::uint32_t i = c.ready[p].head; i != no_index; i = router_.subscription_at(i).next_ready) {
      if (!gather_queue(c, router_.subscription_at(i).waiting, i, into)) return;
    }
  }
}

// The rest of the frame that a socket has the beginning of. Nothing may come before it. False when nothing
// may follow either.
bool core::gather_begun(connection& c, batch& into) noexcept {
  if (c.begun.slot == no_index) return true;
  return gather_frame(c, c.begun.slot, c.begun.key, c.begun.written, into);
}

// As much of a queue as the batch has room for; of a throttled one, one message. False when the batch is
// full, or the peer's credit is used up. A frame is begun as long as there is any credit, however long it is.
bool core::gather_queue(connection& c, queue& from, std::uint32_t of, batch& into) noexcept {
  while (drop_dead_front(from)) continue;
  const bool one = of != no_index && router_.subscription_at(of).throttle > rt::duration{0};
  for (std::uint32_t at = from.head; at != no_index; at = entries_.after(at)) {
    const slot_ref slot = entries_.at(at);
    if (!slots_.alive(slot) || slots_.expires(slot.index) < now_)
      continue; // dropped when it comes to the front
    if (into.bytes >= into.room && c.credit.ping_under_way()) {
      c.credit.held_back();
      into.held = true;
      return false;
    }
    if (into.full() || into.bytes >= into.room ||
        !gather_frame(c, slot.index, masks(c) ? next_mask() : wire::mask_key{}, 0, into)) {
      into.more = true;
      return false;
    }
    into.sources[into.count - 1].from = &from;
    into.sources[into.count - 1].subscription = of;
    if (one) break;
  }
  return true;
}

// Clients mask their frames; Hop of 2014 cannot read masked ones.
bool core::masks(const connection& c) const noexcept {
  return c.ours == side::client && options_.profile != peer_profile::hop_2014;
}

// One frame, or what is left of it behind `skip` bytes. As a server the header stands in front of the text
// already, for all peers alike; as a client the frame is masked into a room of the core's. False when that is
// full.
bool core::gather_frame(connection& c, std::uint32_t slot, const wire::mask_key& key, std::size_t skip,
                        batch& into) noexcept {
  const std::span<char> text = slots_.text(slot);
  const auto payload = std::as_writable_bytes(text);
  if (!masks(c)) {
    const std::size_t header = wire::frame_header_bytes(payload.size(), wire::role::server);
    const std::span<const std::byte> frame{payload.data() - header, payload.size() + header};
    into.add(frame.subspan(skip), {.slot = slot});
    return true;
  }
  const std::size_t header = wire::frame_header_bytes(payload.size(), wire::role::client);
  if (masked_.size() - into.masked < header + payload.size()) return false;
  const auto frame = masked_.subspan(into.masked, header + payload.size());
  (void)wire::write_frame_header(frame.data(), wire::opcode::text, payload.size(),
                                 key); // its size is `header`
  wire::mask_copy(frame.subspan(header), payload, key);
  into.masked += frame.size();
  into.add(frame.subspan(skip), {.slot = slot, .key = key});
  return true;
}

// Books what the socket took: whole frames are done with, one may be begun, the rest stays queued where it
// is.
void core::settle(connection& c, batch& sent, std::size_t taken) noexcept {
  for (std::size_t i = 0; i < sent.count; ++i) {
    const batch::source& piece = sent.sources[i];
    const std::size_t part = std::min(taken, piece.bytes);
    taken -= part;
    const bool whole = part == piece.bytes;
    if (piece.of_stop) {
      c.stop_out.advance(part);
    } else if (piece.slot == no_index) {
      c.control.written += part;
    } else if (piece.from == nullptr) {
      c.begun.written += part;
      if (whole) {
        slots_.end(c.begun.slot);
        note_sent(c, c.begun.slot);
        release(std::exchange(c.begun, {}).slot);
      }
    } else if (part > 0) {
      // What stands in front of it was passed over when it was gathered, because it is dead.
      while (drop_dead_front(*piece.from)) continue;
      assert(entries_.front(*piece.from).index == piece.slot);
      (void)entries_.pop(*piece.from); // its reference is released below, or goes on as the begun frame's
      if (piece.subscription != no_index) settle_sent(router_.subscription_at(piece.subscription));
      if (whole) {
        note_sent(c, piece.slot);
        release(piece.slot);
      } else {
        slots_.begin(piece.slot);
        c.begun = {.slot = piece.slot, .written = part, .key = piece.key};
      }
    }
    if (!whole) return settle_ready(c);
  }
  settle_ready(c);
}

void core::note_sent(connection& c, std::uint32_t slot) noexcept {
  add(counter::messages_out);
  ++c.messages_out;
  if (!letters_.under_way(slot)) return;
  letter& l = letters_.at(slot);
  l.sent = true;
  tell(std::exchange(l.sender, {}), l.own, {}); // one peer is enough: the others may not read for long
}

// A throttled subscription's next message is due a period after this one was, or after now if that is long
// past.
void core::settle_sent(subscription& of) noexcept {
  of.served = true;
  if (of.throttle == rt::duration{0}) return;
  const bool in_step = now_ - of.next_due < of.throttle;
  of.next_due = rt::deadline_after(in_step ? of.next_due : now_, of.throttle);
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
