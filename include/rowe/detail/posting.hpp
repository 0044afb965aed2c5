// SPDX-License-Identifier: Apache-2.0
// How a handle's thread hands messages, calls and answers to the service thread: a slot of the queue pair's
// `out`, with a header in front of the bytes. All handles but publishers post; a publisher's values go by
// publish_into() of queue_pair.hpp, which keeps the newest only where that is asked for.
//
// What is refused is refused here, on the handle's thread: what does not fit into a slot, what finds no free
// slot, and what is for a connection that is gone or has its share of the parked messages. What this thread
// knows of connections is advice. It may be out of date, so the service thread checks it again.
//
// All of it is for the handle's one thread. No function waits, allocates or enters the kernel, but for the
// wake-up under idle::wake, and each takes a bounded number of steps. The exercises of the handles that are
// made of these show it (tests/rt_contract).
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include <rowe/connection.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/message.hpp>

namespace rowe::detail {

// ---- who takes messages

inline bool closed(const queue_pair& on) noexcept { return on.audience.closed(); }

constexpr peer_ref ref_of(connection c) noexcept { return {c.index, c.generation}; }

// Whether a connection has ended since it was named. No connection never does.
inline bool gone(const queue_pair& on, peer_ref whom) noexcept {
  if (whom.generation == 0) return false;
  if (whom.index >= on.peer_generations.size()) return true; // of another endpoint
  // relaxed: pairs with the stores in shared_state::set_connection(); advice, which the service thread checks
  // again
  return on.peer_generations[whom.index].load(std::memory_order_relaxed) != whom.generation;
}

// Whether messages to a connection are taken. No connection means everyone: see crowded().
inline bool takes(const queue_pair& on, peer_ref whom) noexcept {
  if (whom.generation == 0) return true;
  if (whom.index >= on.peers_taking.size()) return false; // of another endpoint
  // relaxed: pairs with the stores in shared_state::set_taking(); advice, which the service thread checks
  // again
  return on.peers_taking[whom.index].load(std::memory_order_relaxed) == whom.generation;
}

// Whether a message to everyone is refused. Such messages get half of the slots that the lane may park.
inline bool crowded(const queue_pair& on) noexcept { return on.audience.advice() == audience::crowded; }

// ---- headers

// When a message with this time to live expires. 0 means in the cycle that takes it, negative means never.
constexpr time_point expiry_after(time_point now, duration ttl) noexcept {
  return rt::deadline_after(now, ttl);
}

inline bool expired_at(const value_header& what, time_point now) noexcept {
  return what.expires_ns <= rt::nanoseconds_of(now);
}

// The header of a message to `to`, which is dropped if it was not written before `expires`.
constexpr value_header message_header(entry what, peer_ref to, time_point now, time_point expires) noexcept {
  value_header made;
  made.stamped_ns = rt::nanoseconds_of(now);
  made.expires_ns = rt::nanoseconds_of(expires);
  made.peer = to;
  made.what = what;
  return made;
}

// ---- errors

// Whether so many bytes fit into a slot of `out`. Errors: too_big, counted.
inline status check_fits(queue_pair& on, std::size_t bytes) noexcept {
  const std::size_t bytes_max = on.user.out.memory.bytes_max;
  if (bytes <= bytes_max) return {};
  on.refused_too_big.add();
  return error{errc::too_big, static_cast<std::int64_t>(bytes), static_cast<std::int64_t>(bytes_max)};
}
// The error of a message that needed more than its own `capacity`; counted.
inline error outgrew(queue_pair& on, std::size_t capacity) noexcept {
  on.refused_too_big.add();
  const auto limit = static_cast<std::int64_t>(capacity);
  return {errc::too_big, limit + 1, limit}; // at least one more
}
inline status check_fits(queue_pair& on, const body& text) noexcept {
  if (text.outgrown() == 0) return check_fits(on, text.text().size());
  return outgrew(on, text.outgrown());
}

// Adds the depth to the error, if it is `full`.
inline error with_depth(const queue_pair& on, errc why) noexcept {
  return why == errc::full ? error{why, 0, on.user.out.count} : error{why};
}

// Why a message to this connection is not taken. Errors: closed, peer_lost; full, counted.
[[gnu::noinline, gnu::cold]] inline errc turned_away(queue_pair& on, peer_ref whom) noexcept {
  if (closed(on)) return on.closed_as;
  if (gone(on, whom)) return errc::peer_lost;
  on.refused_full.add();
  return errc::full;
}

// ---- posting

// Fills a slot that was taken from `out`'s free ring, and pushes it. The ring has places for all slots twice:
// so this returns false only if a second thread uses the handle.
inline bool post_slot(queue_pair& on, std::uint32_t slot, value_header header, const void* value,
                      std::size_t bytes) noexcept {
  const producer_end& end = on.user.out;
  header.bytes = static_cast<std::uint32_t>(bytes);
  *end.memory.header(slot) = header;
  if (bytes != 0) std::memcpy(end.memory.value(slot), value, bytes);
  on.published.add();
  if (!end.ring->try_push(slot)) return false;
  announce(on);
  return true;
}

// As post(), for a pair that is known to be open. Always inlined: it has two callers, and a call would cost
// each loop instructions.
[[gnu::always_inline]] inline status post_open(queue_pair& on, const value_header& header, const void* value,
                                               std::size_t bytes) noexcept {
  if (const status fits = check_fits(on, bytes); !fits) return fits;
  const auto slot = on.user.out.free_ring->try_take();
  if (!slot) {
    on.refused_full.add();
    return error{errc::full, 0, on.user.out.count};
  }
  if (!post_slot(on, *slot, header, value, bytes)) return errc::misuse;
  return {};
}

// Hands `bytes` at `value` to the service thread. Errors: closed, too_big, full, misuse; full and too_big are
// counted.
inline status post(queue_pair& on, const value_header& header, const void* value,
                   std::size_t bytes) noexcept {
  if (closed(on)) return on.closed_as;
  return post_open(on, header, value, bytes);
}

inline status post(queue_pair& on, const value_header& header, const body& text) noexcept {
  if (const status fits = check_fits(on, text); !fits) return fits;
  return post(on, header, text.text().data(), text.text().size());
}

// The slow path of post_to(). Returns `empty` if the message was posted. Arguments are passed by value; a
// header passed by reference would be spilled to memory for each message.
[[gnu::noinline, gnu::cold]] inline errc post_barred(queue_pair& on, peer_ref to, std::string_view text,
                                                     std::int64_t stamped_ns,
                                                     std::int64_t expires_ns) noexcept {
  if (crowded(on) && to.generation == 0) {
    on.refused_full.add();
    return errc::full;
  }
  value_header header;
  header.stamped_ns = stamped_ns;
  header.expires_ns = expires_ns;
  header.peer = to;
  const status done = post(on, header, text.data(), text.size());
  return done ? errc::empty : done.code();
}

// Posts a message, unless `to` is known to be gone, or has its share of the parked messages already. Errors:
// peer_lost, full, and those of post().
inline status post_to(queue_pair& on, connection to, const body& text, const value_header& header) noexcept {
  if (!takes(on, ref_of(to))) [[unlikely]]
    return with_depth(on, turned_away(on, ref_of(to)));
  if (const status fits = check_fits(on, text); !fits) return fits;
  if (on.audience.look() != audience::somebody) [[unlikely]] {
    const errc done = post_barred(on, ref_of(to), text.text(), header.stamped_ns, header.expires_ns);
    return done == errc::empty ? status{} : status{with_depth(on, done)};
  }
  return post_open(on, header, text.text().data(), text.text().size());
}

} // namespace rowe::detail
