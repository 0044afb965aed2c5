// SPDX-License-Identifier: Apache-2.0
// The cycle, its timers, and how a connection comes and goes.
#include "service/core.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

namespace rowe::service {
namespace {

// Scratch for the longest names a request may have.
wire::name_limits name_limits_of(const limits& bounds) noexcept {
  return {.name_bytes_max = bounds.topic_bytes_max};
}

std::size_t scratch_bytes(const limits& bounds) noexcept {
  return wire::decode_scratch_bytes(name_limits_of(bounds));
}

// A silent peer is found this much later than promised, at most; and so much may a look at an unfinished
// message be late.
constexpr rt::duration care_period = std::chrono::milliseconds{500};
// Peers are looked after at multiples of this, those who share one together: a thousand quiet ones must not
// wake a sleeping thread two thousand times a second. 17 ms; where a slot of the wheel's second level begins,
// so that nothing wakes for its entries before they are due.
constexpr rt::duration care_step = 256 * rt::timer_wheel::tick;

// A ping may be unanswered for so many times silence_max, whatever else its peer says.
constexpr int silences_unanswered_max = 2;

// Stops that wait for the loops: one for each peer, and some of this process.
std::size_t stop_waiters_of(const limits& bounds) noexcept { return bounds.connections_max + std::size_t{8}; }

// Whether a peer's address is of this machine.
bool is_loopback(std::string_view address) noexcept {
  return address.starts_with("127.") || address.starts_with("[::1]");
}

std::uint64_t draw(entropy& from) noexcept {
  std::array<std::byte, sizeof(std::uint64_t)> dice;
  from.fill(dice);
  return std::bit_cast<std::uint64_t>(dice);
}

// Why a peer is cut that says too much.
close_reason flood_reason(std::string_view what, std::uint32_t per_second, std::string_view remedy,
                          std::string_view option) noexcept {
  std::array<char, wire::close_reason_bytes_max> room;
  wire::text_out why{room};
  why.add("more than ").add(std::int64_t{per_second}).add(" ").add(what).add(" a second for ");
  why.add(flood_time_max / std::chrono::seconds{1}).add(" s: ").add(remedy);
  close_reason reason;
  reason = why.add(" (limit ").add(option).add(")").text();
  return reason;
}

} // namespace

std::size_t core::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return timers::footprint_bytes(bounds) + peer_table::footprint_bytes(bounds) +
         router::footprint_bytes(bounds) + latch_store::footprint_bytes(bounds) +
         message_store::footprint_bytes(bounds) + outbox::footprint_bytes(bounds) +
         sender::footprint_bytes(bounds) + ingress::footprint_bytes(bounds) +
         arena::bytes_for<advertisement>(std::size_t{bounds.connections_max} *
                                         bounds.advertisements_per_connection_max) +
         arena::bytes_for<lane_view>(bounds.lanes_max) +     //
         arena::bytes_for<std::uint32_t>(bounds.calls_max) + //
         arena::bytes_for(scratch_bytes(bounds)) +           //
         phase_plan::footprint_bytes(bounds) +               //
         receiver::footprint_bytes(bounds) + direct_messages::footprint_bytes(bounds) +
         services::footprint_bytes(bounds) + call_table::footprint_bytes(bounds) + //
         arena::bytes_for<std::uint32_t>(bounds.door_slots) +
         arena::bytes_for<stop_waiter>(stop_waiters_of(bounds));
}

