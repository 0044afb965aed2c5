// SPDX-License-Identifier: Apache-2.0
// A client of wss that is cheap enough for a thousand of them: OpenSSL on its own socket, a few hundred bytes
// besides, and no thread. It never waits: step() goes on as far as it can.
#pragma once
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <openssl/err.h>
#include <openssl/ssl.h>

#include "net/base/descriptor.hpp"
#include "rt/loopback.hpp"

namespace rowe::load {

// A client's frame, masked with zeros.
inline std::string frame_of(char first, std::string_view payload) {
  std::string frame{first};
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80 | payload.size());
  } else {
    frame += static_cast<char>(0x80 | 126);
    frame += static_cast<char>(payload.size() >> 8);
    frame += static_cast<char>(payload.size() & 0xff);
  }
  frame.append(4, '\0');
  return frame.append(payload);
}

class client {
 public:
  // `with`: null for a socket alone, of which fd() is all there is.
  client(std::uint16_t port, SSL_CTX* with, std::string_view token, int receive_buffer = 0)
      : port_{port}, token_{token} {
    socket_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (receive_buffer != 0)
      (void)::setsockopt(fd(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    const int yes = 1;
    (void)::setsockopt(fd(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
    fine_ = rowe::tests::connect_to(port, fd());
    (void)::fcntl(fd(), F_SETFL, O_NONBLOCK); // cannot fail on a socket
    if (with == nullptr) return;
    ssl_.reset(SSL_new(with));
    SSL_set_mode(ssl_.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                 SSL_MODE_RELEASE_BUFFERS);
    SSL_set_fd(ssl_.get(), fd());
    SSL_set_connect_state(ssl_.get());
  }

  int fd() const { return socket_.get(); }
  SSL* ssl() const { return ssl_.get(); }
  bool is_open() const { return open_; }
  bool wants_write() const { return wants_write_ || !out_.empty(); }

  // Takes what has come and sends what waits. `hear` gets each text message. False: the connection is over.
  template <class Hear>
  bool step(Hear hear) {
    if (!fine_) return false;
    wants_write_ = false;
    if (!shaken_ && !shake()) return fine_;
    return flush() && read(hear) && flush();
  }
  void say(std::string_view text) { out_ += frame_of('\x81', text); }
  void say_end() { (void)SSL_shutdown(ssl_.get()); } // the other end is not waited for

 private:
  bool shake() {
    ERR_clear_error();
    const int outcome = SSL_do_handshake(ssl_.get());
    if (outcome != 1) {
      note(outcome);
      return false;
    }
    shaken_ = true;
    out_ = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) +
           "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nAuthorization: Bearer " +
           token_ + "\r\n\r\n";
    return true;
  }
  // What an outcome other than 1 means: to try again, or that it is over.
  void note(int outcome) {
    const int what = SSL_get_error(ssl_.get(), outcome);
    wants_write_ = what == SSL_ERROR_WANT_WRITE;
    fine_ = wants_write_ || what == SSL_ERROR_WANT_READ;
  }
  bool flush() {
    while (!out_.empty()) {
      ERR_clear_error();
      std::size_t sent = 0;
      const int outcome = SSL_write_ex(ssl_.get(), out_.data(), out_.size(), &sent);
      if (outcome != 1) {
        note(outcome);
        return fine_;
      }
      out_.erase(0, sent);
    }
    return true;
  }
  template <class Hear>
  bool read(Hear hear) {
    char buffer[16384];
    for (;;) {
      ERR_clear_error();
      std::size_t got = 0;
      const int outcome = SSL_read_ex(ssl_.get(), buffer, sizeof buffer, &got);
      if (outcome != 1) {
        note(outcome);
        return fine_;
      }
      in_.append(buffer, got);
      if (!open_ && !take_answer()) return fine_;
      if (open_) take_frames(hear);
    }
  }
  bool take_answer() {
    const std::size_t end = in_.find("\r\n\r\n");
    if (end == std::string::npos) return true; // not all of it
    fine_ = open_ = in_.starts_with("HTTP/1.1 101 ");
    in_.erase(0, end + 4);
    return fine_;
  }
  template <class Hear>
  void take_frames(Hear hear) {
    std::size_t at = 0;
    while (in_.size() - at >= 2) {
      const auto byte = [&](std::size_t i) {
        return static_cast<std::size_t>(static_cast<unsigned char>(in_[at + i]));
      };
      std::size_t head = 2;
      std::size_t length = byte(1);
      if (length == 126) {
        if (in_.size() - at < 4) break;
        head = 4;
        length = byte(2) << 8 | byte(3);
      }
      if (length > 65535 || in_.size() - at < head + length) break;
      const std::string_view payload = std::string_view{in_}.substr(at + head, length);
      switch (byte(0)) {
      case 0x81: hear(payload); break;
      case 0x89: out_ += frame_of('\x8a', payload); break;
      case 0x88: fine_ = false; break;
      default: break;
      }
      at += head + length;
    }
    in_.erase(0, at);
  }

  struct freed {
    void operator()(SSL* one) const { SSL_free(one); }
  };
  std::uint16_t port_;
  std::string token_;
  net::descriptor socket_;
  std::unique_ptr<SSL, freed> ssl_;
  bool fine_ = false;
  bool shaken_ = false;
  bool open_ = false;
  bool wants_write_ = false;
  std::string in_;
  std::string out_;
};

} // namespace rowe::load
