// SPDX-License-Identifier: Apache-2.0
// A link to one peer, with the properties of a real one: a round-trip time, the buffers of kernels, and a
// reader that takes so many bytes a second. A ping is answered when it is read.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "sim_base.hpp"
#include "stream.hpp"

namespace sim {

class simulated_link {
 public:
  struct properties {
    duration round_trip = 1ms;
    double bytes_per_second = 1e6;
    std::size_t buffer_bytes = 4 * 1024 * 1024;
    duration late = {}; // so much longer is the way of what the peer says now: its machine is busy
  };

  simulated_link(harness::core_harness& on, const properties& is) : on_{on}, peer_{on}, is_{is} {
    auto& conditions = on_.net.link_of(peer_.id());
    conditions.capacity_bytes = is_.buffer_bytes;
    conditions.to_peer = [this](time_point sent) { return sent + is_.round_trip / 2; };
    conditions.to_us = [this](time_point sent) { return sent + is_.round_trip / 2 + is_.late; };
  }
  simulated_link(const simulated_link&) = delete;
  simulated_link& operator=(const simulated_link&) = delete;

  harness::peer& peer() { return peer_; }
  properties& is() { return is_; }
  // Each text as it is read.
  std::function<void(const written_frame&)> heard = [](const written_frame&) {};

  // Reads what the reader takes until now. Call it after each cycle of the core.
  void advance() {
    const duration passed = on_.now - std::exchange(at_, on_.now);
    const auto arrived = on_.net.sent(peer_.id());
    // A reader that had nothing to read does not catch up later.
    may_read_ = std::min(may_read_ + std::chrono::duration<double>(passed).count() * is_.bytes_per_second,
                         static_cast<double>(arrived.size()));
    const auto bytes = static_cast<std::size_t>(may_read_);
    may_read_ -= static_cast<double>(bytes);
    read_.take(arrived.first(bytes), on_.now);
    on_.net.peer_reads(peer_.id(), bytes);
    for (; !read_.complete.empty(); read_.complete.pop_front()) {
      const written_frame& frame = read_.complete.front();
      if (frame.ping()) peer_.send(rowe::wire::opcode::pong, frame.payload);
      pings_ += frame.ping();
      if (frame.whole_text()) heard(frame);
    }
  }

  std::uint64_t bytes_read() const { return read_.end(); }
  std::uint64_t pings() const { return pings_; } // that were read
  bool broken() const { return read_.broken(); }

 private:
  harness::core_harness& on_;
  harness::peer peer_;
  properties is_;
  time_point at_ = on_.now;
  stream read_;
  double may_read_ = 0;
  std::uint64_t pings_ = 0;
};

} // namespace sim
