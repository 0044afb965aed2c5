// SPDX-License-Identifier: Apache-2.0
// The calls in flight: the caller, the callee, the deadline. An entry is opened when a call is taken from a
// user or read from a peer. It is closed exactly once, by whatever the service thread sees first: the reply,
// a refusal, the deadline, or the loss of the callee. Whatever comes later finds another generation. Each
// peer has a share of the calls that peers make (shares.hpp).
//
// On the wire our calls have the id "NONCE.EPOCH.SLOT.GENERATION". The nonce is random, one for each
// endpoint, so a reply to an earlier run of the program matches no call. The epoch counts connections.
// Service thread only.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/indexed_pool.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/shares.hpp"
#include "service/base/slot_pool.hpp"
#include "service/base/transport.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

// One side of a call.
struct call_endpoint {
  enum class kind : std::uint8_t {
    nobody,
    pair,   // a handle of this process; index and generation are its queue pair's
    thread, // a thread of this process, or the receiver; index is the slot
    peer,   // a connection
    core,   // the endpoint itself
  };
  kind who = kind::nobody;
  wire::codec_id speaks{}; // peer
  std::uint32_t index = 0;
  std::uint32_t generation = 0;

  static call_endpoint of(connection_id id, wire::codec_id speaks) noexcept {
    return {kind::peer, speaks, id.index, id.generation};
  }
  static call_endpoint of(pair_index pair, std::uint32_t generation) noexcept {
    return {.who = kind::pair, .index = pair.value, .generation = generation};
  }
  bool is(connection_id id) const noexcept {
    return who == kind::peer && index == id.index && generation == id.generation;
  }
  connection_id connection() const noexcept { return {index, generation}; }
  pair_index pair() const noexcept { return {index}; }
};

struct call {
  std::uint32_t generation = 1;
  call_index next{}; // in the free list; of a peer's call: in its bucket
  bool open = false;
  std::int8_t goal_status = wire::call_origin::no_goal; // of an action's goal: what its provider said of it
  bool wants_feedback = false;
  bool cancelled = false;
  bool answered = false;  // by a long answer, which is on its way
  bool long_lost = false; // its long request or answer (long_calls)
  bool long_written = false;
  std::uint16_t id_bytes = 0;
  std::uint16_t service_bytes = 0;
  std::uint32_t goal_epoch = 0; // with which its provider got its id
  call_endpoint caller{};
  call_endpoint callee{};
  detail::call_ref own{}; // if the caller is a handle: the place in its own table
  rt::time_point deadline = rt::never;
  rt::duration timeout = rt::for_ever; // of a call of this process: as it was given
  slot_ref request{};                  // the request, until it is written; answered: the long answer
};

class call_table {
 public:
  static constexpr std::size_t our_id_bytes_max = our_call_id_bytes_max;

  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // `connections`: how many there may be; each has a claim.
  call_table(rt::arena& memory, const limits& bounds, std::uint32_t connections) noexcept;

  // Sets the nonce, before the first call.
  void begin(std::uint64_t nonce) noexcept { nonce_ = nonce; }

  // Whether a peer may make one more call.
  bool admits(peer_index by) const noexcept {
    const std::uint32_t free = static_cast<std::uint32_t>(calls_.size()) - in_flight();
    return open_calls_[by] < per_connection_max_ &&
           claims_.may_take(open_calls_[by], std::min(left_of(of_peers_max_, of_peers_), free));
  }
  // How many calls of a peer are not answered yet.
  std::uint32_t open_calls_of(peer_index by) const noexcept { return open_calls_[by]; }

  // Opens a call. None: all entries are in flight, or this process has all that it may have. `id_raw` and
  // `service` are copied; if one is too long, it becomes empty.
  call_index open(const call_endpoint& caller, std::string_view id_raw, std::string_view service) noexcept;
  void close(call_index index) noexcept;

  call& at(call_index index) noexcept { return calls_[index]; }
  const call& at(call_index index) const noexcept { return calls_[index]; }
  detail::call_ref ref(call_index index) const noexcept { return {index.value, calls_[index].generation}; }
  // Null when that call has ended.
  call* find(detail::call_ref ref) noexcept;
  // The call with this id that the peer waits for; none if there is none.
  call_index find_asked(connection_id by, std::string_view id_raw) const noexcept;
  std::string_view id_raw(call_index index) const noexcept { return {texts(index), calls_[index].id_bytes}; }
  std::string_view service(call_index index) const noexcept {
    return {texts(index) + call_id_bytes_max, calls_[index].service_bytes};
  }

  bool is_goal(call_index index) const noexcept {
    return calls_[index].goal_status != wire::call_origin::no_goal;
  }
  wire::call_origin origin(call_index index) const noexcept {
    return {.service = service(index), .id_raw = id_raw(index), .goal_status = calls_[index].goal_status};
  }

  // The id of a call of ours, without quotes.
  std::string_view write_id(std::span<char, our_id_bytes_max> into, call_index index,
                            std::uint32_t epoch) const noexcept;
  // The call that an id names. `id_raw` is as in the message. Nothing if it cannot be an id of ours.
  std::optional<detail::call_ref> read_id(std::string_view id_raw) const noexcept;

  // What became of the long request or answer of a call that was in this slot. Returns the call if it is over
  // now; none: it has ended already, or only its request was written.
  call_index note(detail::call_ref which, slot_id slot, bool written) noexcept;

  auto ids() const noexcept { return calls_.ids(); }
  std::uint32_t in_flight() const noexcept { return free_.in_use(); }
  bool check() const noexcept;

 private:
  char* texts(call_index index) const noexcept { return texts_.data() + index.value * text_stride_; }
  bool has_bucket(call_index index) const noexcept {
    return calls_[index].caller.who == call_endpoint::kind::peer && calls_[index].id_bytes != 0;
  }
  call_index& bucket(connection_id by, std::string_view id_raw) const noexcept;

  rows<call_index, call> calls_;
  indexed_pool<call_index, call, &call::next> free_;
  std::span<call_index> buckets_; // calls of peers, by peer and id
  std::span<char> texts_;
  std::size_t text_stride_;
  std::size_t service_bytes_max_;
  rows<peer_index, std::uint32_t> open_calls_; // how many, by peer
  const std::uint32_t per_connection_max_;
  const std::uint32_t of_peers_max_;
  const std::uint32_t of_process_max_; // a quarter is never given to it
  std::uint32_t of_peers_ = 0;
  claims claims_;
  std::uint64_t nonce_ = 0;
};

} // namespace rowe::service
