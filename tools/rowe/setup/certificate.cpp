// SPDX-License-Identifier: Apache-2.0
#include "certificate.hpp"

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <span>

#include "../console.hpp"
#include "../network/host_addresses.hpp"

namespace rowe::tools {
namespace {

constexpr std::time_t day = 24 * 60 * 60;

template <auto free>
struct freed_by {
  template <class T>
  void operator()(T* one) const noexcept {
    free(one);
  }
};
using bio = std::unique_ptr<BIO, freed_by<BIO_free_all>>;
using big_number = std::unique_ptr<BIGNUM, freed_by<BN_free>>;
using extension = std::unique_ptr<X509_EXTENSION, freed_by<X509_EXTENSION_free>>;
using general_names = std::unique_ptr<GENERAL_NAMES, freed_by<GENERAL_NAMES_free>>;
using store = std::unique_ptr<X509_STORE, freed_by<X509_STORE_free>>;
using store_context = std::unique_ptr<X509_STORE_CTX, freed_by<X509_STORE_CTX_free>>;
using x509 = std::shared_ptr<X509>;

X509* as_x509(const std::shared_ptr<void>& handle) noexcept { return static_cast<X509*>(handle.get()); }
EVP_PKEY* as_key(const std::shared_ptr<void>& handle) noexcept {
  return static_cast<EVP_PKEY*>(handle.get());
}

// What OpenSSL says went wrong, and nothing of it stays behind.
std::string failed(std::string_view what) {
  std::array<char, 256> text{};
  ERR_error_string_n(ERR_peek_last_error(), text.data(), text.size());
  const bool known = ERR_peek_last_error() != 0;
  ERR_clear_error();
  return joined(what, known ? ": " : "", known ? text.data() : "");
}

bio reading(const std::string& text) {
  return bio{BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))};
}

std::string text_of(const bio& from) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(from.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string{};
}

calendar_time time_of(const ASN1_TIME* when) {
  int days = 0, seconds = 0;
  const std::unique_ptr<ASN1_TIME, freed_by<ASN1_TIME_free>> epoch{ASN1_TIME_set(nullptr, 0)};
  ASN1_TIME_diff(&days, &seconds, epoch.get(), when);
  return calendar_time{std::chrono::days{days} + std::chrono::seconds{seconds}};
}

bool extend(X509* to, X509* issuer, int what, const std::string& text) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, to, nullptr, nullptr, 0);
  const extension made{X509V3_EXT_conf_nid(nullptr, &context, what, text.c_str())};
  return made != nullptr && X509_add_ext(to, made.get(), -1) == 1;
}

bool call_it(X509* one, const char* field, const std::string& text) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text.data());
  return X509_NAME_add_entry_by_txt(X509_get_subject_name(one), field, MBSTRING_UTF8, bytes,
                                    static_cast<int>(text.size()), -1, 0) == 1;
}

// 127 random bits, and never 0: some verifiers refuse a serial number twice, or a negative one.
bool number_it(X509* one) {
  std::array<unsigned char, 16> bytes;
  if (RAND_bytes(bytes.data(), bytes.size()) != 1) return false;
  bytes[0] = static_cast<unsigned char>((bytes[0] & 0x3f) | 0x40);
  const big_number number{BN_bin2bn(bytes.data(), bytes.size(), nullptr)};
  return number && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(one)) != nullptr;
}

struct identity_of {
  std::string organisation;
  std::string name;
};

x509 blank(const identity_of& whose, EVP_PKEY* key, std::time_t begin, std::time_t end) {
  x509 one{X509_new(), X509_free};
  const bool good = one && X509_set_version(one.get(), X509_VERSION_3) == 1 && number_it(one.get()) &&
                    X509_time_adj_ex(X509_getm_notBefore(one.get()), 0, 0, &begin) != nullptr &&
                    X509_time_adj_ex(X509_getm_notAfter(one.get()), 0, 0, &end) != nullptr &&
                    call_it(one.get(), "O", whose.organisation) && call_it(one.get(), "CN", whose.name) &&
                    X509_set_pubkey(one.get(), key) == 1;
  return good ? one : nullptr;
}

std::string alternative_names(const host_names& names) {
  std::string text;
  for (const std::string& one : names.names) text.append(text.empty() ? "DNS:" : ",DNS:").append(one);
  for (const std::string& one : names.addresses) text.append(text.empty() ? "IP:" : ",IP:").append(one);
  return text;
}

