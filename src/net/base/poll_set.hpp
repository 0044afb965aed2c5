// SPDX-License-Identifier: Apache-2.0
// The epoll of a transport. An event names its socket by kind, index and generation, never by descriptor or
// pointer, because within one batch a socket may be closed, and its descriptor and place used again.
//
// wait() keeps the events that ended it, and take() returns them. So a turn that had to sleep pays one system
// call for both. Service thread; never allocates after open().
//
// A timerfd bounds a short sleep. If something else ends the sleep, the timer is left running, and bounds the
// next sleeps until it has gone off. To stop and set the timer of a core for each message would cost more
// than the message itself, most of all in a virtual machine (decision 0024). epoll_pwait2 bounds a longer
// sleep: the kernel does not set the core's timer for what comes after its next tick.
#pragma once
#include <sys/epoll.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/result.hpp>
#include <rowe/rt/clock.hpp>

#include "net/base/descriptor.hpp"

namespace rowe::net {

enum class source : std::uint8_t {
  listener,
  waker,
  timer,
  handshake,
  connection,
  attempt,
  tls,  // a socket whose TLS handshake is under way, or that is a relay
  pair, // the relay's other socket
};

struct event_token {
  source from = source::waker;
  std::uint32_t index = 0; // below 2^24
  std::uint32_t generation = 0;

  std::uint64_t packed() const noexcept {
    return static_cast<std::uint64_t>(from) << 56 | static_cast<std::uint64_t>(index & 0xffffffU) << 32 |
           generation;
  }
  static event_token unpack(std::uint64_t packed) noexcept {
    return {static_cast<source>(packed >> 56), static_cast<std::uint32_t>(packed >> 32) & 0xffffffU,
            static_cast<std::uint32_t>(packed)};
  }
};

struct socket_event {
  event_token token;
  std::uint32_t events = 0; // EPOLLIN, EPOLLOUT, …
};

// How wait() bounds a long sleep: by epoll_pwait2 (Linux 5.11), or, where the kernel lacks that, by the
// timerfd as well. epoll_wait itself counts milliseconds, which is too coarse.
enum class sleeping_by : std::uint8_t { epoll_pwait2, timerfd };

class poll_set {
 public:
  // A batch: what one turn handles. More sockets than that take turns, since the kernel reports in rotation.
  static constexpr std::size_t batch_max = 64;

  // errc::bad_argument never; errc::no_memory when the kernel has no descriptor or memory left.
  static result<poll_set> open(sleeping_by how = sleeping_by::epoll_pwait2) noexcept;

  bool add(int fd, std::uint32_t events, event_token token) noexcept;
  void modify(int fd, std::uint32_t events, event_token token) noexcept;
  void remove(int fd) noexcept; // before its descriptor is closed

  // The events that are ready now; after a wait(), the events that it found, or none. Valid until the next
  // take() or wait().
  std::span<const socket_event> take() noexcept;

  // Sleeps until something is ready or `until` has come. It may end earlier, by the timer of an earlier short
  // sleep. Does not sleep while a batch waits to be taken.
  void wait(rt::time_point now, rt::time_point until) noexcept;

 private:
  poll_set(descriptor epoll, descriptor timer, bool has_pwait2) noexcept;
  bool timer_by(rt::time_point now, rt::time_point until) noexcept;
  void keep(int count) noexcept;

  static constexpr rt::duration short_sleep = std::chrono::milliseconds{4}; // a tick, or several

  descriptor epoll_;
  descriptor timer_;
  bool has_pwait2_;
  rt::time_point timer_ends_ = rt::never; // never: it is not set, or has gone off
  std::array<epoll_event, batch_max> ready_;
  std::array<socket_event, batch_max> batch_;
  std::size_t waiting_ = 0; // events found and not taken
  bool looked_ = false;     // wait() has asked the kernel since the last take()
};

} // namespace rowe::net
