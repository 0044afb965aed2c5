// SPDX-License-Identifier: Apache-2.0
#include "net/tls/context.hpp"

#include <charconv>
#include <string_view>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/sha.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include "net/tls/files.hpp"

namespace rowe::net::tls {
namespace {

// With these, one way to exchange keys costs a server 0.3 ms; with P-384 it would be 3 ms.
constexpr const char* groups = "X25519:P-256";
constexpr const char* ciphers = "ECDHE+AESGCM:ECDHE+CHACHA20"; // of TLS 1.2
constexpr int chain_depth_max = 4;
// What a client's certificates may take together. Each that is in a handshake may hold so much of ours.
constexpr long client_chain_bytes_max = 16384;

struct failure {
  file_fault* why;
  bool operator()(const std::string& file, std::string_view what) const {
    if (why != nullptr) *why = {file, std::string{what}};
    ERR_clear_error();
    return false;
  }
};

std::string reason() {
  const unsigned long code = ERR_peek_last_error();
  const char* const words = code != 0 ? ERR_reason_error_string(code) : nullptr;
  return words != nullptr ? words : "unknown";
}

using bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using private_key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

bio reader_of(std::string_view text) noexcept {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free};
}

// An encrypted key is refused: nobody is there to be asked for a password.
int no_password(char*, int, int, void*) noexcept { return -1; }

std::time_t end_of(const X509* one) noexcept {
  std::tm parts{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(one), &parts) != 1) return 0;
  return ::timegm(&parts);
}

bool use_chain(SSL_CTX* to, const tls_options& options, std::time_t& ends_at, const failure& fail) {
  std::string text;
  if (const std::string fault = read_file(options.certificate, readers::anybody, text); !fault.empty())
    return fail(options.certificate, fault);
  const bio from = reader_of(text);
  const certificate own{PEM_read_bio_X509_AUX(from.get(), nullptr, &no_password, nullptr), &X509_free};
  if (!own) return fail(options.certificate, "it holds no certificate in PEM");
  if (SSL_CTX_use_certificate(to, own.get()) != 1) return fail(options.certificate, reason());
  ends_at = end_of(own.get());
  while (X509* const next = PEM_read_bio_X509(from.get(), nullptr, &no_password, nullptr)) {
    if (SSL_CTX_add0_chain_cert(to, next) == 1) continue; // it is the context's now
    X509_free(next);
    return fail(options.certificate, reason());
  }
  ERR_clear_error(); // that there is no further one
  return true;
}

bool use_key(SSL_CTX* to, const tls_options& options, const failure& fail) {
  if (options.key.empty()) return fail(options.certificate, "a certificate needs its key: set `key`");
  std::string text;
  if (const std::string fault = read_file(options.key, readers::owner, text); !fault.empty())
    return fail(options.key, fault);
  private_key key{nullptr, &EVP_PKEY_free};
  {
    const bio from = reader_of(text);
    key.reset(PEM_read_bio_PrivateKey(from.get(), nullptr, &no_password, nullptr));
  }
  OPENSSL_cleanse(text.data(), text.size());
  if (!key) return fail(options.key, "it holds no unencrypted private key in PEM");
  if (SSL_CTX_use_PrivateKey(to, key.get()) != 1)
    return fail(options.key, "it is not the key of " + options.certificate);
  return true;
}

bool trust(SSL_CTX* to, const std::string& file, const failure& fail) {
  std::string text;
  if (const std::string fault = read_file(file, readers::anybody, text); !fault.empty())
    return fail(file, fault);
  const bio from = reader_of(text);
  int count = 0;
  while (X509* const next = PEM_read_bio_X509(from.get(), nullptr, &no_password, nullptr)) {
    const certificate owned{next, &X509_free};
    if (X509_STORE_add_cert(SSL_CTX_get_cert_store(to), next) == 1) ++count;
  }
  ERR_clear_error();
  return count != 0 || fail(file, "it holds no certificate in PEM");
}

// Certificates of clients name persons and programs, not hosts. So their common names are not held against
// what a root may vouch for of hosts. What is asked for names the roots: a browser that has no certificate of
// theirs does not ask its user.
bool ask_clients(SSL_CTX* with, const std::string& file, const failure& fail) {
  if (!trust(with, file, fail)) return false;
  const auto* const roots = X509_STORE_get0_objects(SSL_CTX_get_cert_store(with)); // nobody else has it yet
  for (int i = 0; i < sk_X509_OBJECT_num(roots); ++i) {
    X509* const root = X509_OBJECT_get0_X509(sk_X509_OBJECT_value(roots, i));
    if (root != nullptr && SSL_CTX_add_client_CA(with, root) != 1) return fail(file, reason());
  }
  X509_VERIFY_PARAM* const how = SSL_CTX_get0_param(with);
  X509_VERIFY_PARAM_set_flags(how, X509_V_FLAG_PARTIAL_CHAIN);
  X509_VERIFY_PARAM_set_hostflags(how, X509_CHECK_FLAG_NEVER_CHECK_SUBJECT);
  SSL_CTX_set_max_cert_list(with, client_chain_bytes_max);
  SSL_CTX_set_verify(with, SSL_VERIFY_PEER | SSL_VERIFY_CLIENT_ONCE, nullptr);
  return true;
}

