// SPDX-License-Identifier: Apache-2.0
// The other end of a WebSocket connection over loopback, on the other core: a client that takes whatever
// comes as fast as it can, or sends as fast as it can. It spins, so nobody pays for waking it.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "net/base/descriptor.hpp"
#include "stand.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

class far_end {
 public:
  explicit far_end(std::uint16_t port) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    (void)::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
    ok_ = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  far_end(const far_end&) = delete;
  far_end& operator=(const far_end&) = delete;
  ~far_end() {
    done_.store(true, std::memory_order_release); // pairs with the acquires in swallow() and flood()
  }

  bool ok() const { return ok_; }
  void ask_for_upgrade() {
    send("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  }
  // Waits for the answer, and takes no byte behind it.
  void take_answer() {
    std::string head;
    for (char c = 0; ok_ && !head.ends_with("\r\n\r\n"); head += c)
      ok_ = ::recv(socket_.get(), &c, 1, 0) == 1;
  }
  // A frame whose mask is zeros.
  void say(std::string_view text) { send(frame_of(wire::opcode::text, text)); }

  // From here on, on the other core, until this object ends.
  void swallow() {
    thread_ = on_the_other_core([this] {
      while (!done_.load(std::memory_order_acquire)) take_some(); // pairs with the release above
    });
  }
  void flood(std::string_view batch) {
    thread_ = on_the_other_core([this, batch = std::string{batch}] {
      std::string_view rest = batch;
      while (!done_.load(std::memory_order_acquire)) { // pairs with the release above
        const ssize_t sent = ::send(socket_.get(), rest.data(), rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) rest.remove_prefix(static_cast<std::size_t>(sent));
        if (rest.empty()) rest = batch;
      }
    });
  }

  // Whole text frames that have come.
  std::uint64_t messages() const {
    return messages_.load(std::memory_order_relaxed); // a number and no more: pairs with the store below
  }

  static std::string frame_of(wire::opcode what, std::string_view text, wire::mask_key key = {}) {
    std::string frame(wire::frame_header_bytes_max, '\0');
    frame.resize(
        wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), what, text.size(), key));
    const std::size_t header = frame.size();
    frame += text;
    wire::mask(std::as_writable_bytes(std::span{frame}).subspan(header), key);
    return frame;
  }

 private:
  static constexpr std::size_t buffer_bytes = 256 * 1024;

  void send(std::string_view bytes) {
    ok_ = ok_ && ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
                     static_cast<ssize_t>(bytes.size());
  }

  // What has come, frame by frame: only headers are looked at, and pings answered.
  void take_some() {
    const ssize_t got = ::recv(socket_.get(), buffer_.data() + kept_, buffer_.size() - kept_, MSG_DONTWAIT);
    if (got <= 0) return;
    std::size_t have = kept_ + static_cast<std::size_t>(got);
    std::size_t at = 0;
    std::uint64_t whole = 0;
    for (;;) {
      const std::size_t skipped = std::min(rest_, have - at);
      at += skipped;
      rest_ -= skipped;
      if (rest_ != 0) break;
      whole += std::exchange(in_text_, false);
      const std::span<const std::byte> frame{buffer_.data() + at, have - at};
      if (frame.size() < 4) break;
      const auto length = std::to_integer<std::size_t>(frame[1]) & 0x7f;
      const bool two_bytes = length == 126; // none here is longer
      const std::size_t payload =
          two_bytes ? std::to_integer<std::size_t>(frame[2]) << 8 | std::to_integer<std::size_t>(frame[3])
                    : length;
      const std::size_t header = two_bytes ? 4 : 2;
      const auto what = static_cast<wire::opcode>(std::to_integer<std::uint8_t>(frame[0]) & 0x0f);
      in_text_ = what == wire::opcode::text;
      if (what == wire::opcode::ping) {
        if (frame.size() < header + payload) break;
        send(frame_of(wire::opcode::pong, {reinterpret_cast<const char*>(frame.data()) + header, payload}));
      }
      at += header;
      rest_ = payload;
    }
    kept_ = have - at;
    std::memmove(buffer_.data(), buffer_.data() + at, kept_);
    // relaxed: a number and no more; pairs with the load in messages()
    messages_.store(messages_.load(std::memory_order_relaxed) + whole, std::memory_order_relaxed);
  }

  net::descriptor socket_;
  bool ok_ = false;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(buffer_bytes);
  std::size_t kept_ = 0; // of a header, at the front of the room
  std::size_t rest_ = 0; // of the frame that is being taken
  bool in_text_ = false;
  alignas(rt::line_bytes) std::atomic<std::uint64_t> messages_{0};
  alignas(rt::line_bytes) std::atomic<bool> done_{false};
  rt::thread thread_; // last: it ends first
};

} // namespace rowe::bench
