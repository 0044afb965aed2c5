// SPDX-License-Identifier: Apache-2.0
// The calls that are in flight: who asked, who is to answer, until when. An entry is opened when a call is
// taken or read, and closed exactly once, by whichever the service thread sees first: the reply, a refusal,
// the deadline, or the loss of the one who was to answer. What comes later finds another generation.
//
// On the wire a call of ours has the id "NONCE.EPOCH.SLOT.GENERATION": the nonce is drawn once for each
// endpoint, so that a reply meant for a program that ran before is no reply; the epoch counts connections.
// Service thread only.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/detail/lane.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/indexed_pool.hpp"
#include "service/transport.hpp"
#include "service/wire_slots.hpp"
#include "wire/request.hpp"

namespace rowe::service {

// One side of a call.
struct party {
  enum class kind : std::uint8_t {
    nobody,
    lane, // a handle of this process; index and generation are the lane's
    door, // a thread of this process, or whichever receives; index is the slot
    peer, // a connection
    core, // the endpoint itself
  };
  kind who = kind::nobody;
  wire::codec_id speaks{}; // peer
  std::uint32_t index = no_index;
  std::uint32_t generation = 0;

  static party of(connection_id id, wire::codec_id speaks) noexcept {
    return {kind::peer, speaks, id.index, id.generation};
  }
  bool is(connection_id id) const noexcept {
    return who == kind::peer && index == id.index && generation == id.generation;
  }
  connection_id connection() const noexcept { return {index, generation}; }
};

struct call {
  std::uint32_t generation = 1;
  call_index next{}; // free: in the pool; asked by a peer: in its bucket
  bool open = false;
  party asked_by{};
  party provider{};
  detail::call_ref own{}; // of a lane that asked: the place in its own table
  rt::time_point deadline = rt::never;
  rt::duration timeout = rt::for_ever; // of one that this process asks, as it was asked
  slot_ref request{};                  // the request, as long as it was not written
  std::uint16_t id_bytes = 0;
  std::uint16_t service_bytes = 0;
};

class call_table {
 public:
  static constexpr std::size_t id_bytes_max = 256; // of an id that a peer gave, as it stands there
  static constexpr std::size_t our_id_bytes_max = 64;

  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  call_table(rt::arena& memory, const limits& bounds) noexcept;

  // A nonce is drawn before the first call.
  void begin(std::uint64_t nonce) noexcept { nonce_ = nonce; }

  // no_index when all are in flight. `id_raw` and `service` are copied, cut to nothing when too long.
  std::uint32_t open(const party& asked_by, std::string_view id_raw, std::string_view service) noexcept;
  void close(std::uint32_t index) noexcept;

  call& at(std::uint32_t index) noexcept { return calls_[call_index{index}]; }
  const call& at(std::uint32_t index) const noexcept { return calls_[call_index{index}]; }
  detail::call_ref ref(std::uint32_t index) const noexcept {
    return {index, calls_[call_index{index}].generation};
  }
  // Null when that call has ended.
  call* find(detail::call_ref ref) noexcept;
  // The call with this id that the peer waits for; no_index when there is none.
  std::uint32_t find_asked(connection_id by, std::string_view id_raw) const noexcept;
  std::string_view id_raw(std::uint32_t index) const noexcept {
    return {texts(index), calls_[call_index{index}].id_bytes};
  }
  std::string_view service(std::uint32_t index) const noexcept {
    return {texts(index) + id_bytes_max, calls_[call_index{index}].service_bytes};
  }

  // The id of a call of ours, without quotes.
  std::string_view write_id(std::span<char, our_id_bytes_max> into, std::uint32_t index,
                            std::uint32_t epoch) const noexcept;
  // Which call an id, as it stands in a text, may mean; nothing when it cannot be one of ours.
  std::optional<detail::call_ref> read_id(std::string_view id_raw) const noexcept;

  std::uint32_t places() const noexcept { return calls_.size(); }
  std::uint32_t in_flight() const noexcept { return free_.in_use(); }
  bool check() const noexcept;

 private:
  char* texts(std::uint32_t index) const noexcept { return texts_.data() + index * text_stride_; }
  bool has_bucket(std::uint32_t index) const noexcept {
    return calls_[call_index{index}].asked_by.who == party::kind::peer &&
           calls_[call_index{index}].id_bytes != 0;
  }
  call_index& bucket(connection_id by, std::string_view id_raw) const noexcept;

  rows<call_index, call> calls_;
  indexed_pool<call_index, call, &call::next> free_;
  std::span<call_index> buckets_; // of those that peers asked, by peer and id
  std::span<char> texts_;
  std::size_t text_stride_;
  std::size_t service_bytes_max_;
  std::uint64_t nonce_ = 0;
};

} // namespace rowe::service
