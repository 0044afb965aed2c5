// SPDX-License-Identifier: Apache-2.0
// Sends one message again and again over a transport, as the service thread sends telemetry: in batches, with
// no more in flight than the peer's credit allows (src/service/outgoing/credit.hpp), and with the pings that
// measure it. Or `unbounded`: as much as the kernel takes.
#pragma once
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "service/base/service_limits.hpp"
#include "service/base/transport.hpp"
#include "service/outgoing/credit.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

class flood {
 public:
  enum class in_flight { as_shipped, unbounded };

  flood(service::transport& sockets, service::connection_id to, std::span<const std::byte> text,
        in_flight how)
      : transport_{sockets}, to_{to}, text_(text.begin(), text.end()) {
    if (how == in_flight::as_shipped) credit_.begin(1);
  }

  // Writes a batch, or what was left of the last one. False: nothing is taken now, and there is nothing to do
  // before on_writable() or take_pong().
  bool write(rt::time_point now) {
    if (refused_) return false;
    if (rest_.empty() && !gather(now)) return false;
    const std::size_t taken = transport_.write(to_, rest_);
    credit_.wrote(taken, now);
    rest_ = rest_.subspan(taken);
    refused_ = !rest_.empty();
    return !refused_;
  }
  void on_writable() { refused_ = false; }
  void take_pong(std::span<const std::byte> payload, rt::time_point now) {
    if (!credit_.take_pong(payload, now)) return;
    const std::size_t before = std::exchange(buffer_, credit_.send_buffer(buffer_));
    if (before != buffer_) transport_.limit_send_buffer(to_, buffer_);
  }
  service::connection_id peer() const { return to_; }

 private:
  bool gather(rt::time_point now) {
    std::size_t bytes = 0;
    if (credit_.wants_ping(now)) {
      constexpr std::size_t size = service::credit::ping_bytes;
      const auto payload = credit_.ping(wire::frame_header_bytes(size, wire::role::server) + size, now);
      bytes = wire::write_frame_header(batch_.data(), wire::opcode::ping, payload.size());
      std::memcpy(batch_.data() + bytes, payload.data(), payload.size());
      bytes += payload.size();
    }
    const std::size_t room = credit_.room(priority::normal);
    while (bytes < room && bytes < service::batch_bytes_max) {
      bytes += wire::write_frame_header(batch_.data() + bytes, wire::opcode::text, text_.size());
      std::memcpy(batch_.data() + bytes, text_.data(), text_.size());
      bytes += text_.size();
    }
    if (bytes >= room && credit_.ping_under_way()) credit_.held_back();
    rest_ = std::span{batch_}.first(bytes);
    return bytes != 0;
  }

  service::transport& transport_;
  service::connection_id to_;
  service::credit credit_;
  std::size_t buffer_ = 0;
  std::vector<std::byte> text_;
  std::vector<std::byte> batch_ = std::vector<std::byte>(2 * service::batch_bytes_max);
  std::span<const std::byte> rest_;
  bool refused_ = false;
};

} // namespace rowe::bench
