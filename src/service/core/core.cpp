// SPDX-License-Identifier: Apache-2.0
// The cycle, its timers, and how a connection comes and goes.
#include "service/core/core.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace rowe::service {

core::core(rt::arena& memory, const core_options& options, const shared_parts& with_threads,
           const core_seams& seams, rt::time_point start) noexcept
    : core_parts{memory, options, with_threads, seams, *this, start} {
  if (state_.options.ours == side::client) state_.due.arm(timer::reconnect, start);
}

// ---- timers

// Arms the timers of the calls and messages of this cycle that are left. Most calls are answered, and most
// messages written, in the cycle that begins them; these never need the wheel.
inline void core::arm_what_stays() noexcept {
  message_store_.arm_unwritten();
  call_completion_.arm_open();
}

inline void core::notify_room() noexcept {
  const bool came = thread_submissions_.notify_room(direct_messages_.parking().renew_room());
  handle_submissions_.notify_room(came);
}

// ---- the cycle

// Not inlined, nor is record_cycle(): tests/counts/cycles.py finds cycles by these two.
[[gnu::noinline]] rt::time_point core::cycle(rt::time_point now) noexcept {
  const rt::time_point before = std::exchange(state_.cycle.now, now);
  if (topic_rates_.mark_if_due()) {
    own_pages_.end_period(now - before, now);
    liveness_.note_gap(now - before);
  }
  (void)call_requests_.take_awaited(); // of the last cycle
  if (state_.rights.renew()) { // before anything is read, so nothing is judged by rights that are gone
    revocation_.judge_all();
    close_marked();
  }
  ingress_.begin_cycle();
  came_before_ = awaited_came();
  state_.seams.transport.poll(now, *this);
  direct_messages_.take_outcomes();
  stop_service_.update();
  ingress_.unpark();
  ingress_.read_in_turn();
  direct_messages_.take_outcomes();
  direct_messages_.place_pending();
  if (call_requests_.awaited()) publish_predictor_.asked(state_.cycle.now);
  direct_messages_.parking().begin_cycle();
  // Who begins to wait in this cycle is retried in the next one.
  if (waits_for_room()) retried_at_ = ingress_.room_changes();
  handle_registry_.scan();
  if (long_deliveries_.any()) [[unlikely]] {
    broker_.deliver_long_values();
    handle_submissions_.note_more_left();
  }
  if (state_.peers.wants_close()) close_marked();
  thread_submissions_.take();
  notify_room();
  expire();
  stop_state_feed_.show();
  parameters_feed_.show();
  control_feed_.show();
  listings_.announce_changes();
  if (state_.peers.wants_close()) close_marked();
  sender_.flush_all();
  sender_.partial().cut_stalled([this](peer_index peer) {
    cut(state_.peers[peer], "this peer reads a message too slowly, and others wait for its slot");
  });
  direct_messages_.take_outcomes();
  arm_what_stays();
  state_.counts.raise_to(counter::queued_max, outbox_.entries().in_use());
  show(state_.seams.transport.memory(), state_.counts);
  return next_cycle();
}

bool core::has_answer() const noexcept {
  const pair_index awaited = call_requests_.awaited();
  return awaited && handle_submissions_.has_new(awaited);
}

rt::time_point core::write_answer(rt::time_point now) noexcept {
  assert(has_answer());
  state_.cycle.now = now;
  handle_submissions_.take(call_requests_.take_awaited());
  expire();
  sender_.flush_all();
  direct_messages_.take_outcomes();
  arm_what_stays();
  return next_cycle();
}

inline rt::time_point core::next_cycle() noexcept {
  // More than one cycle's budget was waiting: the next cycle is needed at once.
  if (handle_submissions_.more_left() || thread_submissions_.more_left() || outbox_.scheduled() != 0 ||
      ingress_.waits() || awaited_came() != came_before_)
    return state_.cycle.now;
  if (state_.peers.closes_in_next_cycle()) return state_.cycle.now;
  if (waits_for_room() && ingress_.room_changes() != retried_at_) return state_.cycle.now;
  return std::min({state_.due.next_wake(), stop_service_.next_update(), stop_state_feed_.due(),
                   listings_.due(), parameters_feed_.due()});
}

