// SPDX-License-Identifier: Apache-2.0
#include "net/tls/session.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include "net/base/address.hpp"
#include "net/base/socket_options.hpp"
#include "net/tls/context.hpp"

namespace rowe::net::tls {

// How OpenSSL reaches the socket. Its own way would raise SIGPIPE, and stores no tail.
struct session_bio {
  static session& of(BIO* bio) noexcept { return *static_cast<session*>(BIO_get_data(bio)); }

  static int write(BIO* bio, const char* from, int bytes) noexcept {
    BIO_clear_retry_flags(bio);
    const int sent = of(bio).send_or_keep(from, bytes);
    if (sent < 0 && of(bio).broken_ == 0) BIO_set_retry_write(bio);
    return sent;
  }

  static int read(BIO* bio, char* to, int bytes) noexcept {
    BIO_clear_retry_flags(bio);
    session& one = of(bio);
    const int got = one.established_ ? one.from_stage(to, bytes) : one.from_socket(to, bytes);
    if (got < 0 && one.unreadable_ == 0) BIO_set_retry_read(bio);
    return got;
  }

  // By BIO_CTRL_EOF OpenSSL 3 distinguishes an end from an error.
  static long control(BIO* bio, int what, long, void*) noexcept {
    if (what == BIO_CTRL_EOF) return of(bio).end_seen_ ? 1 : 0;
    return what == BIO_CTRL_FLUSH ? 1 : 0;
  }

  // Behind the handshake, OpenSSL's state machine runs when the peer takes new keys, and never else.
  static void note(const SSL* ssl, int where, int) noexcept {
    auto* const one = static_cast<session*>(SSL_get_app_data(ssl));
    if ((where & SSL_CB_LOOP) != 0 && one->established_) ++one->steps_;
  }

  static BIO_METHOD* method() noexcept {
    static BIO_METHOD* const made = [] {
      BIO_METHOD* const one = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "rowe");
      if (one == nullptr) return one;
      BIO_meth_set_write(one, &session_bio::write);
      BIO_meth_set_read(one, &session_bio::read);
      BIO_meth_set_ctrl(one, &session_bio::control);
      return one;
    }();
    return made;
  }
};

namespace {

// A certificate names either hosts or addresses.
bool expect(SSL* ssl, const char* remote) noexcept {
  static constexpr unsigned char protocol[] = "\x08http/1.1";
  if (SSL_set_alpn_protos(ssl, protocol, sizeof protocol - 1) != 0) return false;
  if (numeric_address(remote, 0)) {
    return X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), remote) == 1; // no server name: RFC 6066, 3
  }
  SSL_set_hostflags(ssl, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  return SSL_set1_host(ssl, remote) == 1 &&
         SSL_ctrl(ssl, SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name, const_cast<char*>(remote)) ==
             1;
}

// Printable ASCII is the same in all kinds of text that a name may be written in, but for the wide ones.
bool copy_printable(const ASN1_STRING* from, std::span<char> out, std::size_t& bytes) noexcept {
  const int kind = ASN1_STRING_type(from);
  const auto length = static_cast<std::size_t>(ASN1_STRING_length(from));
  if (kind == V_ASN1_BMPSTRING || kind == V_ASN1_UNIVERSALSTRING || length == 0 || length > out.size())
    return false;
  const unsigned char* const text = ASN1_STRING_get0_data(from);
  if (!std::all_of(text, text + length, [](unsigned char c) { return c >= 0x20 && c < 0x7f; })) return false;
  std::copy(text, text + length, out.begin());
  bytes = length;
  return true;
}

// Whether the newest error says that the other end refused our certificate, or that there was none of its.
bool is_about_certificate() noexcept {
  switch (ERR_GET_REASON(ERR_peek_last_error())) {
  case SSL_R_SSLV3_ALERT_NO_CERTIFICATE:
  case SSL_R_SSLV3_ALERT_BAD_CERTIFICATE:
  case SSL_R_SSLV3_ALERT_UNSUPPORTED_CERTIFICATE:
  case SSL_R_SSLV3_ALERT_CERTIFICATE_REVOKED:
  case SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED:
  case SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN:
  case SSL_R_TLSV1_ALERT_UNKNOWN_CA:
  case SSL_R_TLSV1_ALERT_DECRYPT_ERROR: // its signature
  case SSL_R_TLSV13_ALERT_CERTIFICATE_REQUIRED:
  case SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE: return true;
  default: return false;
  }
}

