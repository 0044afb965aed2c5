// SPDX-License-Identifier: Apache-2.0
// The one client of all servers in bench/peers: its own bytes on its own socket, which it never waits for but
// asks again and again, on a core of its own.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <rowe/rt/clock.hpp>

#include "net/base/descriptor.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

using namespace std::chrono_literals;

inline constexpr auto timeout = 10s; // with a server that must answer

// A client's frame around a text, masked by a key that is not zero.
inline std::string frame_around(std::string_view text, wire::opcode what = wire::opcode::text) {
  constexpr wire::mask_key key{std::byte{0x5a}, std::byte{0xc3}, std::byte{0x11}, std::byte{0x87}};
  std::string frame(wire::frame_header_bytes(text.size(), wire::role::client), '\0');
  (void)wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), what, text.size(), key);
  const std::size_t header = frame.size();
  frame.append(text);
  wire::mask({reinterpret_cast<std::byte*>(frame.data()) + header, text.size()}, key);
  return frame;
}

// A text of so many bytes that is a message of rosbridge as well: the same for every server.
inline std::string text_of(std::size_t bytes) {
  const std::string begin = R"({"op":"publish","topic":"/e","msg":{"x":")", end = R"("}})";
  return begin + std::string(bytes - begin.size() - end.size(), 'x') + end;
}

class peer_client {
 public:
  // Connects as soon as somebody listens, and has the connection upgraded.
  bool open(std::uint16_t port, bool rosbridge) {
    if (!connect(port)) return false;
    send("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    std::string answer;
    char one = 0;
    while (ok && !answer.ends_with("\r\n\r\n")) {
      ok = ::recv(socket_.get(), &one, 1, 0) == 1;
      answer += one;
    }
    ok = ok && answer.starts_with("HTTP/1.1 101");
    // Every server hears something after its answer, if only a pong that it did not ask for (RFC 6455 5.5.3).
    // Linux delays the acknowledgements of sockets that speak after they were spoken to, and then the
    // server's next send has to handle them, which makes it a third longer. A hub's clients must subscribe.
    send(rosbridge ? frame_around(R"({"op":"subscribe","topic":"/e"})")
                   : frame_around("hi", wire::opcode::pong));
    return ok;
  }

  int socket() const { return socket_.get(); }

  void send(std::string_view bytes) {
    while (ok && !bytes.empty()) {
      const std::size_t sent = send_some(bytes);
      bytes.remove_prefix(sent);
    }
  }
  // What fits now.
  std::size_t send_some(std::string_view bytes) {
    const ssize_t sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN) ok = false;
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }

  // Takes what has come, and calls take(text) for each text in it; answers pings.
  template <class Take>
  void receive(Take&& take) {
    const ssize_t bytes = ::recv(socket_.get(), in_.get() + have_, capacity - have_, MSG_DONTWAIT);
    if (bytes == 0 || (bytes < 0 && errno != EAGAIN)) ok = false;
    if (bytes <= 0) return;
    have_ += static_cast<std::size_t>(bytes);
    std::size_t used = 0;
    for (;;) {
      const unsigned char* const at = in_.get() + used;
      const std::size_t have = have_ - used;
      if (have < 2) break;
      const std::size_t length = at[1];
      const std::size_t header = length < 126 ? 2 : 4;
      if (have < header) break;
      const std::size_t whole = header + (length < 126 ? length : std::size_t{at[2]} << 8 | at[3]);
      if (length > 126) ok = false; // nobody was sent as much
      if (have < whole || !ok) break;
      const std::string_view payload{reinterpret_cast<const char*>(at) + header, whole - header};
      if (at[0] == 0x81 || at[0] == 0x82)
        take(payload);
      else if (at[0] == 0x89)
        send(frame_around(payload, wire::opcode::pong));
      else
        ok = false;
      used += whole;
    }
    have_ -= used;
    if (have_ != 0 && used != 0) std::memmove(in_.get(), in_.get() + used, have_);
  }

  // The next text; empty when there is none for too long.
  std::string next() {
    std::string text;
    const auto until = rt::monotonic_clock::now() + timeout;
    for (int i = 0; ok && text.empty(); ++i) {
      receive([&](std::string_view came) { text = came; });
      if (i % 1024 == 0 && rt::monotonic_clock::now() > until) ok = false;
    }
    return text;
  }

  bool ok = false;

 private:
  static constexpr std::size_t capacity = 256 * 1024;

  bool connect(std::uint16_t port) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const auto until = rt::monotonic_clock::now() + timeout;
    do {
      socket_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
      ok = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
      if (!ok) ::usleep(2000);
    } while (!ok && rt::monotonic_clock::now() < until);
    const int yes = 1;
    const linger at_once{.l_onoff = 1, .l_linger = 0}; // leaves no port behind that waits
    const timeval answer_time{.tv_sec = 10, .tv_usec = 0};
    (void)::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // loopback has all of them
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &answer_time, sizeof answer_time);
    return ok;
  }

  net::descriptor socket_;
  std::unique_ptr<unsigned char[]> in_{new unsigned char[capacity]};
  std::size_t have_ = 0;
};

} // namespace rowe::bench
