// SPDX-License-Identifier: Apache-2.0
// What bench_tls compares: servers of one connection, which is echoed or sent an endless stream. Their thread
// gives them turns, and a turn never waits.
#pragma once
#include <array>
#include <atomic>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include "net/base/descriptor.hpp"
#include "net/transport/socket_transport.hpp"
#include "stand.hpp"
#include "tls_client.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {

enum class serving_bytes { echo, stream };

inline constexpr std::size_t message_bytes = 300;
inline constexpr std::size_t batch_bytes = 60 * 1024;

// Whole frames.
inline std::string ready_batch() {
  std::string frame(wire::frame_header_bytes(message_bytes, wire::role::server), '\0');
  (void)wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), wire::opcode::text,
                                 message_bytes);
  frame.append(message_bytes, 'x');
  std::string batch;
  while (batch.size() + frame.size() <= batch_bytes) batch += frame;
  return batch;
}

class tls_server {
 public:
  virtual ~tls_server() = default;
  virtual bool ok() const = 0;
  virtual std::uint16_t port() const = 0;
  virtual bool wants_request() const = 0; // an upgrade, before anything else
  virtual void turn() = 0;

  // Of the stream; any thread.
  std::uint64_t bytes_taken() const {
    return taken_.load(std::memory_order_relaxed); // a number and no more: pairs with the store below
  }

 protected:
  // relaxed: a number and no more; pairs with the load above
  void took(std::size_t bytes) { taken_.store(bytes_taken() + bytes, std::memory_order_relaxed); }

 private:
  alignas(rt::line_bytes) std::atomic<std::uint64_t> taken_{0};
};

class rowe_server final : public tls_server, private service::transport_sink {
 public:
  enum class in_kernel { any, as_shipped }; // of what is not sent yet

  rowe_server(serving_bytes what, const tls_options& with, in_kernel bound) : what_{what} {
    net::listen_options options;
    options.tls = with;
    if (bound == in_kernel::any) options.limits.unsent_bytes_max = INT_MAX;
    auto made = net::socket_transport::listen(options);
    if (made) sockets_ = std::move(*made);
  }

  bool ok() const override { return sockets_ != nullptr; }
  std::uint16_t port() const override { return sockets_->port(); }
  bool wants_request() const override { return true; }
  void turn() override {
    sockets_->poll(monotonic_clock::now(), *this);
    if (what_ == serving_bytes::stream && writable_) write_more();
  }

 private:
  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(service::connection_id id, const service::peer_info&) noexcept override {
    peer_ = id;
    writable_ = true;
  }
  void on_bytes(service::connection_id id, std::span<std::byte> bytes) noexcept override {
    if (what_ == serving_bytes::echo) (void)sockets_->write(id, bytes); // fits: the client waits for it
  }
  void on_writable(service::connection_id) noexcept override { writable_ = true; }
  void on_close(service::connection_id, service::close_cause) noexcept override { writable_ = false; }
  void on_rejected(const service::rejection&) noexcept override {}
  service::http_answer on_http(const service::http_request&) noexcept override { return {}; }

  void write_more() {
    const auto rest = std::as_bytes(std::span{batch_}).subspan(at_);
    const std::size_t taken = sockets_->write(peer_, rest);
    took(taken);
    writable_ = taken == rest.size();
    at_ = writable_ ? 0 : at_ + taken;
  }

  const serving_bytes what_;
  std::unique_ptr<net::socket_transport> sockets_;
  service::connection_id peer_{};
  bool writable_ = false;
  const std::string batch_ = ready_batch();
  std::size_t at_ = 0; // in the batch
};

// Does no more than it must. What OpenSSL says of a stream that has ended is not looked at: the client does.
class openssl_server final : public tls_server {
 public:
  openssl_server(serving_bytes what, const server_files& files, int version, bool ahead)
      : what_{what}, context_{SSL_CTX_new(TLS_server_method())} {
    speak_only(context_.get(), version);
    SSL_CTX_set_num_tickets(context_.get(), 0);
    SSL_CTX_set_session_cache_mode(context_.get(), SSL_SESS_CACHE_OFF);
    SSL_CTX_set_mode(context_.get(), SSL_MODE_ENABLE_PARTIAL_WRITE);
    SSL_CTX_set_read_ahead(context_.get(), ahead ? 1 : 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof at;
    ok_ = SSL_CTX_use_certificate_chain_file(context_.get(), files.certificate().c_str()) == 1 &&
          SSL_CTX_use_PrivateKey_file(context_.get(), files.key().c_str(), SSL_FILETYPE_PEM) == 1 &&
          ::bind(listening_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 &&
          ::listen(listening_.get(), 1) == 0 &&
          ::getsockname(listening_.get(), reinterpret_cast<sockaddr*>(&at), &bytes) == 0;
    port_ = ntohs(at.sin_port);
    watch(listening_.get(), EPOLLIN);
  }

  bool ok() const override { return ok_; }
  std::uint16_t port() const override { return port_; }
  bool wants_request() const override { return false; }
  void turn() override {
    epoll_event event{};
    if (::epoll_wait(polled_.get(), &event, 1, 0) != 1) return;
    if (!peer_) return accept();
    ERR_clear_error();
    if (SSL_is_init_finished(peer_.get()) == 0) return begin();
    if (what_ == serving_bytes::echo) return echo();
    for (int i = 0; i < records_a_turn; ++i) {
      std::size_t sent = 0;
      if (SSL_write_ex(peer_.get(), batch_.data(), record_bytes, &sent) != 1) break;
      took(sent);
    }
  }

 private:
  static constexpr std::size_t record_bytes = SSL3_RT_MAX_PLAIN_LENGTH;
  static constexpr int records_a_turn = 4; // as many bytes as a batch of rowe's, or more

  void watch(int fd, std::uint32_t events) {
    epoll_event event{};
    event.events = events;
    ok_ = ok_ && ::epoll_ctl(polled_.get(), EPOLL_CTL_ADD, fd, &event) == 0;
  }
  void accept() {
    socket_.reset(::accept4(listening_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    const int yes = 1;
    (void)::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
    peer_.reset(SSL_new(context_.get()));
    SSL_set_fd(peer_.get(), socket_.get());
    SSL_set_accept_state(peer_.get());
    watch(socket_.get(), EPOLLIN);
  }
  void begin() {
    if (SSL_do_handshake(peer_.get()) != 1) return;
    if (what_ == serving_bytes::echo) return echo(); // who reads ahead has what came behind the handshake
    epoll_event event{};
    event.events = EPOLLOUT;
    (void)::epoll_ctl(polled_.get(), EPOLL_CTL_MOD, socket_.get(), &event); // else nothing is measured
  }
  void echo() {
    do {
      std::size_t bytes = 0;
      if (SSL_read_ex(peer_.get(), buffer_.data(), buffer_.size(), &bytes) != 1) return;
      std::size_t sent = 0;
      (void)SSL_write_ex(peer_.get(), buffer_.data(), bytes, &sent); // fits: the client waits for it
    } while (SSL_has_pending(peer_.get()) != 0);
  }

  const serving_bytes what_;
  ssl_context context_;
  net::descriptor polled_{::epoll_create1(EPOLL_CLOEXEC)};
  net::descriptor listening_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  net::descriptor socket_;
  ssl_connection peer_;
  std::uint16_t port_ = 0;
  bool ok_ = false;
  std::array<char, record_bytes> buffer_;
  const std::string batch_ = ready_batch();
};

} // namespace rowe::bench
