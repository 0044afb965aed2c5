// SPDX-License-Identifier: Apache-2.0
#include "certificates.hpp"

#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/sha.h>
#include <openssl/x509v3.h>

namespace rowe::test {
namespace {

template <class T, void (*Free)(T*)>
struct freed {
  void operator()(T* one) const noexcept { Free(one); }
};
using certificate_ptr = std::unique_ptr<X509, freed<X509, X509_free>>;
using key_ptr = std::unique_ptr<EVP_PKEY, freed<EVP_PKEY, EVP_PKEY_free>>;

void must(bool done, const char* what) {
  if (!done) throw std::runtime_error{std::string{"cannot make a test certificate: "} + what};
}

struct bio {
  BIO* one = BIO_new(BIO_s_mem());
  bio() = default;
  explicit bio(const std::string& text) : one{BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))} {}
  ~bio() { BIO_free(one); }
  bio(const bio&) = delete;
  bio& operator=(const bio&) = delete;
  std::string text() const {
    char* bytes = nullptr;
    const long count = BIO_get_mem_data(one, &bytes);
    return {bytes, static_cast<std::size_t>(count)};
  }
};

key_ptr new_key() {
  key_ptr key{EVP_EC_gen("P-256")};
  must(key != nullptr, "key");
  return key;
}

key_ptr key_of(const made_certificate& of) {
  const bio from{of.key};
  return key_ptr{PEM_read_bio_PrivateKey(from.one, nullptr, nullptr, nullptr)};
}

certificate_ptr certificate_of(const made_certificate& of) {
  const bio from{of.certificate};
  return certificate_ptr{PEM_read_bio_X509(from.one, nullptr, nullptr, nullptr)};
}

void add_extension(X509* to, X509* issuer, int which, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, to, nullptr, nullptr, 0);
  X509_EXTENSION* const made = X509V3_EXT_conf_nid(nullptr, &context, which, value.c_str());
  must(made != nullptr && X509_add_ext(to, made, -1) == 1, value.c_str());
  X509_EXTENSION_free(made);
}

std::string names_of(const certificate_request& wanted) {
  std::string all;
  for (const std::string& one : wanted.names) all += (all.empty() ? "DNS:" : ",DNS:") + one;
  for (const std::string& one : wanted.addresses) all += (all.empty() ? "IP:" : ",IP:") + one;
  return all;
}

made_certificate make(const certificate_request& wanted, bool is_root, const made_certificate* root) {
  const key_ptr own = new_key();
  certificate_ptr made{X509_new()};
  must(made != nullptr && X509_set_version(made.get(), X509_VERSION_3) == 1, "certificate");
  std::uint32_t serial = 0;
  must(::getrandom(&serial, sizeof serial, 0) == sizeof serial, "serial number");
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(made.get()), serial);
  X509_gmtime_adj(X509_getm_notBefore(made.get()), wanted.valid_from_s);
  X509_gmtime_adj(X509_getm_notAfter(made.get()), wanted.valid_to_s);
  X509_set_pubkey(made.get(), own.get());
  X509_NAME* const subject = X509_get_subject_name(made.get());
  const auto* const name = reinterpret_cast<const unsigned char*>(wanted.common_name.c_str());
  if (!wanted.common_name.empty()) X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, name, -1, -1, 0);
  const auto* const second = reinterpret_cast<const unsigned char*>(wanted.second_common_name.c_str());
  if (!wanted.second_common_name.empty())
    X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, second, -1, -1, 0);

  const certificate_ptr above = root != nullptr ? certificate_of(*root) : nullptr;
  const key_ptr signing = root != nullptr ? key_of(*root) : nullptr;
  X509* const issuer = above ? above.get() : made.get();
  X509_set_issuer_name(made.get(), X509_get_subject_name(issuer));
  add_extension(made.get(), issuer, NID_basic_constraints,
                is_root ? "critical,CA:TRUE" : "critical,CA:FALSE");
  add_extension(made.get(), issuer, NID_key_usage,
                is_root ? "critical,keyCertSign,cRLSign" : "critical,digitalSignature");
  if (!is_root) {
    add_extension(made.get(), issuer, NID_ext_key_usage, wanted.usage);
    if (const std::string names = names_of(wanted); !names.empty())
      add_extension(made.get(), issuer, NID_subject_alt_name, names);
  }
  must(X509_sign(made.get(), signing ? signing.get() : own.get(), EVP_sha256()) > 0, "signature");

  const bio certificate, key;
  must(PEM_write_bio_X509(certificate.one, made.get()) == 1, "text");
  must(PEM_write_bio_PrivateKey(key.one, own.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1, "text");
  return {certificate.text(), key.text()};
}

} // namespace

made_certificate make_root(const std::string& common_name) {
  return make({.names = {}, .addresses = {}, .common_name = common_name}, true, nullptr);
}

made_certificate make_leaf(const made_certificate& root, const certificate_request& wanted) {
  return make(wanted, wanted.is_authority, &root);
}

made_certificate make_self_signed(const certificate_request& wanted) { return make(wanted, false, nullptr); }

std::string pin_of(const made_certificate& of) {
  const certificate_ptr one = certificate_of(of);
  unsigned char* encoded = nullptr;
  const int bytes = i2d_X509_PUBKEY(X509_get_X509_PUBKEY(one.get()), &encoded);
  must(bytes > 0, "public key");
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  SHA256(encoded, static_cast<std::size_t>(bytes), hash.data());
  OPENSSL_free(encoded);
  std::string digits;
  for (const unsigned char byte : hash) {
    digits += "0123456789abcdef"[byte >> 4];
    digits += "0123456789abcdef"[byte & 15];
  }
  return digits;
}

void write_private(const std::string& path, const std::string& text) {
  const std::string next = path + ".next"; // renamed: whoever reads meanwhile finds one or the other whole
  const int file = ::open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  must(file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()), "file");
  ::close(file);
  std::filesystem::rename(next, path);
}

void write_files(const std::string& folder, const made_certificate& root, const made_certificate& leaf) {
  write_private(folder + "/ca.pem", root.certificate);
  write_private(folder + "/certificate.pem", leaf.certificate + root.certificate);
  write_private(folder + "/key.pem", leaf.key);
}

} // namespace rowe::test
