// SPDX-License-Identifier: Apache-2.0
// What has arrived, looked at where it lies: in a slot of the handle that took it.
#pragma once
#include <cstdint>
#include <string_view>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/calls.hpp>
#include <rowe/detail/lane.hpp>

namespace rowe {

// A message, call or reply that arrived: a view of its text, which is valid JSON. Move-only. Gives the slot
// back when it is destroyed; so destroy it on the thread of its handle, and before the handle. A view kept
// long is a slot less for what arrives; one that outlives its handle keeps the handle's memory, and one that
// outlives the endpoint, too, all of the endpoint's for as long as the process runs.
class message_view {
 public:
  ROWE_RT message_view(message_view&& from) noexcept
      : lane_{std::exchange(from.lane_, nullptr)}, path_{from.path_}, slot_{from.slot_} {}
  ROWE_RT message_view& operator=(message_view&& from) noexcept {
    std::swap(lane_, from.lane_);
    std::swap(path_, from.path_);
    std::swap(slot_, from.slot_);
    return *this;
  }
  ROWE_RT ~message_view() {
    if (lane_ != nullptr) detail::give_back(*lane_, *path_, slot_);
  }

  // The text: one JSON value; an object where it is a message, a call, or a reply to a lane. Valid as long as
  // this is; 64 bytes behind it may be read.
  ROWE_RT std::string_view value() const noexcept {
    return {reinterpret_cast<const char*>(path_->slots.value(slot_)), header().bytes};
  }
  ROWE_RT std::string_view operator*() const noexcept { return value(); }
  // When its last byte was read from the socket.
  ROWE_RT time_point arrived() const noexcept { return time_point{duration{header().stamped_ns}}; }
  // From whom: no connection (false) where it came from this process itself, or on a topic of a hub, or is a
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
  message_view(detail::lane& on, detail::consumer_end& path, std::uint32_t slot) noexcept
      : lane_{&on}, path_{&path}, slot_{slot} {}

  const detail::value_header& header() const noexcept { return *path_->slots.header(slot_); }

  detail::lane* lane_;
  detail::consumer_end* path_; // of the lane: `in`, or `ends`
  std::uint32_t slot_;
};

// A struct that was decoded from a message of a topic. Move-only; as message_view, but with keep::newest
// there is no slot to give back: value() is the newest value until the subscriber is asked again, or is gone.
template <class T>
class value_view {
 public:
  ROWE_RT value_view(value_view&& from) noexcept
      : lane_{std::exchange(from.lane_, nullptr)}, slot_{from.slot_} {}
  ROWE_RT value_view& operator=(value_view&& from) noexcept {
    std::swap(lane_, from.lane_);
    std::swap(slot_, from.slot_);
    return *this;
  }
  ROWE_RT ~value_view() {
    if (lane_ != nullptr && (slot_ & of_window) == 0) lane_->user.in.free_ring->give(slot_);
  }

  // The struct. Valid as long as this is.
  ROWE_RT const T& value() const noexcept {
    return *reinterpret_cast<const T*>(lane_->user.in.slots.value(slot_ & ~of_window));
  }
  ROWE_RT const T& operator*() const noexcept { return value(); }
  ROWE_RT const T* operator->() const noexcept { return &value(); }
  // When its last byte was read from the socket, or when it was published in this process.
  ROWE_RT time_point arrived() const noexcept { return time_point{duration{header().stamped_ns}}; }
  // From whom: no connection (false) where this process published it.
  ROWE_RT connection from() const noexcept { return {header().peer.index, header().peer.generation}; }

 private:
  template <class U>
  friend class subscriber;
  // Of a slot of a window, which is not given back: said here, so that a view whose handle is gone does not
  // ask the lane, which may be another one's.
  static constexpr std::uint32_t of_window = std::uint32_t{1} << 31;
  value_view(detail::lane& on, const detail::consumer_end&, std::uint32_t slot) noexcept
      : lane_{&on}, slot_{slot} {}

  const detail::value_header& header() const noexcept {
    return *lane_->user.in.slots.header(slot_ & ~of_window);
  }

  detail::lane* lane_;
  std::uint32_t slot_;
};

} // namespace rowe
