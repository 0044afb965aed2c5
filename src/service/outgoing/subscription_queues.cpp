// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/subscription_queues.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/outgoing/drop_stale.hpp"

namespace rowe::service {

void subscription_queues::fan_out(topic_id topic_index, slot_id slot, bool kept) noexcept {
  const topic& on = state_.topics.at(topic_index);
  for (subscription_id i = on.subscriptions.head; i; i = subscription_rows_[i].next_on_topic) {
    if (accepts(subscription_rows_[i])) push(i, slot, kept);
  }
}

void subscription_queues::fan_out(topic_id topic_index, slot_id slot, bool kept,
                                  const whole_source& of) noexcept {
  struct made {
    slot_id slot{};
    bool tried = false;
  };
  std::array<std::array<made, 2>, wire::codecs_max> all; // by codec, and by whether the name has its slash
  const topic& on = state_.topics.at(topic_index);
  for (subscription_id i = on.subscriptions.head; i; i = subscription_rows_[i].next_on_topic) {
    subscription& s = subscription_rows_[i];
    if (!accepts(s)) continue;
    if (!s.whole) {
      if (slot) push(i, slot, kept);
      continue;
    }
    made& its = all[static_cast<std::size_t>(s.codec)][s.unslashed];
    if (!std::exchange(its.tried, true)) its.slot = compose_whole(s, slot, of);
    if (its.slot) push(i, its.slot, kept);
  }
  for (const auto& of_codec : all) {
    for (const made& one : of_codec) {
      if (one.slot) message_store_.release(one.slot);
    }
  }
}

// The codec of a peer that asked for this writes a message of its own. It gets no times to live. What a
// socket has not taken when its time is over is dropped, as any other message.
slot_id subscription_queues::compose_whole(const subscription& to, slot_id text,
                                           const whole_source& of) noexcept {
  const wire::codec& codec = state_.seams.protocols.of(to.codec);
  std::string_view name = state_.topics.name(to.topic);
  if (to.unslashed && name.starts_with('/')) name.remove_prefix(1);
  wire::topic_message what{.topic = name,
                           .wall_ns = rt::nanoseconds_of(of.published) + state_.options.wall_offset_ns,
                           .text = {},
                           .value = {},
                           .schema = state_.topics.at(to.topic).schema};
  if (of.value.others != nullptr && codec.writes_types()) {
    what.value = of.value;
  } else if (text) {
    const auto body = message_store_.slots().body(text);
    what.text = {body.data(), body.size()};
  } else {
    return {};
  }
  const auto lifetime = message_lifetime::of_topic(of.expires, state_.cycle.now);
  const slot_id slot = outbox_.compose(message_lifetime{lifetime.expires},
                                       [&](json::writer& out) { return codec.write_message(out, what); });
  if (!slot) return {};
  slot_pool& slots = message_store_.slots();
  if (codec.heads_whole())
    slots.mark_body(slot, 0, slots.text(slot).size(), of.published);
  else
    slots.mark_whole(slot, of.published);
  if (!text) state_.topics.at(to.topic).bytes = slots.text(slot).size();
  return slot;
}

// A value within the throttle period after the last one is discarded, unless the peer asked for a queue.
bool subscription_queues::accepts(subscription& s) noexcept {
  if (!s.discards || state_.cycle.now >= s.next_due) return true;
  add(counter::throttled);
  s.latched_until = state_.latches.newest(); // it may have taken the place of one that is still pending
  return false;
}

void subscription_queues::note_unsent(topic_id topic) noexcept {
  for (subscription_id i = state_.topics.at(topic).subscriptions.head; i;
       i = subscription_rows_[i].next_on_topic)
    subscription_rows_[i].latched_until = state_.latches.newest();
}

inline void subscription_queues::push(subscription_id index, slot_id slot, bool kept) noexcept {
  subscription& s = subscription_rows_[index];
  state_.cycle.work_bytes += push_work;
  if (s.latched_pending) [[unlikely]]
    if (joins_latched(s, kept)) return;
  outbox_.drop_expired(s.pending);
  if (s.pending.count >= s.depth) trim(s, s.depth - 1);
  if (!outbox_.enqueue(s.pending, slot)) return note_full(s);
  message_store_.slots().retain(slot);
  make_ready(index);
}

void subscription_queues::note_full(const subscription& s) noexcept {
  add(counter::outbox_full);
  ++outbox_.of(s.peer).dropped;
}

// Drops the oldest messages of a subscription until it holds `most`.
void subscription_queues::trim(subscription& s, std::uint32_t most) noexcept {
  for (outbox_.drop_expired(s.pending); s.pending.count > most;
       ROWE_MUTANT(depth) ? void() : outbox_.drop_expired(s.pending)) {
    // The counter says why: the peer wants only the newest, or fewer, or it does not read fast enough.
    const bool chosen = s.throttle > rt::duration{0} && !outbox_.of(s.peer).backpressured();
    if (s.merges || s.discards || chosen)
      add(chosen && !s.merges && !s.discards ? counter::throttled : counter::replaced);
    else
      note_full(s);
    outbox_.drop_front(s.pending);
  }
}

void subscription_queues::merge_requests(subscription_id index) noexcept {
  subscription& s = subscription_rows_[index];
  state_.subscriptions.merge(s, state_.bounds().queue_depth_max);
  if (s.request_count > 1 || (s.request_count == 1 && s.requests[0].codec != s.codec)) merge_codecs(s);
  if (!ROWE_MUTANT(depth)) trim(s, s.depth);
  if (ROWE_MUTANT(throttle)) return;
  s.next_due = s.sent_at == rt::time_point{} ? s.sent_at : rt::deadline_after(s.sent_at, s.throttle);
  if (std::exchange(s.timed, false)) state_.due.disarm(index);
  make_ready(index);
}

// Of the codecs that a peer asked for, the one with the highest number.
void subscription_queues::merge_codecs(subscription& s) noexcept {
  wire::codec_id codec = s.requests[0].codec;
  for (std::uint8_t i = 1; i < s.request_count; ++i) codec = std::max(codec, s.requests[i].codec);
  if (codec != s.codec)
    state_.subscriptions.set_form(s, state_.seams.protocols.of(codec), s.tag, s.unslashed);
}

void subscription_queues::schedule_latched(subscription_id index) noexcept {
  subscription& s = subscription_rows_[index];
  s.latched_delivered = {};
  s.latched_until = state_.latches.newest();
  s.latched_pending = true;
  ++outbox_.of(s.peer).latched_pending;
  make_ready(index);
}

void subscription_queues::throttle_over(subscription_id index) noexcept {
  subscription_rows_[index].timed = false;
  make_ready(index);
}

inline void subscription_queues::put_on_ready_list(subscription_id index, subscription& s) noexcept {
  if (state_.cycle.now < s.next_due) {
    if (!std::exchange(s.timed, true)) state_.due.arm(index, s.next_due);
    return;
  }
  if (std::exchange(s.timed, false)) state_.due.disarm(index);
  s.ready_as = state_.topics.at(s.topic).priority;
  s.ready = true;
  const peer_index peer = s.peer;
  outbox_.of(peer).ready[static_cast<std::size_t>(s.ready_as)].push_back(subscription_rows_, index);
  outbox_.schedule(peer);
}

// Queues one latched value for a late subscriber, but only when it can be written. So a peer that subscribes
// to many topics at once, or to one with many publishers, does not take a slot for each value.
void subscription_queues::place_latched(subscription& s) noexcept {
  latched_list& all = state_.topics.at(s.topic).latched;
  if (s.latched_delivered.number == 0) state_.latches.drop_expired(all, state_.cycle.now);
  const latch_id which = next_latched(s, all);
  if (which) s.latched_delivered = {which, state_.latches.at(which).number};
  if (!which || !next_latched(s, all)) {
    s.latched_pending = false;
    --outbox_.of(s.peer).latched_pending;
  }
  if (!which) return;
  const latched_value& kept = state_.latches.at(which).value;
  slot_id slot = long_outbox_.compose_latched(s.topic, kept);
  if (!slot) return;
  if (s.whole && !message_store_.slots().chunked(slot)) {
    const slot_id text = std::exchange(slot, compose_whole(s, slot, {kept.published, kept.expires}));
    message_store_.release(text);
    if (!slot) return;
  }
  trim(s, s.depth - 1);
  if (outbox_.enqueue(s.pending, slot)) return; // the queue has the reference now
  note_full(s);
  message_store_.release(slot);
}

// The next value that it is to get, and that has not expired.
latch_id subscription_queues::next_latched(subscription& s, const latched_list& all) noexcept {
  latch_id which = state_.latches.next(all, s.latched_delivered, s.latched_until);
  while (which && state_.latches.at(which).value.expires <= state_.cycle.now) {
    s.latched_delivered = {which, state_.latches.at(which).number};
    which = state_.latches.next(all, s.latched_delivered, s.latched_until);
  }
  return which;
}

// A newer message comes, and latched values are pending, which go before it. If they are few, they are queued
// here. If not, the message itself waits among them (true), if it was latched (`kept`). If not, it takes the
// place of the oldest, as in a queue that is full.
bool subscription_queues::joins_latched(subscription& s, bool kept) noexcept {
  const latched_list& all = state_.topics.at(s.topic).latched;
  const std::uint32_t most = std::min(s.depth - 1, latched_before_max);
  std::uint32_t pending = 0;
  for (latched_place at = s.latched_delivered; pending <= most || !kept; ++pending) {
    const latch_id next = state_.latches.next(all, at, s.latched_until);
    if (!next) break;
    at = {next, state_.latches.at(next).number};
  }
  if (pending > most && kept) {
    s.latched_until = state_.latches.newest();
    return true;
  }
  for (; pending > most; --pending) {
    const latch_id oldest = state_.latches.next(all, s.latched_delivered, s.latched_until);
    s.latched_delivered = {oldest, state_.latches.at(oldest).number};
    add(counter::replaced);
  }
  while (s.latched_pending) place_latched(s);
  return false;
}

bool subscription_queues::place_pending_latched(peer_index peer) noexcept {
  const auto all = subscription_rows_;
  for (const ready_list& on : outbox_.of(peer).ready) {
    for (subscription_id i = on.head; i; i = all[i].next_ready) {
      subscription& s = all[i];
      if (!s.latched_pending) continue;
      drop_stale(outbox_, state_, message_store_.slots(), s);
      if (s.pending.count >= s.depth) continue; // the last one is still to be written
      place_latched(s);
      return true;
    }
  }
  return false;
}

// ---- sender

// The next message is due one period after this one was due; if that is long past, one period after now. The
// same holds if this one was ready before the peer asked for a longer period, and so is not due yet.
void subscription_queues::begin_throttle(subscription& s) noexcept {
  const rt::duration late = state_.cycle.now - s.next_due;
  const bool in_step = (late >= rt::duration{0} || ROWE_MUTANT(throttle_ahead)) && late < s.throttle;
  s.sent_at = in_step ? s.next_due : state_.cycle.now;
  s.next_due = rt::deadline_after(s.sent_at, s.throttle);
}

void subscription_queues::rotate_ready(peer_index peer) noexcept {
  for (ready_list& on : outbox_.of(peer).ready) {
    if (on.empty()) continue;
    ready_list before = std::exchange(on, {});
    ready_list served;
    while (!before.empty()) {
      const subscription_id i = before.pop_front(subscription_rows_);
      subscription& s = subscription_rows_[i];
      outbox_.drop_expired(s.pending); // else it would stay ready with nothing to write, and schedule nobody
      // A served subscription goes behind the others only if it has more to write.
      if (s.served && !s.pending.empty()) {
        served.push_back(subscription_rows_, i);
      } else {
        s.ready = s.served = false;
        make_ready(i);
      }
    }
    while (!served.empty()) {
      const subscription_id i = served.pop_front(subscription_rows_);
      subscription_rows_[i].ready = subscription_rows_[i].served = false;
      make_ready(i);
    }
  }
}

void subscription_queues::drop(subscription_id index) noexcept {
  subscription& s = subscription_rows_[index];
  peer_queues& its_peer = outbox_.of(s.peer);
  outbox_.drop_all(s.pending, counter::lost_with_peer);
  if (std::exchange(s.latched_pending, false)) --its_peer.latched_pending;
  if (std::exchange(s.timed, false)) state_.due.disarm(index);
  if (std::exchange(s.ready, false)) {
    [[maybe_unused]] const bool was =
        its_peer.ready[static_cast<std::size_t>(s.ready_as)].erase(subscription_rows_, {index});
    assert(was);
  }
}

// ---- checks

bool subscription_queues::any_due(peer_index peer) const noexcept {
  const auto any_in = [this](const queue& in) {
    for (entry_id at = in.entries.head; at; at = outbox_.entries().after(at)) {
      if (message_store_.is_due(outbox_.entries().at(at))) return true;
    }
    return false;
  };
  const peer_queues& of = std::as_const(outbox_).of(peer);
  if (any_in(of.replies) || any_in(of.long_replies)) return true;
  if (std::any_of(of.direct.begin(), of.direct.end(), any_in)) return true;
  for (const ready_list& on : of.ready) {
    for (subscription_id s = on.head; s; s = subscription_rows_[s].next_ready) {
      if (subscription_rows_[s].latched_pending || any_in(subscription_rows_[s].pending)) return true;
    }
  }
  return false;
}

bool subscription_queues::check() const noexcept {
  for (const peer_index i : state_.peers.ids()) {
    if (state_.peers[i].state == connection::phase::free) continue;
    const peer_queues& of = std::as_const(outbox_).of(i);
    std::uint32_t ready = 0;
    std::uint32_t latched_pending = 0;
    for (subscription_id s = state_.subscriptions.first_of(i); s; s = subscription_rows_[s].next_on_peer) {
      const subscription& one = subscription_rows_[s];
      const bool on_wheel = one.timed && one.next_due != rt::never; // one never due is not on the wheel
      if (on_wheel != state_.due.armed(s) || one.sent_at > state_.cycle.now) return false;
      ready += one.ready;
      latched_pending += one.latched_pending;
    }
    for (const ready_list& on : of.ready) {
      for (subscription_id s = on.head; s && ready != UINT32_MAX; s = subscription_rows_[s].next_ready) {
        const subscription& one = subscription_rows_[s];
        if (one.peer != i || !one.ready || &of.ready[static_cast<std::size_t>(one.ready_as)] != &on)
          return false;
        --ready;
      }
    }
    if (ready != 0 || latched_pending != of.latched_pending) return false;
  }
  return true;
}

} // namespace rowe::service
