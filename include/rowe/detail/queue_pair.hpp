// SPDX-License-Identifier: Apache-2.0
// The queue pair of one handle: what its user thread shares with the service thread. `out` goes to the
// service thread, `in` comes from it, and `completions` has the completions of calls and of sends that wait.
// It lies in the endpoint's memory. pair_lifecycle.hpp says how it changes hands. While it is active the two
// threads share only its rings, its window and the few words named here. Slots are passed as numbers: the
// producer of a queue takes a free slot out of the free ring, fills it, and pushes its number. The consumer
// releases the number through the free ring.
//
// This header is part of the interface only because the calls of a loop are inline; use publisher,
// subscriber, caller, responder and rowe::lane.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/detail/command_turn.hpp>
#include <rowe/detail/loop_timing.hpp>
#include <rowe/detail/pair_lifecycle.hpp>
#include <rowe/detail/stop_permit.hpp>
#include <rowe/options.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/waker.hpp>
#include <rowe/rt/window.hpp>

namespace rowe {
struct schema_description;
} // namespace rowe

namespace rowe::service {
class record_sink;
} // namespace rowe::service

namespace rowe::json {
class encoder;
struct other_encoders;
class decoder;
} // namespace rowe::json

namespace rowe::detail {

enum class pair_kind : std::uint8_t {
  publish_value,   // out: values
  publish_text,    // out: texts
  subscribe_value, // in: values
  subscribe_text,  // in: texts
  talk,            // out: messages, invocations, replies; in: messages and calls; completions
  respond_value,   // in: calls; out: replies
  respond_text,
  call_value, // out: calls; completions: replies
  call_text,
  stop_latch, // no queue: the permit and the latch's words
  listen,     // no queue: a subscription of who records (a client)
  record,     // no queue: who records
};
constexpr bool publishes(pair_kind k) noexcept {
  return k == pair_kind::publish_value || k == pair_kind::publish_text;
}
constexpr bool subscribes(pair_kind k) noexcept {
  return k == pair_kind::subscribe_value || k == pair_kind::subscribe_text || k == pair_kind::listen;
}
constexpr bool responds(pair_kind k) noexcept {
  return k == pair_kind::respond_value || k == pair_kind::respond_text;
}
constexpr bool is_latch(pair_kind k) noexcept { return k == pair_kind::stop_latch; }
constexpr bool has_queue(pair_kind k) noexcept { return k < pair_kind::stop_latch; }
constexpr bool calls(pair_kind k) noexcept { return k == pair_kind::call_value || k == pair_kind::call_text; }

// A connection, by its place and the generation of that place. Generation 0: none; as an address: everyone.
struct peer_ref {
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
  friend bool operator==(const peer_ref&, const peer_ref&) = default;
};

// A call, by its row in the table of the side that completes it. Generation 0: none.
struct call_ref {
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
  friend bool operator==(const call_ref&, const call_ref&) = default;
};

// What a slot holds. A queue pair's own calls (`own`) are rows of its table (pending_call). The service
// thread's (`call`) are rows of its own.
enum class entry : std::uint8_t {
  message,    // out: to `peer`, or to everyone; with `own`, completed when it was written
  invocation, // out: of the queue pair's `own`; in: the service thread's `call`, to be named in the answer
  reply,      // out: to the service thread's `call`; with `own`, completed when it was written
  refusal,    // out: likewise, with a diagnostic instead of a reply
  completion, // completions: of the queue pair's `own`: a reply (none where a message was sent), or an error
};

// The header in front of every value in a slot. The value behind it is aligned to value_alignment.
struct value_header {
  std::int64_t stamped_ns = 0; // when it was published, or arrived
  std::int64_t expires_ns = 0; // as stamped_ns: only in the cycle that takes it
  std::uint32_t bytes = 0;
  entry what = entry::message;
  bool failed = false; // completion: `outcome` is an error, and the text its diagnostic
  errc outcome = errc::misuse;
  peer_ref peer{}; // out: to whom; in: from whom
  call_ref call{};
  call_ref own{};
  std::int64_t outcome_value = 0; // completion: the error's; out: the service thread's own; of a command: its
                                  // turn (command_turn.hpp)
  std::int64_t outcome_limit = 0;
};
inline constexpr std::size_t value_alignment = 64;
inline constexpr std::size_t value_offset = 64;
static_assert(sizeof(value_header) <= value_offset);

// Slots of one stride.
struct pair_slots {
  std::byte* base = nullptr;
  std::size_t stride = 0;
  std::size_t bytes_max = 0; // of a value