// What the other side, which trusts the root, would say at that time; empty: that it is good.
std::string verify(X509* root, X509* leaf, std::time_t when, bool of_client) {
  const store trusted{X509_STORE_new()};
  const store_context context{X509_STORE_CTX_new()};
  if (!trusted || !context || X509_STORE_add_cert(trusted.get(), root) != 1 ||
      X509_STORE_CTX_init(context.get(), trusted.get(), leaf, nullptr) != 1)
    return failed("it cannot be verified");
  X509_VERIFY_PARAM* const asked = X509_STORE_CTX_get0_param(context.get());
  X509_VERIFY_PARAM_set_purpose(asked, of_client ? X509_PURPOSE_SSL_CLIENT : X509_PURPOSE_SSL_SERVER);
  if (of_client) X509_VERIFY_PARAM_set_hostflags(asked, X509_CHECK_FLAG_NEVER_CHECK_SUBJECT);
  X509_VERIFY_PARAM_set_time(asked, when);
  if (X509_verify_cert(context.get()) == 1) return {};
  ERR_clear_error();
  return X509_verify_cert_error_string(X509_STORE_CTX_get_error(context.get()));
}

std::string hex(std::span<const unsigned char> bytes, std::string_view digits, std::string_view between) {
  std::string text;
  for (const unsigned char byte : bytes) {
    if (!text.empty()) text += between;
    text += digits[byte >> 4];
    text += digits[byte & 0xf];
  }
  return text;
}

std::string address_text(const ASN1_OCTET_STRING& bytes) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool six = bytes.length == 16;
  if (!six && bytes.length != 4) return {};
  ::inet_ntop(six ? AF_INET6 : AF_INET, bytes.data, text.data(), text.size());
  return text.data();
}

} // namespace

std::optional<private_key> private_key::make(std::string& wrong) {
  std::shared_ptr<void> handle{EVP_EC_gen("P-256"),
                               [](void* one) { EVP_PKEY_free(static_cast<EVP_PKEY*>(one)); }};
  if (handle) return private_key{std::move(handle)};
  wrong = failed("a key cannot be made");
  return std::nullopt;
}

std::optional<private_key> private_key::read(const std::string& pem, std::string& wrong) {
  // A key with a password would ask for it on the terminal.
  const auto no_password = [](char*, int, int, void*) { return -1; };
  EVP_PKEY* const found = PEM_read_bio_PrivateKey(reading(pem).get(), nullptr, no_password, nullptr);
  std::shared_ptr<void> handle{found, [](void* one) { EVP_PKEY_free(static_cast<EVP_PKEY*>(one)); }};
  if (handle) return private_key{std::move(handle)};
  wrong = failed("it has no private key, or one with a password");
  return std::nullopt;
}

std::string private_key::pem() const {
  const bio to{BIO_new(BIO_s_secmem())}; // overwritten when it is freed
  PEM_write_bio_PKCS8PrivateKey(to.get(), as_key(handle_), nullptr, nullptr, 0, nullptr, nullptr);
  return text_of(to);
}

std::optional<certificate> certificate::read(const std::string& pem, std::string& wrong) {
  x509 found{PEM_read_bio_X509(reading(pem).get(), nullptr, nullptr, nullptr), X509_free};
  if (found) return certificate{std::move(found)};
  wrong = failed("it has no certificate");
  return std::nullopt;
}

std::string certificate::pem() const {
  const bio to{BIO_new(BIO_s_mem())};
  PEM_write_bio_X509(to.get(), as_x509(handle_));
  return text_of(to);
}

std::string certificate::der() const {
  const bio to{BIO_new(BIO_s_mem())};
  i2d_X509_bio(to.get(), as_x509(handle_));
  return text_of(to);
}

calendar_time certificate::begin() const { return time_of(X509_get0_notBefore(as_x509(handle_))); }
calendar_time certificate::end() const { return time_of(X509_get0_notAfter(as_x509(handle_))); }

std::string certificate::common_name() const {
  std::array<char, 128> text{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(as_x509(handle_)), NID_commonName, text.data(),
                            text.size());
  return text.data();
}

host_names certificate::names() const {
  host_names all;
  void* const found = X509_get_ext_d2i(as_x509(handle_), NID_subject_alt_name, nullptr, nullptr);
  const general_names list{static_cast<GENERAL_NAMES*>(found)};
  for (int at = 0; at < sk_GENERAL_NAME_num(list.get()); ++at) {
    const GENERAL_NAME& one = *sk_GENERAL_NAME_value(list.get(), at);
    if (one.type == GEN_DNS) {
      const auto* const text = reinterpret_cast<const char*>(ASN1_STRING_get0_data(one.d.dNSName));
      all.names.emplace_back(text, static_cast<std::size_t>(ASN1_STRING_length(one.d.dNSName)));
    } else if (one.type == GEN_IPADD) {
      all.addresses.push_back(address_text(*one.d.iPAddress));
    }
  }
  return all;
}

std::string certificate::fingerprint() const {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned size = 0;
  X509_digest(as_x509(handle_), EVP_sha256(), digest.data(), &size);
  return hex(std::span{digest}.first(size), "0123456789ABCDEF", ":");
}