constexpr const char* remedy_of_servers =
    "a browser must accept the certificate first; other clients need its root";
constexpr const char* remedy_of_pins =
    "compare --pin (client.pin) with what `rowe doctor --certificate` says of the server's";

// What a client does about a server's certificate that was found to be wrong.
const char* remedy_of_certificate(long verified) noexcept {
  switch (verified) {
  case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
  case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
  case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
  case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
  case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
  case X509_V_ERR_CERT_SIGNATURE_FAILURE: // of another root that is called the same
    return "give the root that signed it: --ca FILE ($ROWE_CA, client.ca)";
  case X509_V_ERR_HOSTNAME_MISMATCH:
  case X509_V_ERR_IP_ADDRESS_MISMATCH: return "connect by a name or an address that its certificate has";
  case X509_V_ERR_CERT_NOT_YET_VALID: return "set the clock of this machine, or that of the server";
  case X509_V_ERR_CERT_HAS_EXPIRED: return "renew the server's certificate, or set the clock of this machine";
  default: return "the server needs another certificate";
  }
}

// What a client does where the newest error ended the handshake.
const char* remedy_of_client() noexcept {
  return is_about_certificate() ? "the server refuses our certificate: give one that it takes, by --cert "
                                  "FILE ($ROWE_CERT, tls.certificate)"
                                : "check that this port speaks TLS; else connect to ws://";
}

const char* newest_reason() noexcept {
  const unsigned long code = ERR_peek_last_error();
  const char* const words = code != 0 ? ERR_reason_error_string(code) : nullptr;
  return words != nullptr ? words : "the connection was lost";
}

} // namespace

session::session(std::shared_ptr<const context> with, descriptor socket) noexcept
    : with_{std::move(with)}, socket_{std::move(socket)} {}

std::unique_ptr<session> session::open(std::shared_ptr<const context> with, descriptor socket,
                                       const char* remote) noexcept {
  std::unique_ptr<session> made{new (std::nothrow) session{std::move(with), std::move(socket)}};
  if (!made) return nullptr;
  made->ssl_ = SSL_new(made->with_->get());
  BIO_METHOD* const method = session_bio::method();
  BIO* const bio = method != nullptr ? BIO_new(method) : nullptr;
  if (made->ssl_ == nullptr || bio == nullptr) {
    BIO_free(bio);
    return nullptr;
  }
  BIO_set_data(bio, made.get());
  BIO_set_init(bio, 1);
  SSL_set_bio(made->ssl_, bio, bio);
  SSL_set_app_data(made->ssl_, made.get());
  SSL_set_info_callback(made->ssl_, &session_bio::note);
  if (remote == nullptr) {
    SSL_set_accept_state(made->ssl_);
  } else {
    SSL_set_connect_state(made->ssl_);
    if (!expect(made->ssl_, remote)) return nullptr;
  }
  return made;
}

std::string_view session::client_name(std::span<char> out) const noexcept {
  const X509* const shown = with_->asks_clients() ? SSL_get0_peer_certificate(ssl_) : nullptr;
  if (shown == nullptr || SSL_get_verify_result(ssl_) != X509_V_OK) return {};
  const X509_NAME* const subject = X509_get_subject_name(shown);
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (at < 0 || X509_NAME_get_index_by_NID(subject, NID_commonName, at) >= 0) return {};
  std::size_t bytes = 0;
  const ASN1_STRING* const name = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at));
  return copy_printable(name, out, bytes) ? std::string_view{out.data(), bytes} : std::string_view{};
}

session::~session() { SSL_free(ssl_); }

