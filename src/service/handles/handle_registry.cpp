// SPDX-License-Identifier: Apache-2.0
#include "service/handles/handle_registry.hpp"

#include <algorithm>
#include <array>

#include <rowe/detail/mutation_points.hpp>

#include "service/handles/pair_release.hpp"
#include "wire/codec/codec.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

using detail::entry;
using detail::pair_phase;

void handle_registry::scan() noexcept {
  handle_submissions_.begin_cycle();
  publish_predictor_.looks(state_.cycle.now);
  const std::uint32_t used = state_.shared.pairs_used();
  for (pair_index i{0}; i.value < used; ++i.value) {
    switch (state_.pairs[i].lifecycle.look()) {
    case pair_phase::free:
    case pair_phase::refused: continue;
    case pair_phase::offered: attach(i); break;
    case pair_phase::active: handle_submissions_.take(i); break;
    case pair_phase::closing:
      if (state_.pair_rows[i].attached) handle_submissions_.take(i);
      if (handle_submissions_.has_unsent(i)) {
        handle_submissions_.note_waits();
      } else {
        detach(i);
      }
      break;
    case pair_phase::held:
      if (all_slots_released(state_.pairs[i])) state_.pairs[i].lifecycle.release(state_.pairs[i].arrival);
      break;
    }
    if (state_.pair_rows[i].parked_first) handle_submissions_.note_waits();
  }
}

bool handle_registry::quiet() const noexcept {
  return std::all_of(state_.pairs.begin(), state_.pairs.begin() + state_.shared.pairs_used(),
                     [](const detail::queue_pair& one) { return one.epoch.quiet(); });
}

// ---- attach

// Set-up is answered last, so the first value finds its listener.
void handle_registry::attach(pair_index pair) noexcept {
  detail::queue_pair& queues = state_.pairs[pair];
  state_.pair_rows[pair] = {.generation = state_.pair_rows[pair].generation + 1, .order = ++attached_};
  const status done = attach_to_part(pair);
  done ? queues.lifecycle.accept(queues.arrival) : queues.lifecycle.refuse(done.error(), queues.arrival);
}

status handle_registry::attach_to_part(pair_index pair) noexcept {
  const detail::pair_kind kind = state_.pairs[pair].kind;
  if (detail::publishes(kind) || detail::subscribes(kind)) return topic_handles_.attach(pair);
  if (kind == detail::pair_kind::record) return topic_handles_.recorders().attach(pair);
  if (!detail::is_latch(kind)) return attach_talker(pair);
  const status done = stop_service_.attach(pair);
  state_.pair_rows[pair].attached = static_cast<bool>(done);
  return done;
}

status handle_registry::attach_talker(pair_index pair) noexcept {
  detail::queue_pair& queues = state_.pairs[pair];
  if (detail::responds(queues.kind)) {
    if (const status done = provide(pair); !done) return done;
  }
  state_.pair_rows[pair].attached = true;
  receiver_.attach();
  ++talking_;
  queues.audience.set(detail::audience::somebody);
  if (connection* const c = state_.peers.server()) announce_service(*c, pair, true);
  if (receiver_.pair() == pair && !state_.threads_inbox.has_receiver()) take_over_inbox(pair);
  return {};
}

status handle_registry::provide(pair_index pair) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const service_index found = service_directory_.find(queues.name());
  if (found && !service_directory_.at(found).pair && !ROWE_MUTANT(pinned_service))
    service_providers_.take_from_peer(found);
  const auto [at, why] = service_directory_.add(queues.name(), queues.type(), pair, {});
  if (why == service_directory::refusal::taken) return errc::service_taken;
  if (why == service_directory::refusal::no_room)
    return error{errc::too_many_services, service_directory_.count(), state_.bounds().services_max};
  state_.pair_rows[pair].service = at;
  return {};
}

// The first receiver gets the messages that came before anybody received.
void handle_registry::take_over_inbox(pair_index pair) noexcept {
  const call_endpoint us = call_endpoint::of(pair, state_.pair_rows[pair].generation);
  while (const auto slot = state_.threads_inbox.take_back(state_.cycle.now)) {
    const inbound_header& came = state_.threads_inbox.header(*slot);
    call* const asked = state_.calls.find(came.call);
    const bool is_call = came.what == entry::invocation;
    if (asked != nullptr) asked->callee = us;
    if (!is_call || asked != nullptr) {
      const status done = receiver_.deliver({.stamped_ns = rt::nanoseconds_of(came.stamped),
                                             .expires_ns = rt::nanoseconds_of(came.expires),
                                             .what = came.what,
                                             .peer = came.peer,
                                             .call = came.call},
                                            state_.threads_inbox.text(*slot));
      if (!done && is_call) call_completion_.fail({came.call.index}, {errc::refused}, "the inbox is full");
    }
    (void)state_.threads_inbox.release(*slot); // this thread need not be woken
  }
}

// ---- detach

// A handle is closed, and all that it submitted is taken. Only the service thread knows the pair now.
void handle_registry::detach(pair_index pair) noexcept {
  detail::queue_pair& queues = state_.pairs[pair];
  pair_row& row = state_.pair_rows[pair];
  call_requests_.forget_pair(pair); // from here on set-up owns its rings
  if (row.attached && !row.topic) {
    detach_talker(pair);
    count_refusals(queues);
    row = {.generation = row.generation};
  } else if (row.attached) {
    count_refusals(queues);
    topic_handles_.detach(pair);
  }
  queues.audience.set(detail::audience::nobody);
  all_slots_released(queues) ? queues.lifecycle.release(queues.arrival)
                             : queues.lifecycle.hold(queues.arrival);
}

void handle_registry::detach_talker(pair_index pair) noexcept {
  const pair_row& row = state_.pair_rows[pair];
  if (row.loop) return stop_service_.detach(pair);
  if (state_.pairs[pair].kind == detail::pair_kind::record) return topic_handles_.recorders().detach(pair);
  call_completion_.forget_pair(pair);
  receiver_.detach(pair);
  if (row.service) service_directory_.remove(row.service);
  if (connection* const c = state_.peers.server()) announce_service(*c, pair, false);
  --talking_;
}

// Adds the counts of the user's thread to the sums, which outlive the handle.
void handle_registry::count_refusals(const detail::queue_pair& queues) noexcept {
  state_.counts.add(counter::full, queues.refused_full.get());
  state_.counts.add(counter::no_peer, queues.no_peer.get());
  state_.counts.add(counter::too_big, queues.refused_too_big.get());
  state_.counts.add(counter::inbound_expired, queues.expired_here.get());
}

// ---- client

void handle_registry::announce_all(connection& c) noexcept {
  for (const pair_index i : state_.pairs.ids()) {
    if (!state_.pair_rows[i].attached) continue;
    state_.pair_rows[i].topic ? topic_handles_.announce(c, i, true) : announce_service(c, i, true);
  }
}

// A server learns which services this process provides.
void handle_registry::announce_service(connection& c, pair_index pair, bool begins) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  if (!detail::responds(queues.kind) || !c.protocol->can.topics) return;
  std::array<char, wire::announcement_bytes_max> buffer;
  json::writer text{buffer};
  const auto kind = c.protocol->topics.write_provision(
      text, {.name = queues.name(), .type = queues.type(), .begins = begins});
  outbox_.reply_written({c.id.index}, text, kind);
}

} // namespace rowe::service
