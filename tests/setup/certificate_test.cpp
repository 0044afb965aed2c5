// SPDX-License-Identifier: Apache-2.0
// OpenSSL's verifier is the judge, as a client asks it: with the root alone, a name or an address, and a
// time.
#include "tools/rowe/setup/certificate.hpp"

#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include "tools/rowe/network/host_addresses.hpp"

namespace rowe::tools {
namespace certificate_test {
namespace {

using namespace std::chrono_literals;

constexpr calendar_time today{std::chrono::sys_days{std::chrono::year{2026} / 11 / 25}};
const host_names own{.names = {"localhost", "ang-01.local", "gate.example"},
                     .addresses = {"127.0.0.1", "::1", "192.168.1.5", "203.0.113.7", "2001:db8::7"}};

using x509 = std::unique_ptr<X509, decltype(&X509_free)>;

x509 parsed(const std::string& pem) {
  BIO* const from = BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()));
  x509 made{PEM_read_bio_X509(from, nullptr, nullptr, nullptr), X509_free};
  BIO_free(from);
  return made;
}

// What a client says of `leaf`; "ok" if it connects.
std::string verdict(const certificate& root, const certificate& leaf, const std::string& name,
                    calendar_time when = today, int purpose = X509_PURPOSE_SSL_SERVER) {
  const x509 trusted = parsed(root.pem());
  const x509 offered = parsed(leaf.pem());
  X509_STORE* const store = X509_STORE_new();
  X509_STORE_add_cert(store, trusted.get());
  X509_STORE_CTX* const context = X509_STORE_CTX_new();
  X509_STORE_CTX_init(context, store, offered.get(), nullptr);
  X509_VERIFY_PARAM* const asked = X509_STORE_CTX_get0_param(context);
  X509_VERIFY_PARAM_set_purpose(asked, purpose);
  X509_VERIFY_PARAM_set_time(asked, when.time_since_epoch().count());
  X509_VERIFY_PARAM_set_flags(asked, X509_V_FLAG_X509_STRICT);
  const int set = is_address(name) ? X509_VERIFY_PARAM_set1_ip_asc(asked, name.c_str())
                                   : X509_VERIFY_PARAM_set1_host(asked, name.data(), name.size());
  const bool good = set == 1 && X509_verify_cert(context) == 1;
  const std::string said = good ? "ok" : X509_verify_cert_error_string(X509_STORE_CTX_get_error(context));
  X509_STORE_CTX_free(context);
  X509_STORE_free(store);
  return said;
}

struct made {
  root_authority root;
  private_key key;
  certificate leaf;
};

made make(int root_days = 397, int days = 397, const host_names& names = own) {
  std::string wrong;
  auto root = root_authority::make("ang-01", names, today, root_days, wrong);
  auto key = private_key::make(wrong);
  auto leaf = root->sign("ang-01", names, *key, today, days, wrong);
  EXPECT_EQ(wrong, "");
  return {std::move(root).value(), std::move(key).value(), std::move(leaf).value()};
}

TEST(certificate, is_good_for_each_of_its_names_and_addresses) {
  const made m = make();
  for (const std::string& one : own.names) EXPECT_EQ(verdict(m.root.own(), m.leaf, one), "ok") << one;
  for (const std::string& one : own.addresses) EXPECT_EQ(verdict(m.root.own(), m.leaf, one), "ok") << one;
}

TEST(certificate, is_good_for_no_other_name_and_no_other_use) {
  const made m = make();
  EXPECT_EQ(verdict(m.root.own(), m.leaf, "ang-02.local"), "hostname mismatch");
  EXPECT_EQ(verdict(m.root.own(), m.leaf, "a.ang-01.local"), "hostname mismatch");
  EXPECT_EQ(verdict(m.root.own(), m.leaf, "192.168.1.6"), "IP address mismatch");
  EXPECT_NE(verdict(m.root.own(), m.leaf, "localhost", today, X509_PURPOSE_SSL_CLIENT).find("purpose"),
            std::string::npos);
}

TEST(certificate, another_root_knows_nothing_of_it) {
  const made one = make();
  const made other = make();
  EXPECT_NE(verdict(other.root.own(), one.leaf, "localhost"), "ok");
}

TEST(certificate, begins_a_day_back_and_ends_after_its_days) {
  const made m = make();
  EXPECT_EQ(m.leaf.begin(), today - 24h);
  EXPECT_EQ(m.leaf.end(), today + 397 * 24h);
  EXPECT_EQ(verdict(m.root.own(), m.leaf, "localhost", today - 23h), "ok");
  EXPECT_EQ(verdict(m.root.own(), m.leaf, "localhost", today + 396 * 24h), "ok");
  EXPECT_NE(verdict(m.root.own(), m.leaf, "localhost", today - 25h), "ok");
  EXPECT_NE(verdict(m.root.own(), m.leaf, "localhost", today + 398 * 24h), "ok");
}

TEST(certificate, does_not_outlive_its_root) {
  const made m = make(100, 397);
  EXPECT_EQ(m.leaf.end(), m.root.own().end());
}

TEST(certificate, reads_what_it_wrote) {
  const made m = make();
  std::string wrong;
  const auto again = certificate::read(m.leaf.pem(), wrong);
  ASSERT_TRUE(again) << wrong;
  EXPECT_EQ(again->names().names, own.names);
  EXPECT_EQ(again->names().addresses, own.addresses);
  EXPECT_EQ(again->common_name(), "ang-01");
  EXPECT_EQ(again->fingerprint(), m.leaf.fingerprint());
  EXPECT_EQ(m.leaf.fingerprint().size(), 95U);
  const auto key = private_key::read(m.key.pem(), wrong);
  ASSERT_TRUE(key) << wrong;
  EXPECT_TRUE(again->belongs_to(*key));
  EXPECT_FALSE(m.root.own().belongs_to(*key));
}

TEST(certificate, refuses_what_is_none) {
  std::string wrong;
  EXPECT_FALSE(certificate::read("", wrong));
  EXPECT_NE(wrong, "");
  EXPECT_FALSE(certificate::read(make().key.pem(), wrong));
  EXPECT_FALSE(private_key::read(make().leaf.pem(), wrong));
  EXPECT_FALSE(root_authority::read(make().root.own().pem(), make().root.key_pem(), wrong));
  EXPECT_EQ(wrong, "its key is that of another root");
}

TEST(root, may_vouch_for_private_names_and_the_robots_own) {
  const made m = make();
  for (const char* const yes : {"other.local", "localhost", "gate.example", "10.9.8.7", "192.168.77.1",
                                "172.31.0.1", "fd12::3", "203.0.113.7", "2001:db8::7", "169.254.3.3"})
    EXPECT_TRUE(m.root.may_vouch_for(yes)) << yes;
  for (const char* const no : {"example", "bank.example", "local.example", "notlocal", "8.8.8.8",
                               "203.0.113.8", "172.32.0.1", "2001:db8::8", "::2"})
    EXPECT_FALSE(m.root.may_vouch_for(no)) << no;
}

TEST(root, a_certificate_outside_its_constraints_is_refused_by_clients) {
  const made m = make();
  for (const char* const one : {"bank.example", "8.8.8.8", "2001:db8::8"}) {
    const bool address = is_address(one);
    std::string wrong;
    const host_names foreign{
        .names = address ? std::vector<std::string>{"localhost"} : std::vector<std::string>{one},
        .addresses = address ? std::vector<std::string>{one} : std::vector<std::string>{}};
    EXPECT_FALSE(m.root.sign("ang-01", foreign, m.key, today, 30, wrong));
    EXPECT_EQ(wrong, "clients would refuse the certificate: permitted subtree violation") << one;
  }
}

TEST(root, signs_again_when_its_key_was_kept) {
  const made m = make(3650);
  std::string wrong;
  const auto again = root_authority::read(m.root.own().pem(), m.root.key_pem(), wrong);
  ASSERT_TRUE(again) << wrong;
  const auto leaf = again->sign("ang-01", own, m.key, today + 390 * 24h, 397, wrong);
  ASSERT_TRUE(leaf) << wrong;
  EXPECT_EQ(verdict(m.root.own(), *leaf, "ang-01.local", today + 700 * 24h), "ok");
}

TEST(root, two_of_one_name_are_two) {
  const made one = make();
  const made other = make();
  EXPECT_NE(one.root.key_pem(), other.root.key_pem());
  EXPECT_NE(one.leaf.fingerprint(), other.leaf.fingerprint());
}

} // namespace
} // namespace certificate_test
} // namespace rowe::tools
