// SPDX-License-Identifier: Apache-2.0
// Certificates of clients: whose are taken, what of them is told, and who is refused.
#include "tls_support.hpp"

#include <openssl/pem.h>

namespace rowe::net {
namespace tls_certificate_test {
namespace {

test::certificate_request called(std::string name) {
  return {.names = {}, .addresses = {}, .common_name = std::move(name), .usage = "clientAuth"};
}
// One that is over.
test::certificate_request late() {
  auto wanted = called("anna");
  wanted.valid_from_s = -2 * day;
  wanted.valid_to_s = -day;
  return wanted;
}

// A server's files, and a root of its own for clients.
struct asking : certified {
  test::made_certificate clients = test::make_root("root of clients");
  asking() { test::write_private(files / "clients.pem", clients.certificate); }

  tls_options server() const {
    tls_options options = certified::server();
    options.client_ca = files / "clients.pem";
    return options;
  }
  // Files of a client, in one.
  tls_options client(const test::made_certificate& own) const {
    test::write_private(files / "own.pem", own.certificate + own.key);
    return {.certificate = files / "own.pem", .key = files / "own.pem", .ca = files / "ca.pem"};
  }
};

// What the service is told of a client, through an upgrade.
struct asked_server : testing::Test {
  asking files;
  std::unique_ptr<socket_transport> transport = listening({.tls = files.server()});
  driver drive{*transport};
  std::vector<std::string> told;

  asked_server() {
    drive.sink().when_asked = [this](const service::credentials& shown) -> service::admit_answer {
      told.emplace_back(shown.certificate);
      return {};
    };
  }

