// SPDX-License-Identifier: Apache-2.0
// The other side of a TLS connection, for tests: OpenSSL on a raw socket, which never waits.
#pragma once
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <openssl/err.h>
#include <openssl/ssl.h>

#include "certificates/certificates.hpp"
#include "net/tls/session.hpp"
#include "rt/folder.hpp"
#include "support.hpp"

namespace rowe::net {

inline constexpr long day = 24 * 60 * 60;

// A root, and a server's files below it.
struct certified {
  tests::folder files;
  test::made_certificate root = test::make_root();
  test::made_certificate leaf = test::make_leaf(root);

  certified() { test::write_files(files.path(), root, leaf); }
  tls_options server() const { return {.certificate = files / "certificate.pem", .key = files / "key.pem"}; }
  tls_options client() const { return {.ca = files / "ca.pem"}; }
};

struct freed {
  void operator()(SSL_CTX* one) const { SSL_CTX_free(one); }
  void operator()(SSL* one) const { SSL_free(one); }
  void operator()(SSL_SESSION* one) const { SSL_SESSION_free(one); }
};
using context_ptr = std::unique_ptr<SSL_CTX, freed>;
using ssl_ptr = std::unique_ptr<SSL, freed>;
using session_ptr = std::unique_ptr<SSL_SESSION, freed>;

// What the other side speaks.
using preparation = std::function<void(SSL_CTX*)>;

inline preparation only_version(int version) {
  return [version](SSL_CTX* to) {
    if (version < TLS1_2_VERSION) SSL_CTX_set_security_level(to, 0);
    SSL_CTX_set_min_proto_version(to, version);
    SSL_CTX_set_max_proto_version(to, version);
  };
}
inline preparation only_cipher_of_tls_1_2(const char* name) {
  return [name](SSL_CTX* to) {
    only_version(TLS1_2_VERSION)(to);
    SSL_CTX_set_cipher_list(to, name);
  };
}
inline preparation only_group(const char* name) {
  return [name](SSL_CTX* to) { SSL_CTX_set1_groups_list(to, name); };
}

// A server of a test that speaks TLS, and what turns it.
struct served_tls : testing::Test {
  certified files;
  std::unique_ptr<socket_transport> transport = listening({.tls = files.server()});
  driver drive{*transport};

  // With these limits instead.
  void listen(const socket_limits& limits) {
    transport = listening({.tls = files.server(), .limits = limits});
    drive = driver{*transport};
  }
};

class tls_socket {
 public:
  // `prepare` may change what the client speaks.
  explicit tls_socket(std::uint16_t port, const preparation& prepare = {}, int receive_buffer = 0)
      : raw{port, "127.0.0.1", receive_buffer} {
    context_.reset(SSL_CTX_new(TLS_client_method()));
    if (prepare) prepare(context_.get());
    ssl_.reset(SSL_new(context_.get()));
    SSL_set_fd(ssl_.get(), raw.fd());
    SSL_set_connect_state(ssl_.get());
  }
  SSL* get() const { return ssl_.get(); }

  // True once the handshake is done.
  bool shaken() {
    if (failed()) return false;
    ERR_clear_error();
    const int outcome = SSL_do_handshake(ssl_.get());
    if (outcome == 1) return true;
    note(outcome);
    return false;
  }
  // OpenSSL's words for what went wrong; empty: nothing.
  bool failed() const { return !fault.empty(); }

  bool send(std::string_view bytes) {
    ERR_clear_error();
    std::size_t taken = 0;
    return SSL_write_ex(ssl_.get(), bytes.data(), bytes.size(), &taken) == 1 && taken == bytes.size();
  }
  // Takes what has arrived. False once the stream has ended: `ended_well` says how.
  bool read() {
    char buffer[16384];
    for (;;) {
      ERR_clear_error();
      std::size_t got = 0;
      const int outcome = SSL_read_ex(ssl_.get(), buffer, sizeof buffer, &got);
      if (outcome == 1) {
        text.append(buffer, got);
        continue;
      }
      const int what = SSL_get_error(ssl_.get(), outcome);
      if (what == SSL_ERROR_WANT_READ || what == SSL_ERROR_WANT_WRITE) return true;
      ended_well = what == SSL_ERROR_ZERO_RETURN;
      return false;
    }
  }
  bool has(std::string_view what) {
    read();
    return text.find(what) != std::string::npos;
  }
  bool ended() { return !read(); }
  void say_end() { SSL_shutdown(ssl_.get()); }
  // What is sent in `all` arrives together.
  void in_one_segment(const std::function<void()>& all) {
    const auto cork = [&](int on) { ::setsockopt(raw.fd(), IPPROTO_TCP, TCP_CORK, &on, sizeof on); };
    cork(1);
    all();
    cork(0);
  }
  // Asks for new keys so often, in one burst.
  void take_new_keys(int times) {
    for (int i = 0; i < times; ++i) {
      SSL_key_update(ssl_.get(), SSL_KEY_UPDATE_NOT_REQUESTED);
      SSL_do_handshake(ssl_.get());
    }
  }

  raw_socket raw;
  std::string text;
  std::string fault;
  bool ended_well = false;

 private:
  void note(int outcome) {
    const int what = SSL_get_error(ssl_.get(), outcome);
    if (what == SSL_ERROR_WANT_READ || what == SSL_ERROR_WANT_WRITE) return;
    const char* const words = ERR_reason_error_string(ERR_peek_last_error());
    fault = words != nullptr ? words : "lost";
  }

  context_ptr context_;
  ssl_ptr ssl_;
};

// A server of ours and a client, turned together.
struct two_ends {
  std::unique_ptr<socket_transport> server;
  std::unique_ptr<socket_transport> client;
  driver drive;
  recording_sink& at_client;
  std::vector<std::string> told; // the names of certificates

  two_ends(const tls_options& serving, const tls_options& showing, std::string_view host = "127.0.0.1")
      : server{listening({.tls = serving})},
        client{connecting({.host = host, .port = server->port(), .secure = true, .tls = showing})},
        drive{*server},
        at_client{drive.add(*client)} {
    drive.sink().when_asked = [this](const service::credentials& shown) -> service::admit_answer {
      told.emplace_back(shown.certificate);
      return {};
    };
    client->connect();
  }
  bool connected() {
    EXPECT_TRUE(drive.until([&] { return !at_client.opens.empty() || !at_client.rejections.empty(); }));
    return !at_client.opens.empty();
  }
  std::string fault() const { return at_client.rejections.empty() ? "" : at_client.rejections[0].what; }
  std::string remedy() const { return at_client.rejections.empty() ? "" : at_client.rejections[0].remedy; }
};

// What a transport has counted of TLS.
inline std::uint64_t count_of(const socket_transport& of, service::counter which) {
  return of.memory().tls->read(which);
}
inline std::uint64_t failed_handshakes(const socket_transport& of) {
  using enum service::counter;
  std::uint64_t sum = 0;
  for (const auto one :
       {tls_failed_plain, tls_failed_silent, tls_failed_timeout, tls_failed_lost, tls_failed_certificate,
        tls_failed_protocol, tls_failed_evicted, tls_failed_resources})
    sum += count_of(of, one);
  return sum;
}

// Whether a client's handshake is done, and its request sent.
inline bool asks(driver& drive, tls_socket& client, std::string_view text) {
  return drive.until([&] { return client.shaken() || client.failed(); }) && !client.failed() &&
         client.send(text);
}

} // namespace rowe::net