[[gnu::noinline]] void core::record_cycle(rt::duration took) noexcept {
  state_.counts.add(counter::cycles);
  state_.counts.raise_to(counter::cycle_ns_max,
                         static_cast<std::uint64_t>(std::max<std::int64_t>(took.count(), 0)));
}

void core::expire() noexcept {
  while (const auto due = state_.due.take_due(state_.cycle.now)) {
    const auto [what, index] = *due;
    switch (what) {
    case timer::slot: message_store_.expire({index}); break;
    case timer::subscription: subscription_queues_.throttle_over({index}); break;
    case timer::deadline: subscriptions_.check_deadline({index}); break;
    case timer::peer: liveness_.check({index}); break;
    case timer::call:
      if (!long_calls_.take_due({index})) call_completion_.time_out({index});
      break;
    case timer::statistics: statistics_feed_.publish(); break;
    case timer::reconnect: state_.seams.transport.connect(); break;
    case timer::partial_frames: sender_.partial().look_again(); break;
    case timer::graph: connection_graph_.show(); break;
    case timer::clock: clock_feed_.show(); break;
    case timer::control: break; // it only wakes this thread
    case timer::recording: broker_.recorded().copy_long_values(); break;
    }
    if (state_.peers.wants_close()) close_marked();
    direct_messages_.take_outcomes();
  }
}

bool core::drained() const noexcept {
  return outbox_.drained() && direct_messages_.pending() == 0 && thread_submissions_.drained() &&
         !sender_.partial().any() && !long_deliveries_.any() && handle_submissions_.drained();
}

void core::close_all(rt::time_point now) noexcept {
  state_.cycle.now = now;
  state_.cycle.closing = true;
  stop_service_.stop_all();
  state_.due.disarm(timer::reconnect);
  state_.last_values.end_waits();
  direct_messages_.close();
  handle_submissions_.retry_all(); // parked messages end as well
  thread_submissions_.retry();
  for (connection& c : state_.peers) {
    if (c.open()) close(c, wire::close_code::going_away, "the endpoint is closing");
  }
}

void core::stop_loops(rt::time_point now) noexcept {
  state_.cycle.now = now;
  stop_service_.stop_all();
}

// ---- frames

void core::handle(peer_index from, const wire::frame_step& step) noexcept {
  connection& c = state_.peers[from];
  if (step.in_pieces) [[unlikely]] {
    dispatcher_.dispatch_piece(from, step);
    if (state_.peers.wants_close()) close_marked();
    return;
  }
  switch (step.event) {
  case wire::frame_event::text: dispatcher_.dispatch(from, step.payload, false); break;
  case wire::frame_event::binary:
    if (c.protocol->can.binary) {
      dispatcher_.dispatch(from, step.payload, true);
    } else {
      state_.counts.add(counter::refused_requests);
      close(c, wire::close_code::unsupported_data, no_binary_diagnostic);
    }
    break;
  case wire::frame_event::ping: take_ping(c, step.payload); break;
  case wire::frame_event::pong: sender_.urgent().take_pong(from, step.payload); break;
  case wire::frame_event::close:
    if (c.ours == side::client && !step.reason.empty() && step.close_code == wire::close_code::too_big &&
        refusals_.admits_event(from))
      state_.events.report(event::kind::status_from_peer, c.peer(), step.reason, {}, c.identity);
    expire();
    sender_.flush(from); // answers that are there already go out before the close frame
    close(c, step.close_code == wire::close_code::none_given ? wire::close_code::normal : step.close_code,
          "");
    break;
  case wire::frame_event::violation:
    state_.counts.add(counter::violations);
    close(c, step.close_code, step.reason);
    break;
  case wire::frame_event::piece:
  case wire::frame_event::need_more: break;
  }
  if (state_.peers.wants_close()) close_marked();
}