  // Shows these; `below` are sent with the first.
  preparation showing(const test::made_certificate& own, std::vector<test::made_certificate> below = {},
                      int version = 0) {
    test::write_private(files.files / "shown.pem", own.certificate + own.key);
    std::string chain = own.certificate;
    for (const auto& one : below) chain += one.certificate;
    test::write_private(files.files / "chain.pem", chain);
    return [this, version](SSL_CTX* to) {
      if (version != 0) SSL_CTX_set_max_proto_version(to, version);
      EXPECT_EQ(SSL_CTX_use_certificate_chain_file(to, (files.files / "chain.pem").c_str()), 1);
      EXPECT_EQ(SSL_CTX_use_PrivateKey_file(to, (files.files / "shown.pem").c_str(), SSL_FILETYPE_PEM), 1);
    };
  }
  // The name that was told, or "refused: " and the reason.
  std::string outcome_of(const preparation& prepare) {
    tls_socket client{transport->port(), prepare};
    told.clear();
    drive.sink().rejections.clear();
    bool sent = false;
    EXPECT_TRUE(drive.until([&] {
      if (!sent && client.shaken()) sent = client.send(upgrade_request(transport->port()));
      return !told.empty() || !drive.sink().rejections.empty();
    }));
    if (!told.empty()) return told[0];
    return "refused: " + drive.sink().rejections[0].what;
  }
};

TEST_F(asked_server, tells_the_name_of_who_shows_a_certificate) {
  const auto anna = test::make_leaf(files.clients, called("anna"));
  EXPECT_EQ(outcome_of(showing(anna)), "anna");
  EXPECT_EQ(outcome_of(showing(anna, {}, TLS1_2_VERSION)), "anna");
  EXPECT_EQ(outcome_of({}), "") << "nobody has to show one";
  const std::string longest(64, 'n');
  EXPECT_EQ(outcome_of(showing(test::make_leaf(files.clients, called(longest)))), longest);
  EXPECT_EQ(outcome_of(showing(test::make_leaf(files.clients, called("anna smith, dr.")))),
            "anna smith, dr.");
}

TEST_F(asked_server, names_nobody_where_the_subject_does_not_name_one) {
  const auto shown = [&](test::certificate_request wanted) {
    return outcome_of(showing(test::make_leaf(files.clients, wanted)));
  };
  EXPECT_EQ(shown({.names = {"anna"}, .common_name = "", .usage = "clientAuth"}), "");
  EXPECT_EQ(shown({.common_name = "anna", .second_common_name = "eve", .usage = "clientAuth"}), "");
  EXPECT_EQ(shown({.common_name = "anna", .second_common_name = "anna", .usage = "clientAuth"}), "");
  EXPECT_EQ(shown(called("\xc3\xa4nna")), "") << "names are ASCII";
  EXPECT_EQ(shown(called("anna\nadmin")), "");
}

TEST_F(asked_server, refuses_certificates_that_are_not_good_and_says_why) {
  const auto refused = [&](const test::made_certificate& own, int version = 0) {
    const std::string outcome = outcome_of(showing(own, {}, version));
    EXPECT_EQ(drive.sink().opens.size(), 0U);
    return outcome;
  };
  const std::string failed = "refused: the TLS handshake failed: ";
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    EXPECT_EQ(refused(test::make_leaf(test::make_root("another"), called("anna")), version),
              failed + "unable to get local issuer certificate");
    EXPECT_EQ(refused(test::make_leaf(files.root, called("anna")), version),
              failed + "unable to get local issuer certificate")
        << "the root of servers vouches for no clients";
    EXPECT_EQ(refused(test::make_self_signed(called("anna")), version), failed + "self-signed certificate");
    EXPECT_EQ(refused(test::make_leaf(files.clients, late()), version), failed + "certificate has expired");
    auto early = called("anna");
    early.valid_from_s = day;
    EXPECT_EQ(refused(test::make_leaf(files.clients, early), version),
              failed + "certificate is not yet valid");
    auto server = called("anna");
    server.usage = "serverAuth";
    EXPECT_NE(refused(test::make_leaf(files.clients, server), version).find("purpose"), std::string::npos);
  }
  EXPECT_EQ(outcome_of({}), "") << "and goes on";
}

TEST_F(asked_server, takes_a_chain_and_bounds_it) {
  auto between = called("between");
  between.is_authority = true;
  const auto middle = test::make_leaf(files.clients, between);
  const auto anna = test::make_leaf(middle, called("anna"));
  EXPECT_EQ(outcome_of(showing(anna, {middle})), "anna");
  EXPECT_EQ(outcome_of(showing(anna)),
            "refused: the TLS handshake failed: unable to get local issuer certificate");
  const std::vector<test::made_certificate> many(60, middle); // some 24 KiB
  EXPECT_NE(outcome_of(showing(anna, many)).find("excessive message size"), std::string::npos);
}

TEST_F(asked_server, tells_browsers_whose_certificates_it_takes) {
  tls_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return client.shaken(); }));
  const STACK_OF(X509_NAME)* const roots = SSL_get0_peer_CA_list(client.get());
  ASSERT_EQ(sk_X509_NAME_num(roots), 1);
  char text[64];
  X509_NAME_get_text_by_NID(sk_X509_NAME_value(roots, 0), NID_commonName, text, sizeof text);
  EXPECT_STREQ(text, "root of clients");
}

TEST(tls_server_whose_root_vouches_for_clients_too, shows_its_certificate_alone) {
  const certified files;
  test::write_private(files.files / "certificate.pem", files.leaf.certificate);
  tls_options options = files.server();
  options.client_ca = files.files / "ca.pem";
  const auto transport = listening({.tls = options});
  driver drive{*transport};
  tls_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return client.shaken(); }));
  EXPECT_EQ(sk_X509_num(SSL_get_peer_cert_chain(client.get())), 1) << "the root is not sent along";
}

TEST(tls_server_without_client_ca, asks_nobody) {
  const certified files;
  const auto transport = listening({.tls = files.server()});
  driver drive{*transport};
  tls_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return client.shaken(); }));
  EXPECT_EQ(SSL_get0_peer_CA_list(client.get()), nullptr);
}