core::core(rt::arena& memory, const core_options& options, std::span<detail::lane> lanes, board& shown,
           front_door& door, core_seams seams, rt::time_point start) noexcept
    : options_{options},
      bounds_{options.bounds},
      ours_{options.ours},
      name_bytes_{std::min(options.name.size(), name_.size())},
      carrier_{seams.carrier},
      random_{seams.random},
      validator_{seams.validator},
      protocols_{seams.protocols},
      page_{seams.page},
      shown_{shown},
      door_{door},
      cycle_{.now = start},
      timers_{memory, bounds_, start},
      peers_{memory, bounds_},
      router_{memory, bounds_, seams.protocols.envelope},
      latches_{memory, bounds_},
      store_{memory,
             bounds_,
             {.cycle = cycle_,
              .counts = shown.counts,
              .due = timers_,
              .text_bytes_max = seams.protocols.message_bytes_max}},
      outbox_{memory,
              bounds_,
              {.cycle = cycle_,
               .counts = shown.counts,
               .due = timers_,
               .store = store_,
               .peers = peers_,
               .topics = router_,
               .latches = latches_}},
      sender_{memory,
              bounds_,
              {.cycle = cycle_,
               .counts = shown.counts,
               .due = timers_,
               .peers = peers_,
               .topics = router_,
               .store = store_,
               .out = outbox_,
               .carrier = seams.carrier,
               .random = seams.random}},
      lanes_{lanes},
      views_{memory.carve<lane_view>(bounds_.lanes_max)},
      calls_{memory, bounds_},
      delivery_{{.cycle = cycle_, .counts = shown.counts, .lanes = lanes, .views = views_, .door = door}},
      receiver_{memory,
                bounds_,
                {.cycle = cycle_,
                 .counts = shown.counts,
                 .peers = peers_,
                 .out = outbox_,
                 .lanes = lanes,
                 .views = views_,
                 .door = door,
                 .delivery = delivery_,
                 .claimants = claimants(),
                 .answers_any = options.answers_any}},
      ingress_{memory,
               bounds_,
               {.cycle = cycle_,
                .counts = shown.counts,
                .peers = peers_,
                .carrier = seams.carrier,
                .out = outbox_,
                .writer = sender_,
                .inbox = receiver_,
                .handler = *this}},
      messages_{memory,
                bounds_,
                {.cycle = cycle_,
                 .shown = shown,
                 .peers = peers_,
                 .calls = calls_,
                 .store = store_,
                 .out = outbox_,
                 .delivery = delivery_,
                 .inbox = receiver_,
                 .validator = seams.validator,
                 .claimants = claimants()}},
      phases_{memory, bounds_, shown.counts},
      services_{memory, bounds_},
      subscription_claims_{claims_to(bounds_.subscriptions_max)},
      service_claims_{claims_to(services_of_peers(bounds_))},
      call_claims_{claims_to(calls_of_peers(bounds_))},
      door_held_{memory.carve<std::uint32_t>(bounds_.door_slots)},
      unarmed_calls_{memory.carve<std::uint32_t>(bounds_.calls_max)},
      scratch_{memory.carve<char>(scratch_bytes(bounds_))},
      stop_{options.stop, start, draw(seams.random)},
      stop_waiters_{memory.carve<stop_waiter>(stop_waiters_of(bounds_))},
      opened_at_{start},
      rates_marked_{start, start} {
  options.name.copy(name_.data(), name_bytes_);
  too_many_messages_ =
      flood_reason("messages", bounds_.messages_per_second_max, "send fewer", "messages_per_second_max");
  too_many_refusals_ = flood_reason("refused requests", bounds_.refusals_per_second_max, "heed the refusals",
                                    "refusals_per_second_max");
  const auto advertised =
      memory.carve<advertisement>(peers_.size() * bounds_.advertisements_per_connection_max);
  for (std::uint32_t i = 0; i < peers_.size(); ++i) {
    peers_[peer_index{i}].advertised = advertised.subspan(i * bounds_.advertisements_per_connection_max,
                                                          bounds_.advertisements_per_connection_max);
  }
  calls_.begin(draw(random_));
  if (ours_ == side::server) { // a client's handles on it are told its server's
    statistics_topic_ = router_.find_or_add(wire::stats_name);
    router_.hold_as_own(statistics_topic_);
    router_.at(statistics_topic_).keep = keep::newest;
  }
  stop_topic_ = router_.find_or_add(stop_state_topic);
  router_.hold_as_own(stop_topic_);
  if (ours_ == side::client) timers_.arm(timer::reconnect, start);
}

// ---- timers

// Most calls are answered in the cycle that begins them, and most messages written in the one that makes
// them: those never need the wheel. The others come to it here.
inline void core::arm_what_stays() noexcept {
  store_.arm_unwritten();
  for (const std::uint32_t index : unarmed_calls_.first(std::exchange(unarmed_count_, 0))) {
    const call& one = calls_.at(index); // perhaps another one by now, which does no harm
    if (one.open && one.deadline != rt::never) timers_.arm(call_index{index}, one.deadline);
  }
}