void core::handle_again(peer_index from, std::span<std::byte> message, bool binary) noexcept {
  dispatcher_.dispatch_again(from, message, binary);
  if (state_.peers.wants_close()) close_marked();
}

void core::take_ping(connection& c, std::span<const std::byte> payload) noexcept {
  if (c.messages.take(state_.cycle.now))
    return sender_.send_control({c.id.index}, wire::opcode::pong, payload);
  state_.counts.add(counter::over_rate);
  refusals_.note_excess(c);
}

// ---- connections

admit_answer core::admit(const credentials& shown) const noexcept { return access_control_.admit(shown); }

void core::on_open(connection_id id, const peer_info& peer) noexcept {
  assert(id.index < state_.peers.size() && state_.peers[{id.index}].state == connection::phase::free);
  connection& c = state_.peers[{id.index}];
  c = connection{};
  c.id = id;
  c.state = connection::phase::open;
  c.ours = peer.ours;
  c.protocol = &state_.seams.protocols.find(peer.subprotocol);
  c.spoke_last = c.protocol->first.id();
  c.heard_at = c.opened_at = state_.cycle.now;
  c.local = is_loopback(peer.address);
  const bool outdated = c.ours == side::server && state_.rights.outdated(peer.who);
  c.who = outdated ? access::subject{} : peer.who;
  (void)c.identity.assign(state_.rights.policy().identity_name(c.who.identity)); // it fits: check_access()
  c.stop_only = peer.ours == side::server && peer.path == stop_path;
  c.address_bytes = static_cast<std::uint16_t>(std::min(peer.address.size(), c.address.size()));
  peer.address.copy(c.address.data(), c.address_bytes);
  ingress_.open({id.index});
  state_.counts.add(counter::peers_joined);
  state_.events.report(event::kind::peer_joined, c.peer(), "connected", {}, c.identity);
  outbox_.open({id.index});
  if (c.ours == side::server) c.messages = rate_limit{state_.bounds().messages_per_second_max};
  refusals_.open({id.index});
  sender_.open({id.index});
  liveness_.open({id.index});
  state_.shared.set_connection(id.index, id.generation, c.peer(), c.identity);
  stop_service_.open({id.index});
  stop_state_feed_.open({id.index});
  clock_feed_.open(c);
  const bool stays = !state_.cycle.closing && !outdated;
  if (c.ours == side::client && stays) handle_registry_.announce_all(c);
  c.takes_messages = !c.stop_only && (c.ours == side::client || state_.options.messages_unasked ||
                                      c.protocol->can.takes_messages);
  if (c.takes_messages && stays) direct_messages_.deliver_pending({id.index});
  state_.peers.add();
  state_.shared.set_peers(state_.peers.count()); // last: a thread that waits for a peer may publish at once
  if (c.protocol->can.listing && c.ours == side::server && !c.stop_only && stays) listings_.greet(c);
  if (outdated) close(c, wire::close_code::try_again_later, "the rights have just changed: connect again");
  if (state_.cycle.closing) close(c, wire::close_code::going_away, "the endpoint is closing");
}

void core::on_close(connection_id id, close_cause cause) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  if (cause == close_cause::timed_out) state_.counts.add(counter::stalled_peers);
  const std::string_view why = c->close_reason.empty() ? words_of(cause) : c->close_reason;
  state_.events.report(event::kind::peer_left, c->peer(), why, {}, c->identity);
  forget(*c);
  direct_messages_.take_outcomes();
  state_.shared.set_connection(id.index, 0, {});
  state_.peers.remove();
  state_.shared.set_peers(state_.peers.count());
  if (state_.options.ours == side::client) reconnect_later();
}

std::size_t core::wanted_bytes(connection_id id) const noexcept {
  return find(id) != nullptr ? ingress_.wanted_bytes({id.index}) : read_bytes_in_turn;
}

void core::on_bytes(connection_id id, std::span<std::byte> bytes) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  state_.counts.add(counter::bytes_in, bytes.size());
  c->heard_at = c->said_at = state_.cycle.now;
  attempts_failed_ = 0; // a server that sends something is alive
  ingress_.receive({id.index}, bytes);
}

