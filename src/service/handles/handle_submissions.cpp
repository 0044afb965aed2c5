// SPDX-License-Identifier: Apache-2.0
#include "service/handles/handle_submissions.hpp"

#include <algorithm>
#include <string_view>

namespace rowe::service {
namespace {

using detail::entry;

// The slot parked after this one. It uses the header's field for outcomes, which submissions do not need.
std::int64_t& next_parked(const detail::pair_slots& slots, pair_slot slot) noexcept {
  return slots.header(slot.value)->outcome_value;
}

} // namespace

void handle_submissions::take(pair_index pair) noexcept {
  detail::queue_pair& queues = state_.pairs[pair];
  if (!detail::has_queue(queues.kind)) return;          // stop_service looks at latches
  if (state_.options.handles_wake) queues.epoch.mark(); // before looking
  if (!state_.pair_rows[pair].topic) return take_entries(pair);
  if (state_.pair_rows[pair].long_texts) [[unlikely]]
    return take_long(pair);
  if (sender_.round_open()) return; // the sender comes first; scheduled peers call for the next cycle
  if (queues.service.out.newest != nullptr) {
    take_newest(pair);
  } else if (queues.service.out.ring != nullptr) {
    take_values(pair);
  }
}

// ---- values

inline void handle_submissions::take_newest(pair_index pair) noexcept {
  const auto found = state_.pairs[pair].service.out.newest->begin_read();
  if (found.state != rt::freshness::fresh) return;
  value_publisher_.note_newest(pair, found.sequence);
  value_publisher_.publish(pair, pair_slot{found.slot});
}

// A server must get every value. A value that finds no room in the queue to the server stays with the handle,
// and when its slots run out the publisher gets `full`.
inline void handle_submissions::take_values(pair_index pair) noexcept {
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  const std::size_t budget = std::min<std::size_t>(values_per_cycle, topic_handles_.room_to_server(pair));
  const auto take = [&](std::uint32_t slot) {
    value_publisher_.publish(pair, pair_slot{slot});
    end.free_ring->release(slot);
  };
  const std::size_t taken = end.ring->drain(take, budget);
  if (taken == values_per_cycle) {
    const std::size_t ample = topic_handles_.ample_budget(pair, values_per_cycle);
    more_left_ = end.ring->drain(take, ample) == ample || more_left_;
  }
  if (budget < values_per_cycle && taken == budget && end.ring->pending_at_least() != 0) waits_ = true;
}

void handle_submissions::take_long(pair_index pair) noexcept {
  long_publications_.take(pair);
  if (long_publications_.has_begun(pair)) {
    more_left_ = true;
  } else if (state_.pairs[pair].service.out.newest == nullptr && has_new(pair)) {
    (topic_handles_.room_to_server(pair) != 0 ? more_left_ : waits_) = true;
  }
}

// ---- messages, requests, replies

void handle_submissions::take_entries(pair_index pair) noexcept {
  pair_row& row = state_.pair_rows[pair];
  const bool receives = receiver_.pair() == pair;
  if (receives) receiver_.mark_released();
  direct_messages_.parking().begin_turn(state_.pairs[pair].user.out.count, receives);
  if (row.parked_first) retry(pair);
  const std::size_t taken = take_new_entries(pair);
  if (receives) receiver_.count_released(taken);
  // The number of parked messages to everyone decides whether the handle may submit more of them.
  detail::queue_pair& queues = state_.pairs[pair];
  const detail::audience now = direct_messages_.parking().refuses_to_everyone() ? detail::audience::crowded
                                                                                : detail::audience::somebody;
  if (queues.audience.advice() != now) {
    queues.audience.set(now);
    row.released_slots = true;
  }
  // acquire: pairs with the release in wait_room()
  some_ask_room_ = some_ask_room_ || queues.room_asked.load(std::memory_order_acquire) != 0;
}

inline std::size_t handle_submissions::take_new_entries(pair_index pair) noexcept {
  pair_row& row = state_.pair_rows[pair];
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  for (std::size_t left = entries_per_cycle; left > 0; --left) {
    const auto popped = end.ring->try_pop();
    if (!popped) return entries_per_cycle - left;
    const pair_slot slot{*popped};
    if (take_entry(pair, slot, false)) {
      end.free_ring->release(slot.value);
      row.released_slots = true;
      continue;
    }
    next_parked(end.memory, slot) = pair_slot::none;
    if (!row.parked_first) {
      row.parked_first = slot;
    } else {
      next_parked(end.memory, row.parked_last) = slot.value;
    }
    row.parked_last = slot;
  }
  more_left_ = true;
  return entries_per_cycle;
}

// Tries the parked slots in their order.
void handle_submissions::retry(pair_index pair) noexcept {
  pair_row& row = state_.pair_rows[pair];
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  pair_slot before{};
  for (pair_slot slot = row.parked_first; slot;) {
    const pair_slot next{static_cast<std::uint32_t>(next_parked(end.memory, slot))};
    if (take_entry(pair, slot, true)) {
      end.free_ring->release(slot.value);
      row.released_slots = true;
      ++state_.cycle.places_freed;
      if (!before) {
        row.parked_first = next;
      } else {
        next_parked(end.memory, before) = next.value;
      }
    } else {
      before = slot;
    }
    slot = next;
  }
  row.parked_last = before;
}

// False: it must be parked.
inline bool handle_submissions::take_entry(pair_index pair, pair_slot slot, bool parked) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const detail::value_header& header = *queues.service.out.memory.header(slot.value);
  const std::byte* const value = queues.service.out.memory.value(slot.value);
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  const call_endpoint us = call_endpoint::of(pair, state_.pair_rows[pair].generation);
  const call_endpoint waits = header.own.generation != 0 ? us : call_endpoint{};
  switch (header.what) {
  case entry::message:
    return direct_messages_.post({.text = text,
                                  .sender = waits,
                                  .own = header.own,
                                  .to = header.peer,
                                  .only_now = header.expires_ns == header.stamped_ns,
                                  .parked = parked,
                                  .expires = time_of(header.expires_ns),
                                  .priority = queues.priority});
  case entry::invocation: {
    wire::call_args what{.is = wire::call_args::form::object, .text = text};
    if (queues.kind == detail::pair_kind::call_text) what.is = wire::call_args::form::args;
    if (queues.kind == detail::pair_kind::call_value)
      what = {.is = wire::call_args::form::value, .encoder = queues.encoder, .value = value};
    call_router_.start({.caller = us,
                        .own = header.own,
                        .service = queues.name(),
                        .what = what,
                        .to = header.peer,
                        .began = time_of(header.stamped_ns),
                        .deadline = time_of(header.expires_ns)});
    return true;
  }
  case entry::reply:
  case entry::refusal: answer(pair, slot, us, waits); return true;
  case entry::completion: break; // only sent to handles
  }
  return true;
}

