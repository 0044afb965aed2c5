// SPDX-License-Identifier: Apache-2.0
// The other end of a TLS connection over loopback, by OpenSSL on its own socket BIO: the same one for all
// that are compared. It speaks one version, one cipher and one key exchange, so all servers do the same work.
// Without a version it speaks plain TCP.
#pragma once
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <rowe/tls.hpp>

#include "certificates/certificates.hpp"
#include "net/base/descriptor.hpp"
#include "rt/folder.hpp"

namespace rowe::bench {

struct openssl_freed {
  void operator()(SSL_CTX* one) const { SSL_CTX_free(one); }
  void operator()(SSL* one) const { SSL_free(one); }
};
using ssl_context = std::unique_ptr<SSL_CTX, openssl_freed>;
using ssl_connection = std::unique_ptr<SSL, openssl_freed>;

// A root, and a server's files below it.
class server_files {
 public:
  server_files() {
    const test::made_certificate root = test::make_root();
    test::write_files(files_.path(), root, test::make_leaf(root));
  }
  tls_options options() const { return {.certificate = certificate(), .key = key()}; }
  std::string certificate() const { return files_ / "certificate.pem"; }
  std::string key() const { return files_ / "key.pem"; }

 private:
  tests::folder files_;
};

inline void speak_only(SSL_CTX* with, int version) {
  SSL_CTX_set_min_proto_version(with, version);
  SSL_CTX_set_max_proto_version(with, version);
  SSL_CTX_set_cipher_list(with, "ECDHE-ECDSA-AES128-GCM-SHA256");
  SSL_CTX_set_ciphersuites(with, "TLS_AES_128_GCM_SHA256");
  SSL_CTX_set1_groups_list(with, "X25519:P-256"); // without the latter TLS 1.2 takes no such certificate
}

inline ssl_context client_context(int version) {
  ssl_context made{SSL_CTX_new(TLS_client_method())};
  speak_only(made.get(), version);
  return made;
}

class tls_client {
 public:
  // `with`: null for plain TCP. It sleeps until what it waits for has come, ten seconds at most.
  tls_client(std::uint16_t port, SSL_CTX* with) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    (void)::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
    const timeval timeout{.tv_sec = 10, .tv_usec = 0};
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout); // else for ever
    ok_ = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    if (with == nullptr) return;
    ssl_.reset(SSL_new(with));
    SSL_set_fd(ssl_.get(), socket_.get());
    SSL_set_connect_state(ssl_.get());
  }

  // From here on it asks again and again.
  void spin() {
    ::fcntl(fd(), F_SETFL, O_NONBLOCK);
    sleeps_ = false;
  }

  bool ok() const { return ok_; }
  int fd() const { return socket_.get(); }

  // The handshake to its end.
  bool shake() {
    return !ssl_ || repeat([&] { return SSL_do_handshake(ssl_.get()); });
  }
  bool ask_for_upgrade(std::uint16_t port) {
    return send("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  }
  // Waits for the answer to it, and takes no byte behind that.
  bool take_answer() {
    std::string head;
    for (char c = 0; ok_ && !head.ends_with("\r\n\r\n"); head += c) take(std::span{&c, 1});
    return ok_ && head.starts_with("HTTP/1.1 101 ");
  }

  bool send(std::string_view bytes) {
    while (ok_ && !bytes.empty()) {
      std::size_t sent = 0;
      if (ssl_) {
        ok_ = repeat([&] { return SSL_write_ex(ssl_.get(), bytes.data(), bytes.size(), &sent); });
      } else {
        ok_ = repeat_plain([&] { return ::send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL); }, sent);
      }
      bytes.remove_prefix(sent);
    }
    return ok_;
  }
  // As much as `into` has room for.
  bool take(std::span<char> into) {
    while (ok_ && !into.empty()) {
      std::size_t got = 0;
      if (ssl_) {
        ok_ = repeat([&] { return SSL_read_ex(ssl_.get(), into.data(), into.size(), &got); });
      } else {
        ok_ = repeat_plain([&] { return ::recv(fd(), into.data(), into.size(), 0); }, got);
      }
      into = into.subspan(got);
    }
    return ok_;
  }
  // What has come, unopened: who opened it might be slower than the server that is measured.
  void throw_away() { (void)::recv(fd(), nullptr, std::size_t{1} << 20, MSG_TRUNC | MSG_DONTWAIT); }

 private:
  // Until it is done; false once it cannot be.
  template <class Step>
  bool repeat(Step step) {
    for (;;) {
      ERR_clear_error();
      const int outcome = step();
      if (outcome == 1) return true;
      const int what = SSL_get_error(ssl_.get(), outcome);
      const bool again = what == SSL_ERROR_WANT_READ || what == SSL_ERROR_WANT_WRITE;
      if (!again || sleeps_) return false; // who sleeps has waited long enough
    }
  }
  template <class Step>
  bool repeat_plain(Step step, std::size_t& bytes) {
    for (;;) {
      const ssize_t outcome = step();
      bytes = outcome > 0 ? static_cast<std::size_t>(outcome) : 0;
      if (outcome > 0) return true;
      if (outcome == 0 || errno != EAGAIN || sleeps_) return false;
    }
  }

  net::descriptor socket_;
  bool sleeps_ = true;
  ssl_connection ssl_;
  bool ok_ = false;
};

} // namespace rowe::bench
