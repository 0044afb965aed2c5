// SPDX-License-Identifier: Apache-2.0
#include "service/handle_submissions.hpp"

#include <algorithm>
#include <string_view>

#include "service/service_limits.hpp"
#include "json/encoder.hpp"

namespace rowe::service {
namespace {

using detail::entry;

// The slot parked after this one. It uses the header's field for outcomes, which submissions do not need.
std::int64_t& next_parked(const detail::pair_slots& slots, pair_slot slot) noexcept {
  return slots.header(slot.value)->outcome_value;
}

} // namespace

handle_submissions::handle_submissions(const needs& parts) noexcept
    : state_{parts.state},
      sender_{parts.writer},
      delivery_{parts.delivery},
      inbox_{parts.inbox},
      messages_{parts.messages},
      broker_{parts.values},
      handles_{parts.handles},
      completion_{parts.completion},
      calls_{parts.calls},
      phases_{parts.phases} {}

void handle_submissions::take(pair_index pair) noexcept {
  detail::queue_pair& queues = state_.pairs[pair];
  if (detail::is_latch(queues.kind)) return;          // stop_service looks at it
  if (state_.options.pairs_tell) queues.epoch.mark(); // before looking
  if (!state_.views[pair].topic) return take_entries(pair);
  if (sender_.round_open()) return; // the sender comes first; scheduled peers call for the next cycle
  if (queues.service.out.newest != nullptr) {
    take_newest(pair);
  } else if (queues.service.out.out != nullptr) {
    take_values(pair);
  }
}

// ---- values

inline void handle_submissions::take_newest(pair_index pair) noexcept {
  const auto found = state_.pairs[pair].service.out.newest->begin_read();
  if (found.state != rt::freshness::fresh) return;
  pair_row& view = state_.views[pair];
  const std::uint64_t passed_over = found.sequence - view.sequence - 1;
  view.sequence = found.sequence;
  state_.topics.at(view.topic).messages += passed_over;
  state_.counts.add(counter::replaced, passed_over);
  publish(pair, found.slot);
}

// A server gets every value. A value that finds no room in the queue to it stays with the handle, and its
// publisher is told `full`.
inline void handle_submissions::take_values(pair_index pair) noexcept {
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  std::size_t budget = values_per_cycle;
  if (const queue* const towards =
          state_.options.ours == side::client ? handles_.queue_to_server(pair) : nullptr) {
    const std::uint32_t depth = state_.bounds().queue_depth_max;
    budget = std::min<std::size_t>(budget, depth - std::min(towards->count, depth));
  }
  const auto take = [&](std::uint32_t slot) {
    publish(pair, slot);
    end.free_ring->release(slot);
  };
  const std::size_t taken = end.out->drain(take, budget);
  if (taken == values_per_cycle) {
    const std::size_t ample = handles_.ample_budget(pair, values_per_cycle);
    more_left_ = end.out->drain(take, ample) == ample || more_left_;
  }
  if (budget < values_per_cycle && taken == budget && end.out->waiting_at_least() != 0) waits_ = true;
}

void handle_submissions::publish(pair_index pair, std::uint32_t slot) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const detail::value_header& header = *queues.service.out.slots.header(slot);
  const std::byte* const value = queues.service.out.slots.value(slot);
  const rt::time_point published = time_of(header.stamped_ns);
  const rt::time_point expires = state_.cycle.expiry_of(published, time_of(header.expires_ns));
  const topic_id topic = state_.views[pair].topic;
  const latch_owner latches =
      queues.latched ? latch_owner{latch_owner::kind::handle, pair.value} : latch_owner{};
  phases_.saw(pair, published);
  if (queues.kind == detail::pair_kind::publish_value) {
    return broker_.publish(topic, published, expires, latches,
                           [&](json::writer& into) { queues.encoder->encode(value, into); });
  }
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  if (!state_.seams.validator.validate(text) || !json::is_object(text))
    return state_.counts.add(counter::malformed);
  broker_.publish(topic, published, expires, latches, [&](json::writer& into) { into.raw(text); });
}

// ---- messages, requests, replies

void handle_submissions::take_entries(pair_index pair) noexcept {
  pair_row& view = state_.views[pair];
  const bool receives = inbox_.pair() == pair;
  if (receives) inbox_.mark_released();
  messages_.parking().begin_turn(state_.pairs[pair].user.out.count, receives);
  if (view.parked_first) retry(pair);
  const std::size_t taken = take_new_entries(pair);
  if (receives) inbox_.count_released(taken);
  // The number of parked messages to everyone decides whether the handle may submit more of them.
  detail::queue_pair& queues = state_.pairs[pair];
  const detail::audience now =
      messages_.parking().refuses_to_everyone() ? detail::audience::crowded : detail::audience::somebody;
  if (queues.audience.advice() != now) {
    queues.audience.set(now);
    view.gave = true;
  }
  // acquire: pairs with the release in ask_room()
  some_ask_room_ = some_ask_room_ || queues.room_asked.load(std::memory_order_acquire) != 0;
}

