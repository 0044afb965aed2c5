// SPDX-License-Identifier: Apache-2.0
// What is counted of TLS: each handshake once, as done or by the reason for which it failed, and each
// connection that did not end in good order.
#include <csignal>

#include "tls_support.hpp"

namespace rowe::net {
namespace tls_counts_test {
namespace {

using service::counter;

constexpr std::array failures{counter::tls_failed_plain,       counter::tls_failed_silent,
                              counter::tls_failed_timeout,     counter::tls_failed_lost,
                              counter::tls_failed_certificate, counter::tls_failed_protocol,
                              counter::tls_failed_evicted,     counter::tls_failed_resources};

struct counting {
  explicit counting(socket_limits limits = {})
      : transport{listening({.tls = files.server(), .limits = limits})} {}

  std::uint64_t count(counter which) const { return transport->memory().tls->read(which); }
  std::uint64_t failed() const {
    std::uint64_t sum = 0;
    for (const counter one : failures) sum += count(one);
    return sum;
  }
  // Waits until one handshake has failed, and says by what.
  counter failure() {
    EXPECT_TRUE(drive.until([&] { return failed() != 0; }));
    for (const counter one : failures)
      if (count(one) != 0) return one;
    return {};
  }
  // Behind its upgrade.
  void upgrade(tls_socket& client) {
    ASSERT_TRUE(asks(drive, client, upgrade_request(transport->port()))) << client.fault;
    ASSERT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
  }
  void expect_end(counter which) {
    EXPECT_TRUE(drive.until([&] { return count(which) == 1; }));
    for (const counter one : {counter::tls_cuts, counter::tls_key_floods, counter::tls_alerts})
      EXPECT_EQ(count(one), one == which ? 1U : 0U);
  }

  certified files;
  std::unique_ptr<socket_transport> transport;
  driver drive{*transport};
};

struct tls_counts : testing::Test, counting {};
struct tls_counts_soon : testing::Test, counting {
  tls_counts_soon() : counting{{.header_timeout = 100ms}} {}
};

TEST_F(tls_counts, have_a_handshake_that_was_done) {
  tls_socket client{transport->port()};
  upgrade(client);
  EXPECT_EQ(count(counter::tls_handshakes), 1U);
  EXPECT_EQ(failed(), 0U);
}

TEST_F(tls_counts, have_who_does_not_speak_tls) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send(request(transport->port(), "/")));
  EXPECT_EQ(failure(), counter::tls_failed_plain);
  client.close();
}

TEST_F(tls_counts_soon, tell_who_said_nothing_from_who_did_not_end) {
  raw_socket mute{transport->port()};
  EXPECT_EQ(failure(), counter::tls_failed_silent);
  raw_socket half{transport->port()};
  ASSERT_TRUE(half.send("\x16\x03\x01"));
  EXPECT_TRUE(drive.until([&] { return count(counter::tls_failed_timeout) == 1; }));
  EXPECT_EQ(failed(), 2U);
}

TEST_F(tls_counts, have_who_leaves_before_the_end) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send("\x16\x03\x01"));
  client.shut();
  EXPECT_EQ(failure(), counter::tls_failed_lost);
}

TEST_F(tls_counts, have_who_refuses_the_certificate) {
  tls_socket client{transport->port(), [](SSL_CTX* to) { SSL_CTX_set_verify(to, SSL_VERIFY_PEER, nullptr); }};
  ASSERT_TRUE(drive.until([&] { return client.shaken() || client.failed(); }));
  EXPECT_EQ(failure(), counter::tls_failed_certificate);
}

TEST_F(tls_counts, have_who_speaks_nothing_that_is_allowed) {
  tls_socket client{transport->port(), [](SSL_CTX* to) { SSL_CTX_set1_groups_list(to, "P-384"); }};
  ASSERT_TRUE(drive.until([&] { return client.shaken() || client.failed(); }));
  EXPECT_EQ(failure(), counter::tls_failed_protocol);
}

TEST_F(tls_counts, have_who_speaks_no_sense) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send(std::string{"\x16\x03\x01\x00\x04\xff\x00\x00\x00", 9}));
  EXPECT_EQ(failure(), counter::tls_failed_protocol);
}

TEST(tls_counts_of_few, have_who_loses_the_place) {
  counting few{{.handshakes_max = 4}};
  std::vector<raw_socket> mute;
  for (int i = 0; i < 10; ++i) mute.emplace_back(few.transport->port());
  ASSERT_TRUE(few.drive.until([&] { return few.count(counter::tls_failed_evicted) == 6; }));
  EXPECT_EQ(few.failed(), 6U);
  EXPECT_EQ(few.transport->memory().evictions, 6U);
}