  ROWE_RT value_header* header(std::uint32_t slot) const noexcept {
    return reinterpret_cast<value_header*>(base + slot * stride);
  }
  ROWE_RT std::byte* value(std::uint32_t slot) const noexcept { return base + slot * stride + value_offset; }
};

using number_ring = rt::spsc_ring<std::uint32_t>;
using number_free_ring = rt::free_ring<>;
using newest_window = rt::window_core<>;

// The producer's side of a queue.
struct producer_end {
  number_ring::producer* ring = nullptr;           // keep::all
  number_free_ring::consumer* free_ring = nullptr; // keep::all
  newest_window::writer* newest = nullptr;         // keep::newest
  pair_slots memory;
  std::uint32_t count = 0; // of slots
};

// The consumer's side.
struct consumer_end {
  number_ring::consumer* ring = nullptr;
  number_free_ring::producer* free_ring = nullptr;
  newest_window::reader* newest = nullptr;
  pair_slots memory;
};

// The calls of a handle that were begun and whose completion was not taken. User thread only. There is one
// row for each slot of `completions`, so the service thread can always deliver a completion.
struct pending_call {
  std::uint32_t generation = 0; // raised when a call begins; odd while one is open
  std::uint32_t next_free = 0;
  bool cancelled = false; // its completion is to be dropped
};

// Slot numbers that the user thread has parked, in a ring that only this thread uses.
struct parked_slots {
  std::span<std::uint32_t> places; // as many as there are slots
  std::uint32_t first = 0;
  std::uint32_t count = 0;

  ROWE_RT void push(std::uint32_t slot) noexcept {
    places[(first + count++) % static_cast<std::uint32_t>(places.size())] = slot;
  }
  ROWE_RT std::uint32_t pop() noexcept {
    const std::uint32_t slot = places[first];
    first = (first + 1) % static_cast<std::uint32_t>(places.size());
    --count;
    return slot;
  }
};

struct queue_pair {
  static constexpr std::size_t name_bytes_max = 255;

  alignas(rt::line_bytes) pair_lifecycle<> lifecycle;

  // Not 0 while the handle's thread sleeps until there is room; each wait uses another number. It shares this
  // cache line because the service thread reads the line anyway.
  rt::std_atomics::variable<std::uint32_t> room_asked{0};

  // Set-up writes these before it stores `offered`. They are constant while the queue pair is not free.
  alignas(rt::line_bytes) pair_kind kind = pair_kind::publish_value;
  rowe::keep keep = rowe::keep::all;
  rowe::priority priority = rowe::priority::normal;
  bool latched = false;
  bool shared = false; // what is published: peers may publish on the topic, too
  std::uint8_t name_bytes = 0;
  std::uint8_t type_bytes = 0;
  std::array<char, name_bytes_max> name_text{};
  std::array<char, name_bytes_max> type_text{};
  const schema_description* encoded = nullptr;          // of the values that go out; null: text
  const schema_description* decoded = nullptr;          // of those that come in
  const json::encoder* encoder = nullptr;               // of the values that go out
  const json::other_encoders* other_encoders = nullptr; // likewise, of what is published
  const json::decoder* decoder = nullptr; // of the values that come in: subscribed, requests, replies
  duration ttl = rt::for_ever;            // of what is published
  duration period{};                      // likewise; 0: not known
  duration lease{};                       // of commands, which are what it subscribes to; 0: they are none
  duration throttle{};                    // of what it subscribes to at a server; 0: there is none
  rt::waker<>* waker = nullptr; // woken for whatever is pushed to `out`; null except under idle::wake
  bool receives = false;        // talk: it may be the generic receiver
  // The generations of the endpoint's connections (shared_state): a peer that is gone has another one.
  std::span<const rt::std_atomics::variable<std::uint32_t>> peer_generations;
  // The same for peers that accept messages; 0 for a peer whose share of parked messages is used up.
  std::span<const rt::std_atomics::variable<std::uint32_t>> peers_taking;
  const permit_word<>* granted = nullptr; // stop_latch
  duration loop_timeout = rt::for_ever;   // stop_latch: the longest pause between two looks
  loop_timing* timing = nullptr;          // stop_latch: in `memory`; else null
  service::record_sink* sink = nullptr;   // record
  std::span<std::byte> memory;            // of the rings and slots; stays with the queue pair when it is free
  errc closed_as = errc::closed; // what calls fail with then; a child of the endpoint's process: forked

  // The handle's side.
  struct user_side {
    producer_end out;
    consumer_end in;
    consumer_end completions;
    std::span<pending_call> calls;
    std::uint32_t free_call = 0; // the list's head; calls.size(): none
    std::uint32_t calls_open = 0;
    parked_slots parked_completions; // that arrived while the handle waited for another one
    parked_slots spare_replies;      // respond: out slots that were reserved and not needed
    latch_memory latch;
    std::uint32_t room_waits = 0; // how often it has waited for room
  };
  alignas(rt::line_bytes) user_side user;
  rt::counter published;       // values accepted
  rt::counter refused_full;    // errc::full
  rt::counter refused_too_big; // errc::too_big
  rt::counter no_peer;         // errc::no_peer
  rt::counter expired_here;    // arrived, and out of date when the handle came to take them
  latch_words<> latch;         // stop_latch