inline std::size_t handle_submissions::take_new_entries(pair_index pair) noexcept {
  pair_row& view = state_.views[pair];
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  for (std::size_t left = entries_per_cycle; left > 0; --left) {
    const auto slot = end.out->try_pop();
    if (!slot) return entries_per_cycle - left;
    if (take_entry(pair, *slot, false)) {
      end.free_ring->release(*slot);
      view.gave = true;
      continue;
    }
    const pair_slot parked{*slot};
    next_parked(end.slots, parked) = pair_slot::none;
    if (!view.parked_first) {
      view.parked_first = parked;
    } else {
      next_parked(end.slots, view.parked_last) = parked.value;
    }
    view.parked_last = parked;
  }
  more_left_ = true;
  return entries_per_cycle;
}

// Tries the parked slots in their order.
void handle_submissions::retry(pair_index pair) noexcept {
  pair_row& view = state_.views[pair];
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  pair_slot before{};
  for (pair_slot slot = view.parked_first; slot;) {
    const pair_slot next{static_cast<std::uint32_t>(next_parked(end.slots, slot))};
    if (take_entry(pair, slot.value, true)) {
      end.free_ring->release(slot.value);
      view.gave = true;
      ++state_.cycle.places_freed;
      if (!before) {
        view.parked_first = next;
      } else {
        next_parked(end.slots, before) = next.value;
      }
    } else {
      before = slot;
    }
    slot = next;
  }
  view.parked_last = before;
}

// False: it must be parked.
inline bool handle_submissions::take_entry(pair_index pair, std::uint32_t slot, bool parked) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const detail::value_header& header = *queues.service.out.slots.header(slot);
  const std::byte* const value = queues.service.out.slots.value(slot);
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  const call_endpoint us = call_endpoint::of(pair, state_.views[pair].generation);
  const call_endpoint waits = header.own.generation != 0 ? us : call_endpoint{};
  switch (header.what) {
  case entry::message:
    return messages_.post({.text = text,
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
    calls_.start({.caller = us,
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
  case entry::end: break; // only sent to handles
  }
  return true;
}

void handle_submissions::answer(pair_index pair, std::uint32_t slot, const call_endpoint& us,
                                const call_endpoint& waits) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const detail::value_header& header = *queues.service.out.slots.header(slot);
  const std::byte* const value = queues.service.out.slots.value(slot);
  const std::string_view text{reinterpret_cast<const char*>(value), header.bytes};
  const rt::time_point stamped = time_of(header.stamped_ns);
  phases_.answered(stamped);
  const status done =
      header.what == entry::refusal
          ? completion_.refuse(us, header.call, text)
          : completion_.answer(us, header.call,
                               {.text = text,
                                .encoder = queues.encoder,
                                .value = value,
                                .expires = state_.cycle.expiry_of(stamped, time_of(header.expires_ns)),
                                .waits = waits,
                                .own = header.own});
  if (!done) delivery_.complete(waits, header.own, done);
}

// ---- what is left

bool handle_submissions::has_unsent(pair_index pair) noexcept {
  pair_row& view = state_.views[pair];
  const detail::queue_pair& queues = state_.pairs[pair];
  if (!view.attached || detail::subscribes(queues.kind)) return false;
  if (view.parked_first) return true;
  if (queues.service.out.out != nullptr && queues.service.out.out->waiting_at_least() != 0) return true;
  const queue* const towards = detail::publishes(queues.kind) ? handles_.queue_to_server(pair) : nullptr;
  if (towards == nullptr) return false;
  if (view.last_queued == 0) view.last_queued = towards->popped + towards->count;
  return towards->popped < view.last_queued;
}

bool handle_submissions::drained() const noexcept {
  for (const pair_index i : state_.pairs.ids()) {
    if (!state_.views[i].attached) continue;
    const detail::queue_pair& queues = state_.pairs[i];
    if (detail::subscribes(queues.kind)) continue;
    if (state_.views[i].parked_first) return false;
    if (queues.service.out.out != nullptr && queues.service.out.out->waiting_at_least() != 0) return false;
  }
  return true;
}

void handle_submissions::tell_those_who_ask(bool anywhere) noexcept {
  for (const pair_index i : state_.pairs.ids()) {
    pair_row& view = state_.views[i];
    if (!view.attached || state_.pairs[i].kind != detail::pair_kind::talk) continue;
    // acquire: pairs with the release in ask_room()
    const std::uint32_t asked = state_.pairs[i].room_asked.load(std::memory_order_acquire);
    const bool look = asked != view.room_asked || view.gave || anywhere;
    view.room_asked = asked;
    view.gave = false;
    if (asked != 0 && look) state_.pairs[i].news.notify();
  }
}

} // namespace rowe::service
