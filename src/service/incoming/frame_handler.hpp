// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>

#include "service/base/ids.hpp"
#include "wire/websocket/frame_parser.hpp"

namespace rowe::service {

// Takes the frames of `ingress`. The core implements it, because only the core may call every part. Service
// thread only; nothing waits or allocates.
class frame_handler {
 public:
  // A whole message, a control frame, or a violation of the protocol.
  virtual void handle(peer_index from, const wire::frame_step& step) noexcept = 0;
  // A message that was parked.
  virtual void handle_again(peer_index from, std::span<std::byte> message, bool binary) noexcept = 0;
  // Whether there is something that can be stopped.
  virtual bool stop_in_use() const noexcept = 0;
  // Whether handle() would carry out a stop. Nothing is done.
  virtual bool is_stop(peer_index from, std::span<const std::byte> message, bool binary) noexcept = 0;

 protected:
  ~frame_handler() = default;
};

} // namespace rowe::service
