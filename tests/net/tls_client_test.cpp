// SPDX-License-Identifier: Apache-2.0
// A client of wss://, and the certificates it is shown.
#include <cctype>

#include "tls_support.hpp"

namespace rowe::net {
namespace tls_client_test {
namespace {

TEST(tls_client, speaks_with_a_server_whose_root_it_trusts) {
  const certified files;
  for (const char* const host : {"127.0.0.1", "localhost"}) {
    two_ends all{files.server(), files.client(), host};
    ASSERT_TRUE(all.connected()) << all.fault();
    ASSERT_TRUE(all.drive.until([&] { return !all.drive.sink().opens.empty(); }));
    const connection_id there = all.drive.sink().opens[0].id;
    const connection_id here = all.at_client.opens[0].id;
    const std::string text(100'000, 'x');
    std::size_t sent = 0;
    ASSERT_TRUE(all.drive.until([&] {
      sent += write(*all.client, here, std::string_view{text}.substr(sent));
      return sent == text.size();
    }));
    ASSERT_TRUE(
        all.drive.until([&] { return all.drive.sink().received[there.index].size() == text.size(); }));
    ASSERT_EQ(write(*all.server, there, "back"), 4U);
    ASSERT_TRUE(all.drive.until([&] { return all.at_client.received[here.index] == "back"; }));
    all.client->close(here, close_how::flushed);
    ASSERT_TRUE(all.drive.until([&] { return all.drive.sink().closes.size() == 1; }));
    EXPECT_EQ(all.drive.sink().closes[0].cause, close_cause::peer);
  }
}

TEST(tls_client, refuses_what_it_cannot_trust_and_says_why) {
  certified files;
  const auto refused = [&](const test::made_certificate& leaf, std::string_view host, std::string_view why,
                           std::string_view remedy) {
    test::write_files(files.files.path(), files.root, leaf);
    two_ends all{files.server(), files.client(), host};
    EXPECT_FALSE(all.connected()) << why;
    EXPECT_NE(all.fault().find(why), std::string::npos) << all.fault();
    EXPECT_EQ(all.remedy().substr(0, remedy.size()), remedy);
    EXPECT_TRUE(all.at_client.rejections[0].lasting) << why;
    EXPECT_TRUE(all.drive.sink().opens.empty());
    for (const auto* const one : {all.server.get(), all.client.get()}) { // the server hears of it, too
      EXPECT_TRUE(all.drive.until([&] { return failed_handshakes(*one) == 1; }));
      EXPECT_EQ(count_of(*one, service::counter::tls_failed_certificate), 1U);
    }
    EXPECT_EQ(count_of(*all.client, service::counter::tls_handshakes), 0U);
  };
  const auto& root = files.root;
  refused(test::make_leaf(root, {.valid_from_s = -2 * day, .valid_to_s = -day}), "127.0.0.1",
          "certificate has expired", "renew the server's certificate");
  refused(test::make_leaf(root, {.valid_from_s = day}), "127.0.0.1", "certificate is not yet valid",
          "set the clock");
  refused(test::make_leaf(root, {.names = {"other.local"}}), "localhost", "hostname mismatch",
          "connect by a name");
  refused(test::make_leaf(root, {.addresses = {"192.0.2.1"}}), "127.0.0.1", "IP address mismatch",
          "connect by a name");
  refused(test::make_self_signed(), "127.0.0.1", "self-signed certificate",
          "give the root that signed it: --ca FILE");
  refused(test::make_leaf(test::make_root("another")), "127.0.0.1", "unable to get local issuer certificate",
          "give the root that signed it: --ca FILE");
}

TEST(tls_client, trusts_a_key_that_is_pinned_and_no_other) {
  const certified files;
  const std::string pin = test::pin_of(files.leaf);
  const std::string other = test::pin_of(files.root);
  std::string pairs; // as others write fingerprints
  for (std::size_t i = 0; i < pin.size(); ++i) {
    if (i % 2 == 0 && i != 0) pairs += ':';
    pairs += static_cast<char>(std::toupper(static_cast<unsigned char>(pin[i])));
  }
  for (const std::string& good : {pin, pairs}) {
    two_ends all{files.server(), {.pin = good}};
    EXPECT_TRUE(all.connected()) << all.fault();
  }
  two_ends all{files.server(), {.pin = other}};
  EXPECT_FALSE(all.connected());
  EXPECT_NE(all.fault().find("the server's key is not the one that is pinned"), std::string::npos)
      << all.fault();
  EXPECT_EQ(all.remedy().substr(0, 13), "compare --pin");
  two_ends both{files.server(), {.ca = files.files / "ca.pem", .pin = other}};
  EXPECT_FALSE(both.connected()) << "both must hold";
  pairs[5] = '.';
  EXPECT_EQ(check_tls({.pin = pairs}).substr(0, 5), "pin \"");
}

TEST(tls_client, is_told_when_the_server_does_not_speak_tls) {
  const certified files;
  const auto server = listening();
  const auto client =
      connecting({.host = "127.0.0.1", .port = server->port(), .secure = true, .tls = files.client()});
  driver drive{*server};
  recording_sink& at_client = drive.add(*client);
  client->connect();
  ASSERT_TRUE(drive.until([&] { return !at_client.rejections.empty(); }));
  EXPECT_NE(at_client.rejections[0].what.find("the TLS handshake failed"), std::string::npos)
      << at_client.rejections[0].what;
  EXPECT_EQ(at_client.rejections[0].remedy, "check that this port speaks TLS; else connect to ws://");
  EXPECT_TRUE(at_client.rejections[0].lasting);
}

TEST(tls_client, gives_up_on_a_server_that_says_nothing) {
  const certified files;
  descriptor mute{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  ASSERT_TRUE(tests::listens(mute.get(), 4));
  const auto client = connecting({.host = "127.0.0.1",
                                  .port = tests::port_of(mute.get()),
                                  .secure = true,
                                  .tls = files.client(),
                                  .limits = {.connect_timeout = 200ms}});
  driver drive{*client};
  client->connect();
  ASSERT_TRUE(drive.until([&] { return !drive.sink().rejections.empty(); }));
  const auto& why = drive.sink().rejections[0].what;
  EXPECT_NE(why.find("the TLS handshake"), std::string::npos) << why;
  EXPECT_NE(why.find("did not end"), std::string::npos) << why;
  const auto& counts = *client->memory().tls;
  EXPECT_TRUE(drive.until([&] { return counts.read(service::counter::tls_failed_timeout) == 1; }));
  EXPECT_EQ(counts.read(service::counter::tls_failed_evicted), 0U);
}

TEST(tls_client, shows_its_token_inside) {
  const certified files;
  const auto server = listening({.tls = files.server()});
  const auto client = connecting({.host = "127.0.0.1",
                                  .port = server->port(),
                                  .token = "0123456789abcdef",
                                  .secure = true,
                                  .tls = files.client()});
  driver drive{*server};
  recording_sink& at_client = drive.add(*client);
  std::string token;
  drive.sink().when_asked = [&](const service::credentials& shown) {
    token = shown.token;
    return service::admit_answer{};
  };
  client->connect();
  ASSERT_TRUE(drive.until([&] { return !at_client.opens.empty(); }));
  EXPECT_EQ(token, "0123456789abcdef");
}

} // namespace
} // namespace tls_client_test
} // namespace rowe::net