void handle_submissions::answer(pair_index pair, pair_slot slot, const call_endpoint& us,
                                const call_endpoint& waits) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const detail::value_header& header = *queues.service.out.memory.header(slot.value);
  const std::byte* const value = queues.service.out.memory.value(slot.value);
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  const rt::time_point stamped = time_of(header.stamped_ns);
  publish_predictor_.answered(stamped);
  const status done =
      header.what == entry::refusal
          ? call_completion_.refuse(us, header.call, text)
          : call_completion_.answer(us, header.call,
                                    {.text = text,
                                     .encoder = queues.encoder,
                                     .value = value,
                                     .expires = state_.cycle.expiry_of(stamped, time_of(header.expires_ns)),
                                     .waits = waits,
                                     .own = header.own});
  if (!done) local_delivery_.complete(waits, header.own, done);
}

// ---- unsent submissions

bool handle_submissions::has_unsent(pair_index pair) noexcept {
  pair_row& row = state_.pair_rows[pair];
  const detail::queue_pair& queues = state_.pairs[pair];
  if (!row.attached || detail::subscribes(queues.kind)) return false;
  if (row.parked_first || long_publications_.has_begun(pair)) return true;
  if (queues.service.out.ring != nullptr && queues.service.out.ring->pending_at_least() != 0) return true;
  const queue* const towards =
      detail::publishes(queues.kind) ? topic_handles_.queue_to_server(pair) : nullptr;
  if (towards == nullptr) return false;
  if (row.last_queued == 0) row.last_queued = towards->popped + towards->count;
  return towards->popped < row.last_queued;
}

bool handle_submissions::drained() const noexcept {
  if (long_publications_.any()) return false;
  for (const pair_index i : state_.pairs.ids()) {
    if (!state_.pair_rows[i].attached) continue;
    const detail::queue_pair& queues = state_.pairs[i];
    if (detail::subscribes(queues.kind)) continue;
    if (state_.pair_rows[i].parked_first) return false;
    if (queues.service.out.ring != nullptr && queues.service.out.ring->pending_at_least() != 0) return false;
  }
  return true;
}

void handle_submissions::notify_those_who_wait(bool anywhere) noexcept {
  for (const pair_index i : state_.pairs.ids()) {
    pair_row& row = state_.pair_rows[i];
    if (!row.attached || state_.pairs[i].kind != detail::pair_kind::talk) continue;
    // acquire: pairs with the release in wait_room()
    const std::uint32_t asked = state_.pairs[i].room_asked.load(std::memory_order_acquire);
    const bool look = asked != row.room_asked || row.released_slots || anywhere;
    row.room_asked = asked;
    row.released_slots = false;
    if (asked != 0 && look) state_.pairs[i].arrival.notify();
  }
}

} // namespace rowe::service
