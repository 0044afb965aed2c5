// SPDX-License-Identifier: Apache-2.0
// Views of what has arrived, in a slot of the handle that took it.
#pragma once
#include <cstdint>
#include <string_view>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/json_value.hpp>

namespace rowe {

// A message, call or reply that arrived: a view of its text, which is valid JSON. Move-only. Its destructor
// releases the slot, so destroy it on the thread of its handle, and before the handle. Until then its slot is
// not free for what arrives. A view that outlives its handle keeps the handle's memory; if it also outlives
// the endpoint, it keeps all of the endpoint's memory as long as the process runs.
//
// Its text is read in place by get<T>("a.b[2]"), find(), as<T>(), members() and elements(): see
// rowe/json_value.hpp.
class message_view : public detail::reads_json<message_view> {
 public:
  ROWE_RT message_view(message_view&& from) noexcept
      : pair_{std::exchange(from.pair_, nullptr)}, end_{from.end_}, slot_{from.slot_} {}
  ROWE_RT message_view& operator=(message_view&& from) noexcept {
    std::swap(pair_, from.pair_);
    std::swap(end_, from.end_);
    std::swap(slot_, from.slot_);
    return *this;
  }
  ROWE_RT ~message_view() {
    if (pair_ != nullptr) detail::release_slot(*pair_, *end_, slot_);
  }

  // The text: one JSON value. A message, a call, or a reply to a lane is an object. Valid as long as this is;
  // 64 bytes behind it may be read.
  ROWE_RT std::string_view value() const noexcept {
    return {reinterpret_cast<const char*>(end_->memory.value(slot_)), header().bytes};
  }
  ROWE_RT std::string_view operator*() const noexcept { return value(); }
  // When its last byte was read from the socket.
  ROWE_RT time_point arrived() const noexcept { return time_point{duration{header().stamped_ns}}; }
  // From whom; no connection (false) if it came from this process itself, or on a topic of a hub, or is a
  // reply.
  ROWE_RT connection from() const noexcept { return {header().peer.index, header().peer.generation}; }
  // Whether it is a call: somebody waits for a reply (rowe::lane::reply).
  ROWE_RT bool wants_reply() const noexcept { return header().what == detail::entry::invocation; }

 private:
  friend class lane;
  template <class T>
  friend class subscriber;
  template <class Q, class A>
  friend class caller;
  message_view(detail::queue_pair& on, detail::consumer_end& end, std::uint32_t slot) noexcept
      : pair_{&on}, end_{&end}, slot_{slot} {}

  const detail::value_header& header() const noexcept { return *end_->memory.header(slot_); }

  detail::queue_pair* pair_;
  detail::consumer_end* end_; // of the queue pair: `in`, or `completions`
  std::uint32_t slot_;
};

// A struct that was decoded from a message of a topic. Move-only; as message_view. But with keep::newest
// there is no slot to release: value() is the newest value until the subscriber is called again, or is gone.
template <class T>
class value_view {
 public:
  ROWE_RT value_view(value_view&& from) noexcept
      : pair_{std::exchange(from.pair_, nullptr)}, slot_{from.slot_} {}
  ROWE_RT value_view& operator=(value_view&& from) noexcept {
    std::swap(pair_, from.pair_);
    std::swap(slot_, from.slot_);
    return *this;
  }
  ROWE_RT ~value_view() {
    if (pair_ != nullptr && (slot_ & of_window) == 0) pair_->user.in.free_ring->release(slot_);
  }

  // The struct. Valid as long as this is.
  ROWE_RT const T& value() const noexcept {
    return *reinterpret_cast<const T*>(pair_->user.in.memory.value(slot_ & ~of_window));
  }
  ROWE_RT const T& operator*() const noexcept { return value(); }
  ROWE_RT const T* operator->() const noexcept { return &value(); }
  // When its last byte was read from the socket, or when it was published in this process.
  ROWE_RT time_point arrived() const noexcept { return time_point{duration{header().stamped_ns}}; }
  // From whom; no connection (false) if this process published it.
  ROWE_RT connection from() const noexcept { return {header().peer.index, header().peer.generation}; }

 private:
  template <class U>
  friend class subscriber;
  // Marks a slot of a window, which is never released. The mark is in the view, because a view may outlive
  // its handle, and the pair may then belong to another one.
  static constexpr std::uint32_t of_window = std::uint32_t{1} << 31;
  value_view(detail::queue_pair& on, const detail::consumer_end&, std::uint32_t slot) noexcept
      : pair_{&on}, slot_{slot} {}

  const detail::value_header& header() const noexcept {
    return *pair_->user.in.memory.header(slot_ & ~of_window);
  }

  detail::queue_pair* pair_;
  std::uint32_t slot_;
};

} // namespace rowe