session::progress session::shake() noexcept {
  ERR_clear_error();
  const int outcome = SSL_do_handshake(ssl_);
  if (outcome == 1 && !with_->accepts(ssl_)) {
    reason_ = "the server's key is not the one that is pinned";
    remedy_ = remedy_of_pins;
    failed_by_ = service::counter::tls_failed_certificate;
    return progress::failed;
  }
  if (outcome == 1) {
    established_ = true;
    return progress::done;
  }
  switch (SSL_get_error(ssl_, outcome)) {
  case SSL_ERROR_WANT_READ: return progress::wants_read;
  case SSL_ERROR_WANT_WRITE: return progress::wants_write;
  default: break;
  }
  const long verified = SSL_get_verify_result(ssl_);
  reason_ = verified != X509_V_OK ? X509_verify_cert_error_string(verified) : newest_reason();
  remedy_ = SSL_is_server(ssl_) != 0 ? remedy_of_servers
            : verified != X509_V_OK  ? remedy_of_certificate(verified)
                                     : remedy_of_client();
  if (verified != X509_V_OK || is_about_certificate())
    failed_by_ = service::counter::tls_failed_certificate;
  else if (end_seen_ || unreadable_ != 0 || broken_ != 0)
    failed_by_ = service::counter::tls_failed_lost;
  ERR_clear_error();
  return progress::failed;
}

// ---- reading

ssize_t session::read(std::span<std::byte> to, rt::time_point now) noexcept {
  return receive(to, false, now);
}
ssize_t session::peek(std::span<std::byte> to, rt::time_point now) noexcept { return receive(to, true, now); }

bool session::holds_input() const noexcept {
  return stage_begin_ != stage_end_ || SSL_pending(ssl_) > 0 || end_pending_;
}

ssize_t session::receive(std::span<std::byte> to, bool keep, rt::time_point now) noexcept {
  allow_new_keys(now);
  std::size_t budget = to.size();
  std::size_t got = 0;
  bool kernel_has_more = true;
  std::uint32_t records = 0;
  while (got < to.size() && records < records_at_once) {
    ERR_clear_error();
    const auto rest = to.subspan(got);
    std::size_t bytes = 0;
    const int outcome = keep ? SSL_peek_ex(ssl_, rest.data(), rest.size(), &bytes)
                             : SSL_read_ex(ssl_, rest.data(), rest.size(), &bytes);
    if (outcome == 1) {
      got += bytes;
      ++records;
      if (keep) break;
      continue;
    }
    const int what = SSL_get_error(ssl_, outcome);
    if (what != SSL_ERROR_WANT_READ) {
      end_pending_ = got != 0; // the next read() reports it
      return end_pending_ ? static_cast<ssize_t>(got) : cannot_read(what);
    }
    if (budget == 0 || !kernel_has_more) break;
    const std::size_t asked = std::min(budget, stage_.size());
    if (!fill_stage(asked)) break;
    budget -= stage_end_;
    kernel_has_more = end_seen_ || stage_end_ == asked;
  }
  if (got != 0) return static_cast<ssize_t>(got);
  errno = EAGAIN;
  return -1;
}

// An end that the peer did not announce may be somebody's who cuts the stream short.
ssize_t session::cannot_read(int what) noexcept {
  if (what == SSL_ERROR_ZERO_RETURN) return 0;
  if (!cut_by_) {
    const bool lost = end_seen_ || unreadable_ != 0 || broken_ != 0;
    cut_by_ = asks_too_often() ? service::counter::tls_key_floods
              : lost           ? service::counter::tls_cuts
                               : service::counter::tls_alerts;
    reason_ = asks_too_often() ? "it changed its keys too often" : newest_reason();
    remedy_ = remedy_of_client(); // only clients report it
  }
  if (unreadable_ == 0) unreadable_ = end_seen_ ? ECONNRESET : EPROTO;
  ERR_clear_error();
  errno = unreadable_;
  return -1;
}

// False if there is nothing to read yet.
bool session::fill_stage(std::size_t bytes_max) noexcept {
  stage_begin_ = stage_end_ = 0;
  const ssize_t got = ::recv(socket_.get(), stage_.data(), bytes_max, MSG_DONTWAIT);
  if (got > 0) {
    stage_end_ = static_cast<std::size_t>(got);
    return true;
  }
  if (got < 0 && would_block(errno)) return false;
  if (got == 0) {
    end_seen_ = true;
  } else {
    unreadable_ = errno;
  }
  return true; // OpenSSL is to see it
}

