// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include <rowe/connection.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/json_value.hpp>
#include <rowe/options.hpp>

namespace rowe {

// A message, call or reply that endpoint::receive() or endpoint::invoke() returned. Move-only; holds one of
// the endpoint's `door_slots` until it is destroyed, on any thread; may outlive its endpoint. One thread at a
// time. Its destructor does not refuse an unanswered call; call endpoint::refuse() for that.
//
// Its text is read in place by get<T>("a.b[2]"), find(), as<T>(), members() and elements(): see
// rowe/json_value.hpp.
class received : public detail::reads_json<received> {
 public:
  received(received&& from) noexcept : state_{std::move(from.state_)}, slot_{from.slot_}, is_{from.is_} {}
  received& operator=(received&& from) noexcept {
    std::swap(state_, from.state_);
    std::swap(slot_, from.slot_);
    std::swap(is_, from.is_);
    return *this;
  }
  ~received();

  // The text: one JSON object. Valid as long as this is; 64 bytes behind it may be read.
  std::string_view value() const noexcept { return is_.text; }
  std::string_view operator*() const noexcept { return value(); }
  // From whom; no connection (false) if it came from this process itself, or is a reply.
  connection from() const noexcept { return {is_.peer.index, is_.peer.generation}; }
  // The name of the identity that it is from; empty if that has none, or has left before this is asked. The
  // text is a copy. Never allocates.
  identity_name identity() const noexcept;
  // Whether it is a call: somebody waits for a reply (endpoint::reply).
  bool wants_reply() const noexcept { return is_.call.generation != 0; }
  // When its last byte was read from the socket; a reply: when it was handed out.
  time_point arrived() const noexcept { return is_.arrived; }

 private:
  friend class endpoint;
  // What the slot holds.
  struct contents {
    std::string_view text;
    detail::peer_ref peer{};
    detail::call_ref call{}; // to be named in the answer; generation 0: none
    time_point arrived{};
    time_point expires = rt::never;
    bool reply = false; // the slot is the one that the invocation was sent in
  };
  received(std::shared_ptr<detail::endpoint_state> of, std::uint32_t slot, const contents& is) noexcept
      : state_{std::move(of)}, slot_{slot}, is_{is} {}

  std::shared_ptr<detail::endpoint_state> state_; // null: moved from
  std::uint32_t slot_;
  contents is_;
};

} // namespace rowe
