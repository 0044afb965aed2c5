// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/options.hpp>

namespace rowe {

namespace detail {
class endpoint_state;
}

// A message, call or reply that endpoint::receive() or endpoint::invoke() returned. Move-only; keeps one of
// the endpoint's `door_slots` until it is destroyed, on any thread; may outlive its endpoint. One thread at a
// time.
class received {
 public:
  received(received&& from) noexcept : state_{std::move(from.state_)}, slot_{from.slot_} {}
  received& operator=(received&& from) noexcept {
    std::swap(state_, from.state_);
    std::swap(slot_, from.slot_);
    return *this;
  }
  ~received();

  // The text: one JSON object. Valid as long as this is; 64 bytes behind it may be read.
  std::string_view text() const noexcept;
  // From whom: no connection (false) where it came from this process itself.
  connection from() const noexcept;
  // Whether it is a call: somebody waits for a reply (endpoint::reply).
  bool wants_reply() const noexcept;
  // When its last byte was read from the socket.
  time_point arrived() const noexcept;

 private:
  friend class endpoint;
  received(std::shared_ptr<detail::endpoint_state> of, std::uint32_t slot) noexcept
      : state_{std::move(of)}, slot_{slot} {}

  std::shared_ptr<detail::endpoint_state> state_; // null: moved from
  std::uint32_t slot_;
};

} // namespace rowe