int session::from_stage(char* to, int bytes) noexcept {
  if (asks_too_often()) unreadable_ = EPROTO; // this ends the read that is under way
  if (unreadable_ != 0) return -1;
  const std::size_t given = std::min(static_cast<std::size_t>(bytes), stage_end_ - stage_begin_);
  if (given == 0) return end_seen_ ? 0 : -1;
  std::memcpy(to, stage_.data() + stage_begin_, given);
  stage_begin_ += given;
  return static_cast<int>(given);
}

// During the handshake. OpenSSL takes no more than it needs for one record, so nothing is left in a stage.
int session::from_socket(char* to, int bytes) noexcept {
  const ssize_t got = ::recv(socket_.get(), to, static_cast<std::size_t>(bytes), MSG_DONTWAIT);
  if (got == 0) end_seen_ = true;
  if (got < 0 && !would_block(errno)) unreadable_ = errno;
  return static_cast<int>(got);
}

void session::allow_new_keys(rt::time_point now) noexcept {
  if (steps_ == 0) {
    keys_allowed_at_ = now;
    return;
  }
  const auto earned = (now - keys_allowed_at_) / new_keys_period;
  if (earned <= 0) return;
  keys_allowed_at_ += earned * new_keys_period;
  const auto steps = static_cast<std::uint64_t>(earned) * steps_of_new_keys;
  steps_ = steps < steps_ ? steps_ - static_cast<std::uint32_t>(steps) : 0;
}

// ---- writing

std::size_t session::write(std::span<const std::byte> bytes, std::size_t record_bytes) noexcept {
  std::size_t taken = 0;
  while (taken < bytes.size() && broken_ == 0 && flush()) {
    const auto record =
        bytes.subspan(taken, std::min({bytes.size() - taken, record_bytes, record_bytes_max}));
    more_follows_ = taken + record.size() < bytes.size() && record_bytes >= record_bytes_max;
    ERR_clear_error();
    std::size_t sealed = 0;
    if (SSL_write_ex(ssl_, record.data(), record.size(), &sealed) != 1) {
      if (broken_ == 0) broken_ = EPROTO;
      ERR_clear_error();
      break;
    }
    taken += sealed;
  }
  more_follows_ = false;
  return taken;
}

void session::seal(std::span<const std::byte> bytes) noexcept {
  sends_ = false;
  (void)write(bytes.first(std::min(bytes.size(), record_bytes_max)));
  sends_ = true;
}

int session::send_or_keep(const char* from, int bytes) noexcept {
  const auto all = static_cast<std::size_t>(bytes);
  std::size_t sent = 0;
  if (sends_ && !holds_output()) {
    const int more = more_follows_ ? MSG_MORE : 0;
    const ssize_t now = ::send(socket_.get(), from, all, MSG_NOSIGNAL | MSG_DONTWAIT | more);
    if (now < 0 && !has_no_room(errno)) {
      broken_ = errno;
      return -1;
    }
    if (now > 0) sent = static_cast<std::size_t>(now);
  }
  if (!established_) return sent > 0 ? static_cast<int>(sent) : -1;
  if (sent == all) return bytes;
  if (!holds_output()) tail_begin_ = tail_end_ = 0;
  if (all - sent > tail_.size() - tail_end_) { // a peer that makes us talk, and does not listen
    broken_ = ENOBUFS;
    return -1;
  }
  std::memcpy(tail_.data() + tail_end_, from + sent, all - sent);
  tail_end_ += all - sent;
  return bytes;
}

bool session::flush() noexcept {
  if (!holds_output()) return true;
  const ssize_t sent =
      ::send(socket_.get(), tail_.data() + tail_begin_, tail_end_ - tail_begin_, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent > 0) tail_begin_ += static_cast<std::size_t>(sent);
  if (sent < 0 && !has_no_room(errno)) broken_ = errno;
  return !holds_output();
}

void session::finish() noexcept {
  if (broken_ != 0) return;
  ERR_clear_error();
  (void)SSL_shutdown(ssl_); // the peer's own is not waited for
  ERR_clear_error();
}

} // namespace rowe::net::tls
