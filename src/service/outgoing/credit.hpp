// SPDX-License-Identifier: Apache-2.0
// Bounds the bytes in flight to one peer: written, and not known to be read. The bound comes from a time, so
// that an urgent message never waits long behind others. The bound is what the peer reads in two round trips
// plus 20 ms, but at least 12 KiB and at most 1 MiB. If a round trip takes less than 2 ms, the bound has 0.5
// ms in place of 20 ms, and is at least 8 KiB and at most 256 KiB: a peer that suddenly becomes slow has no
// more than that to read first.
//
// Pings measure how fast the peer reads, and how long a round trip takes. Each carries how many bytes were
// written up to its own end. A peer answers in the order in which it reads, so its pong says that all these
// bytes have been read.
//
// A new ping is sent when the last one was answered, or is late, after two round trips and 100 ms. Only the
// next ping acknowledges what was written behind a ping, up to two round trips later. Hence the bound has two
// round trips (decision 0015). A ping is sent after half of the bound, so that there is as much to read
// before it as behind it.
//
// The bound uses the shortest round trip; round_trip.hpp says when that is measured anew.
//
// Pure: no clock, no socket. Service thread; the core asks before it writes and says what was taken.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/options.hpp>
#include <rowe/rt/clock.hpp>

#include "service/outgoing/round_trip.hpp"

namespace rowe::service {

class credit {
 public:
  static constexpr std::size_t bytes_min = 12 * 1024; // of the bound
  static constexpr std::size_t bytes_max = 1024 * 1024;
  static constexpr rt::duration queue_time_high_rtt = std::chrono::milliseconds{20};
  static constexpr std::size_t bytes_min_low_rtt = 8 * 1024;
  static constexpr std::size_t bytes_max_low_rtt = 256 * 1024;
  static constexpr rt::duration queue_time_low_rtt = std::chrono::microseconds{500};
  static constexpr std::size_t send_buffer_min = 16 * 1024;
  static constexpr rt::duration pong_late_after = std::chrono::milliseconds{100}; // and two round trips
  static constexpr std::size_t first_ping_after = 1024;                           // bytes
  static constexpr std::size_t rated_bytes_min = 1024; // an answer to fewer says nothing about the rate
  static constexpr std::size_t ping_bytes = 16;
  using ping_payload = std::array<std::byte, ping_bytes>;

  // A new connection. Until then, and for peers that must not be pinged, there is no bound.
  void begin(std::uint64_t nonce) noexcept;

  // ---- next write

  // How many bytes may be written before the last frame of the priority is begun. What is urgent has more
  // room, and does not wait for a ping's place.
  std::size_t room(priority of) const noexcept;
  // Whether a ping should go in front of what is written next.
  bool wants_ping(rt::time_point now) const noexcept;
  // The ping that will be written next, when its frame ends `end` bytes behind what was written so far.
  ping_payload ping(std::size_t end, rt::time_point now) noexcept;
  // A message was held back because the credit is used up, and a ping is under way.
  void held_back() noexcept {
    round_trip_.limited();
    held_ = true;
  }
  // Ask as soon as possible whether the peer is alive.
  void ask() noexcept { asked_ = pings_ == 0; }

  // ---- progress

  void wrote(std::size_t bytes, rt::time_point now) noexcept;
  // False when it answers no ping of ours: ignored.
  bool take_pong(std::span<const std::byte> payload, rt::time_point now) noexcept;

  // ---- state

  bool ping_under_way() const noexcept { return pings_ != 0; }
  // When the oldest unanswered ping was sent; never: there is none.
  rt::time_point waits_since() const noexcept { return pings_ == 0 ? rt::never : under_way_[0].at; }
  // When the newest ping was sent that was answered; zero: none was.
  rt::time_point answered_at() const noexcept { return answered_at_; }
  bool settling() const noexcept { return round_trip_.settling(); }
  // Neither a ping nor the one after it was answered in time.
  bool unresponsive(rt::time_point now) const noexcept { return pings_ == under_way_.size() && late(now); }
  bool low_rtt() const noexcept { return round_trip_.low(); }
  std::uint64_t in_flight() const noexcept { return written_ - read_; }
  std::size_t bound() const noexcept { return bound_; }
  // How large the kernel's send buffer should be, if it has `now` bytes: the bound, rounded up to a power of
  // two, and at least send_buffer_min. A step costs system calls. So `now` stays while it is enough, or
  // little is in flight, and it is less than four times the bound. 0: the round trip is long, and the kernel
  // decides.
  std::size_t send_buffer(std::size_t now) const noexcept;

 private:
  // The peer's, in bytes a second.
  struct rates {
    std::array<double, 4> last{}; // of the last rounds that say something
    std::uint8_t next = 0;        // place in `last`
    double highest = 0;           // of these
  };
  struct question {
    std::uint64_t end = 0; // of its frame in all that is written
    rt::time_point at{};
  };

  rt::duration queue_time() const noexcept { return low_rtt() ? queue_time_low_rtt : queue_time_high_rtt; }
  std::size_t least() const noexcept { return low_rtt() ? bytes_min_low_rtt : bytes_min; }
  std::size_t most() const noexcept { return low_rtt() ? bytes_max_low_rtt : bytes_max; }
  bool late(rt::time_point now) const noexcept;
  void note_rate(std::uint64_t bytes, rt::duration took, rt::duration waited) noexcept;
  void update_bound(rt::duration waited) noexcept;

  bool begun_ = false;
  bool asked_ = false;
  bool held_ = false;                   // something was held back since the last pong
  std::uint8_t pings_ = 0;              // under way
  std::array<question, 2> under_way_{}; // the older one first
  std::uint64_t nonce_ = 0;
  std::uint64_t written_ = 0;
  std::uint64_t read_ = 0;   // of these, at least
  std::uint64_t pinged_ = 0; // where the last ping ends
  rt::time_point answered_at_{};
  rt::time_point busy_since_{}; // something was on its way all the time from here
  round_trip round_trip_;
  rates rates_;
  std::size_t bound_ = bytes_min;
  std::size_t ping_every_ = first_ping_after; // the first goes early: what it measures decides about the rest
};

} // namespace rowe::service