  rt::producer_epoch<> epoch; // between both; of idle::wake

  // The service thread's side.
  alignas(rt::line_bytes) audience_word<> audience;
  command_turn<> turn; // with a lease
  struct service_side {
    consumer_end out;
    producer_end in;
    producer_end completions;
  };
  alignas(rt::line_bytes) service_side service;

  // Notified by the service thread: the queue pair was answered, or something arrived.
  rt::notification<> arrival;

  std::string_view name() const noexcept { return {name_text.data(), name_bytes}; }
  std::string_view type() const noexcept { return {type_text.data(), type_bytes}; }
};

// Everything behind an endpoint: its memory, its service thread, its transport.
class endpoint_state;
// Closes a queue pair. Not real-time: it wakes the service thread.
void close_pair(endpoint_state& of, queue_pair& gone) noexcept;
// Makes the service thread look at its queue pairs now, and not only within a poll_period. Not real-time.
void wake_service(endpoint_state& of) noexcept;

// Owns a queue pair and keeps the endpoint's memory alive, so that a handle may outlive its endpoint: its
// calls then say errc::closed. Move-only; made and destroyed outside of the loop.
class pair_handle {
 public:
  pair_handle() noexcept = default;
  pair_handle(std::shared_ptr<endpoint_state> of, queue_pair& owned) noexcept
      : state_{std::move(of)}, pair_{&owned} {}
  pair_handle(pair_handle&& from) noexcept
      : state_{std::move(from.state_)}, pair_{std::exchange(from.pair_, nullptr)} {}
  pair_handle& operator=(pair_handle&& from) noexcept {
    if (this != &from) {
      reset();
      state_ = std::move(from.state_);
      pair_ = std::exchange(from.pair_, nullptr);
    }
    return *this;
  }
  ~pair_handle() { reset(); }

  ROWE_RT explicit operator bool() const noexcept { return pair_ != nullptr; }
  ROWE_RT queue_pair* operator->() const noexcept { return pair_; }
  ROWE_RT queue_pair& operator*() const noexcept { return *pair_; }

  // For calls that wait for the service thread anyway. Not real-time.
  void wake_service() const noexcept {
    if (state_) detail::wake_service(*state_);
  }

 private:
  void reset() noexcept {
    if (state_) close_pair(*state_, *pair_); // without a state, in a test, the harness owns the pair
    pair_ = nullptr;
    state_.reset();
  }

  std::shared_ptr<endpoint_state> state_;
  queue_pair* pair_ = nullptr;
};

// Called when something was pushed to `out`. Wakes the service thread under idle::wake; under other policies
// it polls, and this costs one comparison.
[[gnu::noinline, gnu::cold]] inline void wake_for(queue_pair& on) noexcept { on.waker->wake(on.epoch); }
inline void announce(queue_pair& on) noexcept {
  if (on.waker != nullptr) [[unlikely]]
    wake_for(on);
}

// Publishes `bytes` of one value, written into its slot by `fill(std::byte*)`. All publishers share it.
template <class Fill>
ROWE_RT status publish_into(queue_pair& on, std::size_t bytes, time_point now, Fill&& fill) noexcept {
  switch (on.audience.advice()) {
  case audience::nobody: on.no_peer.add(); return errc::no_peer;
  case audience::closed: return on.closed_as;
  case audience::crowded:
  case audience::somebody: break;
  }
  const producer_end& end = on.user.out;
  if (bytes > end.memory.bytes_max) {
    on.refused_too_big.add();
    return error{errc::too_big, static_cast<std::int64_t>(bytes),
                 static_cast<std::int64_t>(end.memory.bytes_max)};
  }
  std::uint32_t slot;
  if (end.newest != nullptr) {
    slot = end.newest->begin_write();
  } else if (const auto free = end.free_ring->try_take()) {
    slot = *free;
  } else {
    on.refused_full.add();
    return error{errc::full, 0, end.count};
  }
  *end.memory.header(slot) = {rt::nanoseconds_of(now), rt::nanoseconds_of(rt::deadline_after(now, on.ttl)),
                              static_cast<std::uint32_t>(bytes)};
  fill(end.memory.value(slot));
  on.published.add();
  if (end.newest != nullptr) {
    end.newest->end_write(slot);
  } else if (!end.ring->try_push(slot)) {
    return errc::misuse; // the ring has places for all slots twice: only a second thread in this handle
                         // leads here
  }
  announce(on);
  return {};
}

} // namespace rowe::detail