// ---- the cycle

rt::time_point core::cycle(rt::time_point now) noexcept {
  now_ = now;
  asked_lane_ = no_index;
  ingress_.begin_cycle();
  carrier_.poll(now, *this);
  messages_.take_outcomes();
  turn_stop();
  ingress_.unpark();
  ingress_.read_in_turn();
  messages_.take_outcomes();
  messages_.place_pending();
  if (asked_lane_ != no_index) phases_.asked(now_);
  messages_.begin_cycle();
  retried_at_ = room_changes();
  take_from_lanes();
  take_from_door();
  tell_of_room();
  expire();
  if (now_ - rates_marked_[0] >= rates_period) mark_rates();
  show_stop_state();
  sender_.flush_all();
  sender_.partial().cut_stalled([this](peer_index peer) {
    cut(peers_[peer], "it reads a message too slowly, and others wait for its slot");
  });
  messages_.take_outcomes();
  arm_what_stays();
  shown_.counts.raise_to(counter::queued_max, outbox_.entries().in_use());
  show_carrier_memory();
  return next_cycle();
}

rt::time_point core::write_answer(rt::time_point now) noexcept {
  assert(has_answer());
  now_ = now;
  take_from(std::exchange(asked_lane_, no_index));
  expire();
  sender_.flush_all();
  messages_.take_outcomes();
  arm_what_stays();
  return next_cycle();
}

inline rt::time_point core::next_cycle() const noexcept {
  // More than one cycle's share was waiting: the next one is needed at once.
  if (lanes_left_ || outbox_.scheduled() != 0 || ingress_.waits()) return now_;
  // Something may find room now that did not before.
  if ((door_held_count_ != 0 || lanes_wait_) && room_changes() != retried_at_) return now_;
  return std::min(timers_.next_wake(), next_stop_turn());
}

inline void core::show_carrier_memory() noexcept {
  const carrier_memory now = carrier_.memory();
  shown_.counts.set(counter::handshake_bytes_used, now.bytes_used);
  shown_.counts.set(counter::handshake_bytes_peak, now.bytes_peak);
  shown_.counts.set(counter::handshake_allocations, now.allocations);
  shown_.counts.set(counter::handshakes_starved, now.refusals);
  shown_.counts.set(counter::handshakes_evicted, now.evictions);
}

void core::record_cycle(rt::duration took) noexcept {
  add(counter::cycles);
  shown_.counts.raise_to(counter::cycle_ns_max,
                         static_cast<std::uint64_t>(std::max<std::int64_t>(took.count(), 0)));
}

void core::expire() noexcept {
  while (const auto due = timers_.take_due(now_)) {
    const auto [what, index] = *due;
    switch (what) {
    case timer::slot: store_.expire(index); break;
    case timer::subscription: outbox_.throttle_over(index); break;
    case timer::peer: look_after(peers_[peer_index{index}]); break;
    case timer::call:
      add(counter::calls_timed_out);
      finish_badly(index, {errc::timed_out, 0, calls_.at(index).timeout.count()});
      break;
    case timer::statistics: publish_statistics(); break;
    case timer::reconnect: carrier_.connect(); break;
    case timer::partial_frames: sender_.partial().look_again(); break;
    }
    messages_.take_outcomes();
  }
}

bool core::drained() const noexcept {
  if (!outbox_.drained() || messages_.pending() != 0 || !door_.drained() || sender_.partial().any())
    return false;
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    if (!views_[i].attached) continue;
    const detail::lane& lane = lanes_[i];
    if (detail::subscribes(lane.kind)) continue;
    if (views_[i].held_first != no_index) return false;
    if (lane.service.out.out != nullptr && lane.service.out.out->waiting_at_least() != 0) return false;
  }
  return true;
}

void core::close_all(rt::time_point now) noexcept {
  now_ = now;
  closing_ = true;
  stop_loops(now);
  timers_.disarm(timer::reconnect);
  messages_.close();
  for (std::uint32_t i = 0; i < lanes_.size(); ++i) retry_entries(i); // what was put aside ends as well
  retry_door();
  for (connection& c : peers_) {
    if (c.open()) close(c, wire::close_code::going_away, "the endpoint is closing");
  }
}