TEST_F(asked_server, takes_other_roots_without_a_restart) {
  const auto others = test::make_root("other clients");
  const auto anna = test::make_leaf(files.clients, called("anna"));
  const auto bob = test::make_leaf(others, called("bob"));
  EXPECT_EQ(outcome_of(showing(anna)), "anna");
  test::write_private(files.files / "clients.pem", "no certificate");
  ASSERT_TRUE(drive.until([&] { return !drive.sink().warnings.empty(); }));
  EXPECT_EQ(drive.sink().warnings[0], "the new certificate is not used: it holds no certificate in PEM");
  EXPECT_EQ(outcome_of(showing(anna)), "anna") << "it keeps what it has";
  test::write_private(files.files / "clients.pem", others.certificate);
  ASSERT_TRUE(drive.until([&] { return outcome_of(showing(bob)) == "bob"; }));
  EXPECT_NE(outcome_of(showing(anna)).find("refused"), std::string::npos);
}

// ---- our own client

TEST(tls_client, shows_its_certificate_to_who_asks) {
  const asking files;
  const auto anna = test::make_leaf(files.clients, called("anna"));
  two_ends all{files.server(), files.client(anna)};
  EXPECT_TRUE(all.connected()) << all.fault();
  EXPECT_EQ(all.told, std::vector<std::string>{"anna"});
  two_ends other{files.certified::server(), files.client(anna)};
  EXPECT_TRUE(other.connected()) << other.fault();
  EXPECT_EQ(other.told, std::vector<std::string>{""}) << "it was not asked";
}

// In TLS 1.3 the server says so when the handshake is over for the client.
TEST(tls_client, is_told_that_its_certificate_is_refused) {
  const asking files;
  const auto refused = [&](const test::made_certificate& own) {
    two_ends all{files.server(), files.client(own)};
    const recording_sink::rejected* found = nullptr; // the end of our own may be told of before
    EXPECT_TRUE(all.drive.until([&] {
      for (const auto& one : all.at_client.rejections)
        if (one.what.find("the TLS handshake failed") != std::string::npos) found = &one;
      return found != nullptr || !all.at_client.opens.empty();
    }));
    EXPECT_TRUE(all.at_client.opens.empty());
    if (found == nullptr) return std::string{};
    EXPECT_NE(found->remedy.find("--cert FILE"), std::string::npos) << found->remedy;
    return found->what;
  };
  EXPECT_NE(refused(test::make_leaf(files.root, called("anna"))).find("unknown ca"), std::string::npos);
  EXPECT_NE(refused(test::make_leaf(files.clients, late())).find("certificate expired"), std::string::npos);
}

TEST(tls_files, of_clients_that_are_wrong_are_named) {
  const asking files;
  tls_options options = files.server();
  EXPECT_EQ(check_tls(options), "");
  options.client_ca = files.files / "nowhere.pem";
  EXPECT_EQ(check_tls(options), options.client_ca + ": No such file or directory");
  EXPECT_EQ(socket_transport::listen({.tls = options}).code(), errc::bad_certificate);
  options.client_ca = files.files / "key.pem";
  EXPECT_EQ(check_tls(options), options.client_ca + ": it holds no certificate in PEM");
  EXPECT_EQ(check_tls({.client_ca = "x.pem"}),
            "x.pem: clients show certificates to a server that has one: set `certificate`");
  options = files.client(test::make_leaf(files.clients, called("anna")));
  options.key = files.files / "key.pem";
  EXPECT_EQ(check_tls(options), options.key + ": it is not the key of " + options.certificate);
  EXPECT_EQ(
      socket_transport::connect({.host = "127.0.0.1", .port = 1, .secure = true, .tls = options}).code(),
      errc::bad_certificate);
}

} // namespace
} // namespace tls_certificate_test
} // namespace rowe::net