std::string certificate::pin() const {
  unsigned char* encoded = nullptr;
  const int bytes = i2d_X509_PUBKEY(X509_get_X509_PUBKEY(as_x509(handle_)), &encoded);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned size = 0;
  const bool made = bytes > 0 && EVP_Digest(encoded, static_cast<std::size_t>(bytes), digest.data(), &size,
                                            EVP_sha256(), nullptr) == 1;
  OPENSSL_free(encoded);
  return made ? hex(std::span{digest}.first(size), "0123456789abcdef", "") : std::string{};
}

bool certificate::belongs_to(const private_key& key) const {
  const bool same = X509_check_private_key(as_x509(handle_), as_key(key.handle_)) == 1;
  ERR_clear_error();
  return same;
}

std::optional<root_authority> root_authority::make(const std::string& robot, const host_names& names,
                                                   calendar_time now, int days, std::string& wrong) {
  auto key = private_key::make(wrong);
  if (!key) return std::nullopt;
  const std::time_t time = now.time_since_epoch().count();
  const x509 root =
      blank({"rowe", joined("root of ", robot)}, as_key(key->handle_), time - day, time + days * day);
  X509* const own = root.get();
  const bool good = root && X509_set_issuer_name(own, X509_get_subject_name(own)) == 1 &&
                    extend(own, own, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") &&
                    extend(own, own, NID_key_usage, "critical,keyCertSign,cRLSign") &&
                    extend(own, own, NID_subject_key_identifier, "hash") &&
                    extend(own, own, NID_name_constraints, name_constraints(names)) &&
                    X509_sign(own, as_key(key->handle_), EVP_sha256()) > 0;
  if (good) return root_authority{certificate{root}, std::move(*key)};
  wrong = failed("the root cannot be made");
  return std::nullopt;
}

std::optional<root_authority> root_authority::read(const std::string& certificate_pem,
                                                   const std::string& key_pem, std::string& wrong) {
  auto own = certificate::read(certificate_pem, wrong);
  if (!own) return std::nullopt;
  auto key = private_key::read(key_pem, wrong);
  if (!key) return std::nullopt;
  if (own->belongs_to(*key)) return root_authority{std::move(*own), std::move(*key)};
  wrong = "its key is that of another root";
  return std::nullopt;
}

// Tries it, so that the answer is the verifier's own.
bool root_authority::may_vouch_for(const std::string& name) const {
  std::string wrong;
  host_names only;
  (is_address(name) ? only.addresses : only.names).push_back(name);
  return sign("trial", only, key_, own_.begin() + std::chrono::days{1}, 1, wrong).has_value();
}

struct root_authority::wanted {
  const std::string& name;
  const host_names* hosts; // none: it is a client's
};

std::optional<certificate> root_authority::sign(const std::string& robot, const host_names& names,
                                                const private_key& key, calendar_time now, int days,
                                                std::string& wrong) const {
  return issue({robot, &names}, key, now, days, wrong);
}

std::optional<certificate> root_authority::sign_client(const std::string& name, const private_key& key,
                                                       calendar_time now, int days,
                                                       std::string& wrong) const {
  return issue({name, nullptr}, key, now, days, wrong);
}

std::optional<certificate> root_authority::issue(const wanted& what, const private_key& key,
                                                 calendar_time now, int days, std::string& wrong) const {
  const bool of_client = what.hosts == nullptr;
  X509* const issuer = as_x509(own_.handle_);
  const std::time_t time = now.time_since_epoch().count();
  const std::time_t root_begin = own_.begin().time_since_epoch().count();
  const std::time_t root_end = own_.end().time_since_epoch().count();
  const x509 made = blank({"rowe", what.name}, as_key(key.handle_), std::max(time - day, root_begin),
                          std::min(time + days * day, root_end));
  X509* const leaf = made.get();
  const bool good =
      made && X509_set_issuer_name(leaf, X509_get_subject_name(issuer)) == 1 &&
      extend(leaf, issuer, NID_basic_constraints, "critical,CA:FALSE") &&
      extend(leaf, issuer, NID_key_usage, "critical,digitalSignature") &&
      extend(leaf, issuer, NID_ext_key_usage, of_client ? "clientAuth" : "serverAuth") &&
      extend(leaf, issuer, NID_subject_key_identifier, "hash") &&
      extend(leaf, issuer, NID_authority_key_identifier, "keyid:always") &&
      (of_client || extend(leaf, issuer, NID_subject_alt_name, alternative_names(*what.hosts))) &&
      X509_sign(leaf, as_key(key_.handle_), EVP_sha256()) > 0;
  if (!good) {
    wrong = failed("the certificate cannot be made");
  } else if (const std::string refused = verify(issuer, leaf, time, of_client); !refused.empty()) {
    wrong = joined(of_client ? "servers" : "clients", " would refuse the certificate: ", refused);
  } else {
    return certificate{made};
  }
  return std::nullopt;
}

} // namespace rowe::tools