// ---- a connection's life

void core::on_open(connection_id id, const peer_info& peer) noexcept {
  assert(id.index < peers_.size() && peers_[peer_index{id.index}].state == connection::phase::free);
  connection& c = peers_[peer_index{id.index}];
  const auto advertised = c.advertised;
  c = connection{};
  c.advertised = advertised;
  c.id = id;
  c.state = connection::phase::open;
  c.ours = peer.ours;
  c.protocol = &protocols_.find(peer.subprotocol);
  c.spoke_last = c.protocol->first.id();
  c.heard_at = c.opened_at = now_;
  c.local = is_loopback(peer.address);
  c.stop_only = peer.ours == side::server && peer.path == stop_path;
  c.address_bytes = std::min(peer.address.size(), c.address.size());
  peer.address.copy(c.address.data(), c.address_bytes);
  ingress_.open({id.index});
  add(counter::peers_joined);
  report(event::kind::peer_joined, c.peer(), "connected");
  outbox_.open({id.index});
  if (c.ours == side::server) c.messages = rate_limit{bounds_.messages_per_second_max};
  c.refusals = rate_limit{bounds_.refusals_per_second_max};
  c.reports = rate_limit{std::chrono::seconds{1}, reports_burst};
  sender_.open({id.index});
  look_after_later(c);
  shown_.set_connection(id.index, id.generation, c.peer());
  stop_state_due_ = now_; // it may be one of those that are shown it unasked
  if (c.ours == side::client && !closing_) announce_all(c);
  c.takes_messages =
      !c.stop_only && (c.ours == side::client || options_.messages_unasked || c.protocol->can.takes_messages);
  if (c.takes_messages && !closing_) messages_.deliver_pending({id.index});
  peers_.add();
  shown_.set_peers(peers_.count()); // last: who waits for a peer may publish at once
  if (closing_) close(c, wire::close_code::going_away, "the endpoint is closing");
}

void core::on_close(connection_id id, close_cause cause) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  if (cause == close_cause::timed_out) add(counter::stalled_peers);
  constexpr std::string_view words[] = {"closed", "the peer closed the stream", "the connection was reset",
                                        "the peer does not read"};
  report(event::kind::peer_left, c->peer(),
         c->farewell.empty() ? words[static_cast<std::size_t>(cause)] : c->farewell);
  forget(*c);
  messages_.take_outcomes();
  shown_.set_connection(id.index, 0, {});
  peers_.remove();
  shown_.set_peers(peers_.count());
  if (ours_ == side::client) reconnect_later();
}

std::size_t core::wanted_bytes(connection_id id) const noexcept {
  return find(id) != nullptr ? ingress_.wanted_bytes({id.index}) : read_bytes_alone;
}

void core::on_bytes(connection_id id, std::span<std::byte> bytes) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  add(counter::bytes_in, bytes.size());
  c->heard_at = now_;
  attempts_failed_ = 0; // a server that says something is alive
  ingress_.receive({id.index}, bytes);
}

void core::on_writable(connection_id id) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  sender_.writable({id.index});
}

// Gives back everything that a connection holds.
void core::forget(connection& c) noexcept {
  c.state = connection::phase::closing; // what it had been given goes to others from here on
  end_calls_of(c);
  leave_stop(c);
  sender_.forget({c.id.index});
  receiver_.forget({c.id.index});
  outbox_.forget({c.id.index});
  while (c.first_subscription != no_index) remove_subscription(c, c.first_subscription);
  for (std::uint32_t i = 0; i < router_.topic_places() && !ROWE_MUTANT(latch_of_the_gone); ++i)
    forget_latched(router_.at(i), {latch_owner::kind::peer, c.id.index});
  while (c.advertisements > 0) let_go_topic(c.advertised[--c.advertisements].topic);
  timers_.disarm(peer_index{c.id.index});
  ingress_.forget({c.id.index});
  ++cycle_.places_freed;
  messages_.forget({c.id.index});
  c.state = connection::phase::free;
}

void core::close(connection& c, std::uint16_t code, std::string_view reason) noexcept {
  if (!c.open()) return;
  c.state = connection::phase::closing; // from here on only control frames are written
  leave_stop(c);                        // nor is anything heard: a guard has gone
  c.farewell = reason;
  sender_.send_close({c.id.index}, code, reason);
  carrier_.close(c.id, close_how::flushed);
}