// A client's own: the server's certificate is refused on this side, and the server hears of it.
TEST_F(tls_counts, have_a_client_s_own) {
  const certified others;
  const auto stranger =
      connecting({.host = "127.0.0.1", .port = transport->port(), .secure = true, .tls = others.client()});
  drive.add(*stranger);
  stranger->connect();
  ASSERT_TRUE(drive.until([&] { return !drive.sink(1).rejections.empty() && failed() != 0; }));
  EXPECT_EQ(failure(), counter::tls_failed_certificate) << drive.sink().rejections.at(0).what;
  EXPECT_EQ(stranger->memory().tls->read(counter::tls_failed_certificate), 1U);
  EXPECT_EQ(stranger->memory().tls->read(counter::tls_handshakes), 0U);
}

// ---- ends

TEST_F(tls_counts, have_no_end_in_good_order) {
  tls_socket client{transport->port()};
  upgrade(client);
  client.say_end();
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  client.raw.close();
  ASSERT_TRUE(drive.until([&] { return !drive.sink().closes.empty(); }));
  tls_socket next{transport->port()};
  upgrade(next); // by then the session of the first one is destroyed
  for (const counter one : {counter::tls_cuts, counter::tls_key_floods, counter::tls_alerts})
    EXPECT_EQ(count(one), 0U);
}

TEST_F(tls_counts, have_an_end_without_a_word) {
  tls_socket client{transport->port()};
  upgrade(client);
  client.raw.shut();
  expect_end(counter::tls_cuts);
}

TEST_F(tls_counts, have_a_reset) {
  tls_socket client{transport->port()};
  upgrade(client);
  client.raw.reset();
  expect_end(counter::tls_cuts);
}

TEST_F(tls_counts, have_an_end_before_the_request) {
  tls_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return client.shaken(); }));
  client.raw.shut();
  expect_end(counter::tls_cuts);
  EXPECT_EQ(count(counter::tls_handshakes), 1U);
}

TEST_F(tls_counts, have_a_flood_of_new_keys) {
  tls_socket client{transport->port(),
                    [](SSL_CTX* to) { SSL_CTX_set_min_proto_version(to, TLS1_3_VERSION); }};
  upgrade(client);
  client.take_new_keys(9);
  expect_end(counter::tls_key_floods);
}

TEST_F(tls_counts, have_a_record_that_is_wrong) {
  tls_socket client{transport->port()};
  upgrade(client);
  ASSERT_TRUE(client.raw.send(std::string{"\x17\x03\x03\x00\x20", 5} + std::string(32, 'x')));
  expect_end(counter::tls_alerts);
}

// ---- files

TEST_F(tls_counts, have_when_the_certificate_ends_and_each_new_one) {
  constexpr long day = 24 * 60 * 60;
  const auto end = [&] {
    return static_cast<long>(count(counter::tls_certificate_end) - std::uint64_t(std::time(nullptr)));
  };
  ASSERT_TRUE(drive.until([&] { return count(counter::tls_certificate_end) != 0; }));
  EXPECT_NEAR(static_cast<double>(end()), 397.0 * day, day);

  test::write_private(files.files / "certificate.pem", "no certificate");
  ASSERT_TRUE(drive.until([&] { return count(counter::tls_reload_faults) == 1; }));
  EXPECT_EQ(count(counter::tls_reloads), 0U);

  test::write_files(files.files.path(), files.root, test::make_leaf(files.root, {.valid_to_s = 40 * day}));
  ASSERT_TRUE(drive.until([&] { return count(counter::tls_reloads) != 0; }));
  EXPECT_NEAR(static_cast<double>(end()), 40.0 * day, day);
}

// ---- all together

// Whatever clients do, and in whatever order: each was counted once.
TEST(tls_counts_of_many, add_up) {
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own socket BIO
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE(testing::Message{} << "seed " << seed);
  std::mt19937_64 random{seed};
  counting all{{.handshakes_max = 6, .header_timeout = 50ms, .close_timeout = 50ms}};
  std::vector<std::unique_ptr<tls_socket>> clients;
  constexpr std::uint64_t count = 300;
  for (std::uint64_t i = 0; i < count; ++i) {
    clients.push_back(std::make_unique<tls_socket>(all.transport->port()));
    tls_socket& newest = *clients.back();
    ASSERT_TRUE(newest.raw.connected());
    switch (random() % 4) {
    case 0: (void)newest.raw.send("GET / HTTP/1.1\r\n\r\n"); break;
    case 1: (void)newest.raw.send("\x16\x03\x01\x02"); break;
    default: break; // it shakes, or says nothing
    }
    for (auto& one : clients)
      if (random() % 8 == 0 && one->raw.fd() >= 0) (void)one->shaken();
    tls_socket& any = *clients[random() % clients.size()];
    if (random() % 4 == 0) any.raw.reset();
    if (random() % 2 == 0) all.drive.turn();
  }
  ASSERT_TRUE(all.drive.until([&] { return all.count(counter::tls_handshakes) + all.failed() == count; }))
      << all.count(counter::tls_handshakes) << " done, " << all.failed() << " failed";
  clients.clear();
  for (int i = 0; i < 100; ++i) all.drive.turn();
  EXPECT_EQ(all.count(counter::tls_handshakes) + all.failed(), count);
}

} // namespace
} // namespace tls_counts_test
} // namespace rowe::net
