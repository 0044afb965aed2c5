// SPDX-License-Identifier: Apache-2.0
// A WebSocket client that sleeps until something comes, and does with it what a healthy peer does: it reads
// all, at once, and answers pings. For benches with many clients on one core; raw_client.hpp is the one that
// spins.
#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/uio.h>

#include <rowe/rt/clock.hpp>

#include "net/base/descriptor.hpp"
#include "raw_client.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

class listener {
 public:
  // Connected and upgraded; not ok() when that failed.
  explicit listener(std::uint16_t port, std::string_view path = "/", std::string_view subprotocol = {}) {
    const sockaddr_in to = loopback_at(port);
    const timeval silence{10, 0};
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &silence, sizeof silence); // or waits longer
    const int yes = 1;
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes); // came_at() is then now
    send_at_once(socket_.get());
    std::string ask = "GET " + std::string{path} + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                      "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    if (!subprotocol.empty()) ask += "Sec-WebSocket-Protocol: " + std::string{subprotocol} + "\r\n";
    ok_ = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
          send_whole(socket_.get(), ask + "\r\n");
    std::string head;
    for (char c = 0; ok_ && !head.ends_with("\r\n\r\n"); head += c)
      ok_ = ::recv(socket_.get(), &c, 1, 0) == 1;
    ok_ = ok_ && head.starts_with("HTTP/1.1 101");
    parser_.reset(
        wire::role::client,
        {.message_bytes_max = whole_bytes_max, .long_bytes_max = 1U << 26, .fragments_max = 1U << 20},
        assembly_);
  }

  bool ok() const { return ok_; }
  int socket() const { return socket_.get(); }
  bool send(std::string_view bytes) {
    if (ok_ && !send_whole(socket_.get(), bytes)) ok_ = false;
    return ok_;
  }
  bool say(std::string_view text) { return send(raw_client::frame_of(wire::opcode::text, text)); }

  // Waits for bytes (or not, with MSG_DONTWAIT), and gives each message, or piece of a long one, to
  // hear(step). False: nothing came, or the connection is over; ok() says which.
  template <class Hear>
  bool take(Hear&& hear, int flags = 0) {
    if (!ok_) return false;
    const ssize_t got = receive(flags);
    if (got == 0) ok_ = false;
    if (got <= 0) return false;
    std::span<std::byte> unread = std::span{buffer_}.first(static_cast<std::size_t>(got));
    while (ok_ && !unread.empty()) {
      const wire::frame_step step = parser_.next(unread);
      unread = unread.subspan(step.consumed);
      if (step.event == wire::frame_event::ping) {
        const auto* const bytes = reinterpret_cast<const char*>(step.payload.data());
        (void)send(raw_client::frame_of(wire::opcode::pong, {bytes, step.payload.size()})); // ok() says it
      } else if (step.event == wire::frame_event::close || step.event == wire::frame_event::violation) {
        ok_ = false;
      } else if (step.event != wire::frame_event::need_more && step.event != wire::frame_event::pong) {
        hear(step);
      }
    }
    return ok_;
  }
  // When the last bytes that take() gave were in this end's kernel. What is later is this thread's own doing.
  rt::time_point came_at() const { return came_at_; }
  // From another thread: whoever waits in take() is told.
  void end() const { (void)::shutdown(socket_.get(), SHUT_RDWR); } // it may be over already

 private:
  static constexpr std::size_t whole_bytes_max = 64 * 1024;

  ssize_t receive(int flags) {
    iovec into{buffer_.data(), buffer_.size() - 64};
    alignas(cmsghdr) std::array<char, 256> more;
    msghdr asked{};
    asked.msg_iov = &into;
    asked.msg_iovlen = 1;
    asked.msg_control = more.data();
    asked.msg_controllen = more.size();
    const ssize_t got = ::recvmsg(socket_.get(), &asked, flags);
    const rt::time_point now = rt::monotonic_clock::now();
    came_at_ = now;
    timespec calendar{};
    (void)::clock_gettime(CLOCK_REALTIME, &calendar); // cannot fail
    for (cmsghdr* one = CMSG_FIRSTHDR(&asked); got > 0 && one != nullptr; one = CMSG_NXTHDR(&asked, one)) {
      if (one->cmsg_level != SOL_SOCKET || one->cmsg_type != SCM_TIMESTAMPNS) continue;
      timespec came{};
      std::memcpy(&came, CMSG_DATA(one), sizeof came);
      came_at_ = now - std::chrono::seconds{calendar.tv_sec - came.tv_sec} -
                 std::chrono::nanoseconds{calendar.tv_nsec - came.tv_nsec};
    }
    return got;
  }

  net::descriptor socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  std::atomic<bool> ok_{false}; // others look, too
  rt::time_point came_at_{};
  wire::frame_parser parser_;
  std::vector<std::byte> assembly_ = std::vector<std::byte>(whole_bytes_max + 64);
  std::vector<std::byte> buffer_ = std::vector<std::byte>(whole_bytes_max + 64);
};

inline std::string_view text_of(const wire::frame_step& step) {
  return {reinterpret_cast<const char*>(step.payload.data()), step.payload.size()};
}

} // namespace rowe::bench
