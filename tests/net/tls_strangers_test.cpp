// SPDX-License-Identifier: Apache-2.0
// Who does at the other end of TLS what must not work, in both roles: servers that our client connects to,
// and clients that offer what an earlier connection gave them.
#include "tls_support.hpp"

namespace rowe::net {
namespace tls_strangers_test {
namespace {

context_ptr server_context(const certified& files, const preparation& prepared) {
  context_ptr made{SSL_CTX_new(TLS_server_method())};
  const tls_options options = files.server();
  EXPECT_EQ(SSL_CTX_use_certificate_chain_file(made.get(), options.certificate.c_str()), 1);
  EXPECT_EQ(SSL_CTX_use_PrivateKey_file(made.get(), options.key.c_str(), SSL_FILETYPE_PEM), 1);
  if (prepared) prepared(made.get());
  return made;
}

// ---- a client of ours, and a server of the test's own

struct with_a_server : testing::Test {
  certified files;
  descriptor listener{::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
  std::uint16_t port = listen();
  context_ptr context;
  ssl_ptr server; // of the connection accepted last
  descriptor socket;
  std::unique_ptr<socket_transport> transport;
  std::optional<driver> drive;

  std::uint16_t listen() {
    EXPECT_TRUE(tests::listens(listener.get(), 4));
    return tests::port_of(listener.get());
  }
  // Our client connects; this is as far as the server's handshake goes, whether it is done or not.
  bool connect(const preparation& prepared = {}) {
    if (!context) context = server_context(files, prepared);
    if (!transport) {
      transport = connecting({.host = "127.0.0.1", .port = port, .secure = true, .tls = files.client()});
      drive.emplace(*transport);
    }
    transport->connect();
    EXPECT_TRUE(drive->until([&] {
      socket.reset(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      return static_cast<bool>(socket);
    }));
    server.reset(SSL_new(context.get()));
    SSL_set_fd(server.get(), socket.get());
    SSL_set_accept_state(server.get());
    bool shaken = false;
    EXPECT_TRUE(drive->until([&] {
      ERR_clear_error();
      const int outcome = SSL_do_handshake(server.get());
      shaken = outcome == 1;
      return shaken || SSL_get_error(server.get(), outcome) != SSL_ERROR_WANT_READ;
    }));
    return shaken;
  }
  std::string read() {
    std::string text(16384, '\0');
    std::size_t got = 0;
    ERR_clear_error();
    (void)SSL_read_ex(server.get(), text.data(), text.size(), &got);
    text.resize(got);
    return text;
  }
  // Answers the client's request.
  void open() {
    std::string asked;
    ASSERT_TRUE(drive->until([&] { return (asked += read()).ends_with("\r\n\r\n"); }));
    const std::size_t before = drive->sink().opens.size();
    send(upgrade_answer({}, accept_for(asked)));
    ASSERT_TRUE(drive->until([&] { return drive->sink().opens.size() == before + 1; }));
  }
  void send(std::string_view text) {
    std::size_t sent = 0;
    ASSERT_EQ(SSL_write_ex(server.get(), text.data(), text.size(), &sent), 1);
  }
  std::string& received() { return drive->sink().received[drive->sink().opens.back().id.index]; }
  bool closed() { return !drive->sink().closes.empty(); }
};

TEST_F(with_a_server, a_client_tells_an_end_from_a_cut) {
  for (const bool cut : {false, true}) {
    ASSERT_TRUE(connect());
    open();
    send("last words");
    ASSERT_TRUE(drive->until([&] { return received() == "last words"; }));
    if (!cut) SSL_shutdown(server.get());
    socket.reset(); // the end of the stream
    drive->sink().closes.clear();
    ASSERT_TRUE(drive->until([&] { return closed(); }));
    EXPECT_EQ(drive->sink().closes[0].cause, cut ? close_cause::reset : close_cause::peer);
    drive->sink().received.clear();
  }
}

TEST_F(with_a_server, a_client_takes_nothing_of_a_record_that_was_cut_or_changed) {
  const std::string head{"\x17\x03\x03\x00\x40", 5};
  for (const std::size_t bytes : {std::size_t{10}, std::size_t{0x40}}) { // a part, and all but none of ours
    ASSERT_TRUE(connect());
    open();
    send("whole");
    const std::string record = head + std::string(bytes, 'x');
    ASSERT_EQ(::send(socket.get(), record.data(), record.size(), 0), static_cast<ssize_t>(record.size()));
    ::shutdown(socket.get(), SHUT_WR);
    drive->sink().closes.clear();
    ASSERT_TRUE(drive->until([&] { return closed(); }));
    EXPECT_EQ(received(), "whole");
    EXPECT_EQ(drive->sink().closes[0].cause, close_cause::reset);
    drive->sink().received.clear();
  }
}

TEST_F(with_a_server, a_client_negotiates_once_only) {
  ASSERT_TRUE(connect(only_version(TLS1_2_VERSION)));
  open();
  ASSERT_EQ(SSL_renegotiate(server.get()), 1);
  std::string said;
  ASSERT_TRUE(drive->until([&] {
    ERR_clear_error();
    if (SSL_do_handshake(server.get()) == 1) (void)read();
    if (const char* const words = ERR_reason_error_string(ERR_peek_last_error())) said = words;
    return !said.empty() || closed();
  }));
  if (!closed()) {
    EXPECT_EQ(said, "no renegotiation");
  }
  EXPECT_TRUE(received().empty());
}

TEST_F(with_a_server, a_client_comes_back_with_nothing) {
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION}) {
    context.reset();
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(connect([&](SSL_CTX* to) {
        only_version(version)(to);
        SSL_CTX_set_session_id_context(to, reinterpret_cast<const unsigned char*>("1"), 1);
        SSL_CTX_set_max_early_data(to, 16384); // and tickets, as servers give them
      }));
      EXPECT_EQ(SSL_session_reused(server.get()), 0);
      EXPECT_NE(SSL_get_early_data_status(server.get()), SSL_EARLY_DATA_ACCEPTED);
      open();
      send("something");
      ASSERT_TRUE(drive->until([&] { return received() == "something"; }));
      transport->close(drive->sink().opens.back().id, close_how::aborted);
      ASSERT_TRUE(drive->until([&] { return closed(); }));
      drive->sink().closes.clear();
      drive->sink().received.clear();
    }
  }
}

TEST_F(with_a_server, a_client_refuses_a_weak_one) {
  for (const auto& weak : {only_version(TLS1_1_VERSION), only_cipher_of_tls_1_2("ECDHE-ECDSA-AES128-SHA"),
                           only_group("P-384")}) {
    context.reset();
    transport.reset();
    EXPECT_FALSE(connect(weak));
    ASSERT_TRUE(drive->until([&] { return !drive->sink().rejections.empty(); }));
    EXPECT_NE(drive->sink().rejections[0].what.find("the TLS handshake failed"), std::string::npos)
        << drive->sink().rejections[0].what;
    EXPECT_TRUE(drive->sink().opens.empty());
  }
}

// A root that is trusted signs robots. What these sign is worth nothing.
TEST_F(with_a_server, a_robot_cannot_vouch_for_another) {
  const auto forged = test::make_leaf(files.leaf, {.common_name = "forged"});
  test::write_private(files.files / "certificate.pem",
                      forged.certificate + files.leaf.certificate + files.root.certificate);
  test::write_private(files.files / "key.pem", forged.key);
  (void)connect();
  ASSERT_TRUE(drive->until([&] { return !drive->sink().rejections.empty(); }));
  EXPECT_NE(drive->sink().rejections[0].what.find("invalid CA certificate"), std::string::npos)
      << drive->sink().rejections[0].what;
}

// ---- a server of ours

// The session that another server with this certificate gave a client, for early data.
session_ptr session_of_another(const certified& files) {
  const context_ptr serving =
      server_context(files, [](SSL_CTX* to) { SSL_CTX_set_max_early_data(to, 16384); });
  const context_ptr asking{SSL_CTX_new(TLS_client_method())};
  const ssl_ptr server{SSL_new(serving.get())}, client{SSL_new(asking.get())};
  BIO *here = nullptr, *there = nullptr;
  EXPECT_EQ(BIO_new_bio_pair(&here, 0, &there, 0), 1);
  SSL_set_bio(server.get(), here, here);
  SSL_set_bio(client.get(), there, there);
  SSL_set_accept_state(server.get());
  SSL_set_connect_state(client.get());
  for (int i = 0; i < 8; ++i) {
    (void)SSL_do_handshake(client.get());
    (void)SSL_do_handshake(server.get());
  }
  char nothing = 0;
  (void)SSL_read(client.get(), &nothing, 1);                                 // takes the ticket
  SSL_set_shutdown(client.get(), SSL_SENT_SHUTDOWN | SSL_RECEIVED_SHUTDOWN); // or it may not come again
  return session_ptr{SSL_get1_session(client.get())};
}

struct early_data : served_tls {};
struct records : served_tls {};

TEST_F(early_data, is_skipped_and_the_handshake_goes_on_without_it) {
  const session_ptr session = session_of_another(files);
  ASSERT_GT(SSL_SESSION_get_max_early_data(session.get()), 0U);
  tls_socket client{transport->port()};
  ASSERT_EQ(SSL_set_session(client.get(), session.get()), 1);
  const std::string early = upgrade_request(transport->port(), {}, service::stop_path);
  std::size_t taken = 0;
  ASSERT_EQ(SSL_write_early_data(client.get(), early.data(), early.size(), &taken), 1);
  ASSERT_TRUE(drive.until([&] { return client.shaken() || client.failed(); }));
  ASSERT_FALSE(client.failed()) << client.fault;
  EXPECT_EQ(SSL_get_early_data_status(client.get()), SSL_EARLY_DATA_REJECTED);
  EXPECT_EQ(SSL_session_reused(client.get()), 0);
  ASSERT_TRUE(client.send(upgrade_request(transport->port())));
  ASSERT_TRUE(drive.until([&] { return client.has("101 Switching"); }));
  ASSERT_EQ(drive.sink().opens.size(), 1U); // the one that was not early
  EXPECT_EQ(drive.sink().opens[0].path, "/");
}

TEST_F(records, that_were_cut_or_changed_give_a_server_nothing) {
  const std::string head{"\x17\x03\x03\x00\x40", 5};
  for (const std::size_t bytes : {std::size_t{10}, std::size_t{0x40}}) {
    listen({});
    tls_socket client{transport->port()};
    ASSERT_TRUE(asks(drive, client, upgrade_request(transport->port()) + "whole")) << client.fault;
    ASSERT_TRUE(drive.until([&] { return client.has("101 Switching"); }));
    ASSERT_TRUE(client.raw.send(head + std::string(bytes, 'x')));
    client.raw.shut();
    ASSERT_TRUE(drive.until([&] { return !drive.sink().closes.empty(); }));
    EXPECT_EQ(drive.sink().closes[0].cause, close_cause::reset);
    EXPECT_EQ(drive.sink().received[drive.sink().opens[0].id.index], "whole");
  }
}

} // namespace
} // namespace tls_strangers_test
} // namespace rowe::net