// At once: what it has begun to read is lost to it.
void core::cut(connection& c, std::string_view reason) noexcept {
  c.state = connection::phase::closing;
  leave_stop(c);
  c.farewell = reason;
  carrier_.close(c.id, close_how::aborted);
}

void core::look_after_later(const connection& c) noexcept {
  const rt::duration when = now_.time_since_epoch() + care_period;
  timers_.arm(peer_index{c.id.index}, rt::time_point{when / care_step * care_step});
}

// Runs every care_period for each connection: pings whoever is silent, cuts whoever stays so or does not
// finish what it began.
void core::look_after(connection& c) noexcept {
  if (!c.open()) return;
  look_after_later(c);
  report_refusals(c);
  if (c.unheard) ++cycle_.places_freed; // whether somebody receives is a question of time, too
  const rt::time_point began = ingress_.unfinished_since({c.id.index});
  if (began != rt::never && now_ - began > options_.message_time_max) {
    add(counter::unfinished_messages);
    return close(c, wire::close_code::policy, "a message was not finished in time");
  }
  if (!c.protocol->can.control_frames) return; // it answers no pings
  const rt::duration silence = now_ - c.heard_at;
  if (c.unheard) {
    // What we do not read is no silence of its; and it is to know that we are there.
    if (silence <= options_.ping_period) return;
    c.heard_at = now_;
    return sender_.send_control({c.id.index}, wire::opcode::pong, {});
  }
  if (silence > options_.silence_max) {
    // It answers no ping, and something waits for it.
    const bool unread = sender_.urgent().unresponsive({c.id.index}) && queues_of(c).held;
    add(unread ? counter::stalled_peers : counter::silent_peers);
    return close(c, wire::close_code::policy,
                 unread ? "the peer does not read" : "nothing was heard for too long");
  }
  // One that goes on talking is not silent; but it does not read either.
  const rt::time_point waits_since =
      std::max(sender_.urgent().waits_for_pong_since({c.id.index}), c.unheard_until);
  if (now_ - waits_since > silences_unanswered_max * options_.silence_max) {
    add(counter::stalled_peers);
    return close(c, wire::close_code::policy, "the peer does not answer pings");
  }
  if (silence > options_.ping_period) sender_.urgent().request_ping({c.id.index});
  sender_.urgent().check_responsive({c.id.index});
}

// ---- as a client

void core::on_refused(const refusal& reason) noexcept {
  if (ours_ == side::server) {
    add(counter::refused_handshakes);
    return report(event::kind::refused_handshake, reason.peer, reason.what, reason.remedy);
  }
  report(event::kind::cannot_connect, reason.peer, reason.what, reason.remedy);
  reconnect_later();
}

// Exponential back-off, each wait shortened by up to a quarter at random, so that the clients of a server
// that comes back do not come all at once.
void core::reconnect_later() noexcept {
  if (closing_) return;
  rt::duration wait = options_.retry_min;
  for (std::uint32_t i = 0; i < attempts_failed_ && wait < options_.retry_max; ++i) wait *= 2;
  wait = std::min(wait, options_.retry_max);
  ++attempts_failed_;
  std::array<std::byte, 2> dice;
  random_.fill(dice);
  const auto share = std::to_integer<std::int64_t>(dice[0]) * 256 + std::to_integer<std::int64_t>(dice[1]);
  timers_.arm(timer::reconnect, now_ + wait - wait / 4 * share / 65536);
}

// ---- the rest

http_answer core::on_http(const http_request& request) noexcept { return page_(request); }

void core::report(event::kind kind, std::string_view peer, std::string_view what,
                  std::string_view remedy) noexcept {
  const bool of_coming = kind == event::kind::peer_joined || kind == event::kind::peer_left ||
                         kind == event::kind::refused_handshake;
  if (of_coming && !comings_.take(now_)) return add(counter::events_lost);
  event happened;
  happened.what_kind = kind;
  happened.peer = peer;
  happened.what = what;
  happened.remedy = remedy;
  shown_.post(happened);
}

} // namespace rowe::service
