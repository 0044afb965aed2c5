// SPDX-License-Identifier: Apache-2.0
// A line to one peer, with what a real one has: a way of some length, the buffers of kernels, and a reader
// that takes so many bytes a second. A ping is answered when it is read.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "ground.hpp"
#include "stream.hpp"

namespace sim {

class line {
 public:
  struct nature {
    duration round_trip = 1ms;
    double bytes_per_second = 1e6;
    std::size_t buffer_bytes = 4 * 1024 * 1024;
  };

  line(stage::theatre& on, const nature& is) : on_{on}, link_{on}, is_{is} {
    auto& sky = on_.net.weather_of(link_.id());
    sky.room_bytes = is_.buffer_bytes;
    sky.to_peer = sky.to_us = [this](time_point sent) { return sent + is_.round_trip / 2; };
  }
  line(const line&) = delete;
  line& operator=(const line&) = delete;

  stage::peer& link() { return link_; }
  nature& is() { return is_; }
  // Each text as it is read.
  std::function<void(const written_frame&)> heard = [](const written_frame&) {};

  // What the reader does until now; each cycle of the core is followed by one of these.
  void advance() {
    const duration passed = on_.now - std::exchange(at_, on_.now);
    const auto arrived = on_.net.sent(link_.id());
    // A reader that has nothing to read does not read more later.
    may_read_ = std::min(may_read_ + std::chrono::duration<double>(passed).count() * is_.bytes_per_second,
                         static_cast<double>(arrived.size()));
    const auto bytes = static_cast<std::size_t>(may_read_);
    may_read_ -= static_cast<double>(bytes);
    read_.take(arrived.first(bytes), on_.now);
    on_.net.peer_reads(link_.id(), bytes);
    for (; !read_.complete.empty(); read_.complete.pop_front()) {
      const written_frame& frame = read_.complete.front();
      if (frame.ping()) link_.send(rowe::wire::opcode::pong, frame.payload);
      if (frame.whole_text()) heard(frame);
    }
  }

  std::uint64_t bytes_read() const { return read_.end(); }
  bool broken() const { return read_.broken(); }

 private:
  stage::theatre& on_;
  stage::peer link_;
  nature is_;
  time_point at_ = on_.now;
  stream read_;
  double may_read_ = 0;
};

} // namespace sim