int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* bytes, const unsigned char* offered,
                    unsigned offered_bytes, void*) noexcept {
  static constexpr unsigned char ours[] = "\x08http/1.1"; // never h2: it has ways around every filter
  unsigned char* found = nullptr;
  const int outcome = SSL_select_next_proto(&found, bytes, ours, sizeof ours - 1, offered, offered_bytes);
  *chosen = found;
  return outcome == OPENSSL_NPN_NEGOTIATED ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_ALERT_FATAL;
}

bool harden(SSL_CTX* to) noexcept {
  SSL_CTX_set_options(to, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_NO_TICKET |
                              SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_PRIORITIZE_CHACHA);
  SSL_CTX_set_session_cache_mode(to, SSL_SESS_CACHE_OFF);
  // Our own chain is what its file says. Else OpenSSL would look for it among the roots of the others, in
  // each handshake.
  SSL_CTX_set_mode(to, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                           SSL_MODE_NO_AUTO_CHAIN);
  SSL_CTX_clear_mode(to, SSL_MODE_RELEASE_BUFFERS); // it would allocate two buffers for each message
  SSL_CTX_set_read_ahead(to, 0);
  SSL_CTX_set_verify_depth(to, chain_depth_max);
  SSL_CTX_set_default_passwd_cb(to, &no_password);
  return SSL_CTX_set_min_proto_version(to, TLS1_2_VERSION) == 1 && SSL_CTX_set_max_early_data(to, 0) == 1 &&
         SSL_CTX_set_num_tickets(to, 0) == 1 && SSL_CTX_set_cipher_list(to, ciphers) == 1 &&
         SSL_CTX_set1_groups_list(to, groups) == 1;
}

// The bytes that 64 hexadecimal digits stand for, or 32 pairs of them with colons between; nothing for any
// other text.
std::optional<std::array<unsigned char, 32>> hash_of_hex(std::string_view text) noexcept {
  std::array<unsigned char, 32> bytes{};
  const bool colons = text.size() == 3 * bytes.size() - 1;
  if (!colons && text.size() != 2 * bytes.size()) return std::nullopt;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (colons && i != 0 && text[3 * i - 1] != ':') return std::nullopt;
    const char* const digits = text.data() + (colons ? 3 : 2) * i;
    const auto read = std::from_chars(digits, digits + 2, bytes[i], 16);
    if (read.ec != std::errc{} || read.ptr != digits + 2) return std::nullopt;
  }
  return bytes;
}

} // namespace

context::~context() { SSL_CTX_free(context_); }

std::shared_ptr<const context> context::open(end ours, const tls_options& options, file_fault* why) {
  const failure fail{why};
  const bool serves = ours == end::server;
  std::shared_ptr<context> made{new context};
  made->context_ = SSL_CTX_new(serves ? TLS_server_method() : TLS_client_method());
  if (made->context_ == nullptr || !harden(made->context_)) {
    fail("OpenSSL", reason());
    return nullptr;
  }
  SSL_CTX* const with = made->context_;
  const bool has_own = serves || !options.certificate.empty();
  if (has_own && (!use_chain(with, options, made->ends_at_, fail) || !use_key(with, options, fail)))
    return nullptr;
  if (serves) {
    SSL_CTX_set_alpn_select_cb(with, &choose_protocol, nullptr);
    made->asks_clients_ = !options.client_ca.empty();
    if (made->asks_clients_ && !ask_clients(with, options.client_ca, fail)) return nullptr;
    return made;
  }
  if (!options.pin.empty()) {
    made->pin_ = hash_of_hex(options.pin);
    if (!made->pin_) {
      fail("pin \"" + options.pin + '"', "it must be 64 hexadecimal digits");
      return nullptr;
    }
    if (options.ca.empty()) return made; // the key says enough
  }
  SSL_CTX_set_verify(with, SSL_VERIFY_PEER, nullptr);
  // A robot's own certificate may be the root that is given.
  X509_VERIFY_PARAM_set_flags(SSL_CTX_get0_param(with), X509_V_FLAG_PARTIAL_CHAIN);
  if (options.ca.empty()) {
    if (SSL_CTX_set_default_verify_paths(with) != 1) {
      fail("the system's certificates", reason());
      return nullptr;
    }
  } else if (!trust(with, options.ca, fail)) {
    return nullptr;
  }
  return made;
}

bool context::accepts(const ssl_st* connection) const noexcept {
  if (!pin_) return true;
  X509* const shown = SSL_get0_peer_certificate(connection);
  unsigned char* encoded = nullptr;
  const int bytes = shown != nullptr ? i2d_X509_PUBKEY(X509_get_X509_PUBKEY(shown), &encoded) : -1;
  if (bytes < 0) return false;
  std::array<unsigned char, 32> hash{};
  const bool hashed = SHA256(encoded, static_cast<std::size_t>(bytes), hash.data()) != nullptr;
  OPENSSL_free(encoded);
  return hashed && hash == *pin_;
}

} // namespace rowe::net::tls

namespace rowe {

std::string check_tls(const tls_options& options) {
  net::tls::file_fault why;
  const auto text = [&] { return why.file + ": " + why.what; };
  if (!options.certificate.empty() && !net::tls::context::open(net::tls::end::server, options, &why))
    return text();
  if (options.certificate.empty() && !options.key.empty())
    return options.key + ": a key without its certificate: set `certificate`";
  if (options.certificate.empty() && !options.client_ca.empty())
    return options.client_ca + ": clients show certificates to a server that has one: set `certificate`";
  if ((!options.ca.empty() || !options.pin.empty()) &&
      !net::tls::context::open(net::tls::end::client, options, &why))
    return text();
  return {};
}

} // namespace rowe