// It counts as gone for its calls' answers, and for the stop, when what it sent has been read (on_close()).
void core::on_gone(connection_id id) noexcept {
  if (connection* const c = find(id)) c->gone = true;
}

void core::on_writable(connection_id id) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  sender_.writable({id.index});
}

// Releases everything that a peer holds.
void core::forget(connection& c) noexcept {
  c.state = connection::phase::closing; // its pending messages go to other peers from here on
  service_providers_.forget(c.id);
  call_completion_.forget(c.id);
  stop_service_.leave(c);
  sender_.forget({c.id.index});
  receiver_.forget({c.id.index});
  outbox_.forget({c.id.index});
  registrations_.forget({c.id.index});
  listings_.forget({c.id.index});
  state_.due.disarm(peer_index{c.id.index});
  ingress_.forget({c.id.index});
  fragment_ingress_.forget({c.id.index});
  ++state_.cycle.places_freed;
  direct_messages_.forget({c.id.index});
  c.state = connection::phase::free;
}

void core::close(connection& c, std::uint16_t code, std::string_view reason) noexcept {
  if (!c.open()) return;
  c.state = connection::phase::closing; // from here on only control frames are written
  stop_service_.leave(c);               // nothing is read from it any more, so for the stop a guard has left
  c.close_reason = reason;
  sender_.send_close({c.id.index}, code, reason);
  state_.seams.transport.close(c.id, close_how::flushed);
}

// See peer_table::close_later().
void core::close_marked() noexcept {
  while (connection* const c = state_.peers.take_marked()) close(*c, c->closes_as, c->close_reason);
}

// Closes at once: the peer loses what it has read only partly.
void core::cut(connection& c, std::string_view reason) noexcept {
  c.state = connection::phase::closing;
  stop_service_.leave(c);
  c.close_reason = reason;
  state_.seams.transport.close(c.id, close_how::aborted);
}

// ---- client

void core::on_rejected(const rejection& reason) noexcept {
  if (state_.options.ours == side::server) {
    state_.counts.add(counter::refused_handshakes);
    if (reason.http_status == rejection::slowed) state_.counts.add(counter::slowed_handshakes);
    return state_.events.report(event::kind::refused_handshake, reason.peer, reason.what, reason.remedy);
  }
  state_.events.report_failed_attempt(reason);
  reconnect_later();
}

void core::on_warning(std::string_view what, std::string_view remedy) noexcept {
  state_.events.report(event::kind::warning, {}, what, remedy);
}

// Exponential back-off. Each wait is shortened by up to a quarter at random, so that the clients of a
// restarted server do not connect all at once.
void core::reconnect_later() noexcept {
  if (state_.cycle.closing) return;
  rt::duration wait = state_.options.retry_min;
  for (std::uint32_t i = 0; i < attempts_failed_ && wait < state_.options.retry_max; ++i) wait *= 2;
  wait = std::min(wait, state_.options.retry_max);
  ++attempts_failed_;
  std::array<std::byte, 2> bytes;
  state_.seams.random.fill(bytes);
  const auto share = std::to_integer<std::int64_t>(bytes[0]) * 256 + std::to_integer<std::int64_t>(bytes[1]);
  state_.due.arm(timer::reconnect, state_.cycle.now + wait - wait / 4 * share / 65536);
}

// ---- peers on stop_path
//
// The transport reserves places for them, so the robot can be stopped even when all other peers are refused.
// Such a peer may stop, and see the state of the stop; nothing else. It holds its place only until another
// peer on stop_path needs it.

bool core::may_displace(connection_id id) const noexcept {
  const connection* const c = find(id);
  return c != nullptr && c->stop_only && (!c->open() || stop_service_.may_displace(*c));
}

void core::displace(connection_id id) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  state_.counts.add(counter::stop_peers_displaced);
  close(*c, wire::close_code::try_again_later, "another peer needs this place to stop the robot");
}

} // namespace rowe::service
