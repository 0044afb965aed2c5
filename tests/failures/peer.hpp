// SPDX-License-Identifier: Apache-2.0
// A peer of the test's own: a blocking socket that speaks enough HTTP and WebSocket, and gives up after a
// time.
#pragma once
#include <sys/time.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "net/base/descriptor.hpp"
#include "rt/loopback.hpp"

namespace failures {

enum class answer : std::uint8_t { right, refused, none }; // none: it hangs

class peer {
 public:
  explicit peer(std::uint16_t server) : server_{server} {
    fd_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const timeval time_max{10, 0};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &time_max, sizeof time_max);
    connected_ = rowe::tests::connect_to(server, fd_.get());
  }

  std::uint16_t port() const { return rowe::tests::port_of(fd_.get()); }

  answer get(std::string_view path) {
    const answer got = ask(path, "\r\n", "HTTP/1.1 200");
    while (read() == answer::right) {
    } // to its end
    return got;
  }

  answer upgrade() {
    return ask("/",
               "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
               "HTTP/1.1 101");
  }

  // Publishes on a topic that it subscribes to, on a server that relays, and waits for what comes back.
  answer echo(std::string_view value) {
    if (!std::exchange(subscribed_, true)) send_text(R"({"op":"subscribe","topic":"/echo"})");
    send_text(R"({"op":"publish","topic":"/echo","msg":{"v":")" + std::string{value} + "\"}}");
    return await(value);
  }

 private:
  answer ask(std::string_view path, std::string_view more, std::string_view right) {
    if (!connected_) return answer::refused;
    send_all("GET " + std::string{path} + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server_) + "\r\n" +
             std::string{more});
    const answer got = await("\r\n\r\n");
    if (got != answer::right) return got;
    const bool good = text_.starts_with(right);
    text_.clear();
    return good ? answer::right : answer::refused;
  }

  void send_all(std::string_view text) {
    (void)::send(fd_.get(), text.data(), text.size(), MSG_NOSIGNAL); // if it is gone, reading says so
  }
  // One frame of fewer than 126 bytes, masked with a key of zeros.
  void send_text(const std::string& text) {
    std::string frame{'\x81', static_cast<char>(0x80 | text.size()), '\0', '\0', '\0', '\0'};
    send_all(frame + text);
  }

  answer read() {
    char buffer[4096];
    ssize_t bytes = 0;
    do {
      bytes = ::recv(fd_.get(), buffer, sizeof buffer, 0);
    } while (bytes < 0 && errno == EINTR); // with a time-out it is not begun anew after a stop and a continue
    if (bytes < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return answer::none;
    if (bytes <= 0) return answer::refused;
    text_.append(buffer, static_cast<std::size_t>(bytes));
    return answer::right;
  }

  answer await(std::string_view what) {
    std::size_t at = 0;
    while ((at = text_.find(what)) == std::string::npos) {
      if (const answer got = read(); got != answer::right) return got;
    }
    if (what != "\r\n\r\n") text_.erase(0, at + what.size());
    return answer::right;
  }

  std::uint16_t server_;
  rowe::net::descriptor fd_;
  bool connected_ = false;
  bool subscribed_ = false;
  std::string text_;
};

} // namespace failures
