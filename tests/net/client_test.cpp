// SPDX-License-Identifier: Apache-2.0
#include "support.hpp"

namespace rowe::net {
namespace client_test {
namespace {

// A server of the test's own: accepts, and says what it is told to.
class raw_server {
 public:
  explicit raw_server(int backlog = 16) {
    fd_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    EXPECT_TRUE(tests::listens(fd_.get(), backlog));
    port = tests::port_of(fd_.get());
  }
  bool accept() {
    descriptor next{::accept4(fd_.get(), nullptr, nullptr, SOCK_CLOEXEC)};
    if (!next) return false;
    peer = raw_socket{std::move(next)};
    return true;
  }
  void close() { fd_.reset(); }

  std::uint16_t port = 0;
  raw_socket peer; // the last one accepted

 private:
  descriptor fd_;
};

// A client and a raw server; ask() makes the client connect and leaves its request in server.peer.text.
struct client : testing::Test {
  raw_server server;
  std::unique_ptr<socket_transport> transport = make();
  driver drive{*transport};

  std::unique_ptr<socket_transport> make(socket_limits limits = {}) const {
    static const std::string_view offered[] = {"rowe.v1", "foxglove.sdk.v1"};
    return connecting({.host = "127.0.0.1",
                       .port = server.port,
                       .path = "/robot?name=r2",
                       .subprotocols = offered,
                       .limits = limits});
  }
  void ask() {
    transport->connect();
    ASSERT_TRUE(drive.until([&] { return server.accept(); }));
    ASSERT_TRUE(drive.until([&] { return server.peer.has("\r\n\r\n"); }));
  }
  std::string good_answer(std::string_view more = {}) {
    return upgrade_answer(more, accept_for(server.peer.text));
  }
  // What the client makes of this answer, if it is a rejection.
  recording_sink::rejected rejection_of(std::string_view answer) {
    EXPECT_TRUE(server.peer.send(answer));
    EXPECT_TRUE(drive.until([&] { return !drive.sink().rejections.empty(); }));
    EXPECT_TRUE(drive.sink().opens.empty());
    if (drive.sink().rejections.size() != 1) return {};
    EXPECT_FALSE(drive.sink().rejections[0].what.empty());
    EXPECT_FALSE(drive.sink().rejections[0].remedy.empty());
    EXPECT_EQ(drive.sink().rejections[0].peer, "127.0.0.1:" + std::to_string(server.port));
    EXPECT_TRUE(drive.until([&] { return server.peer.ended(); })) << "the socket is still open";
    return drive.sink().rejections[0];
  }
};

TEST_F(client, opens_a_connection_and_passes_on_what_lies_behind_the_answer) {
  ask();
  ASSERT_TRUE(server.peer.send(good_answer("Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n") + "first words"));
  ASSERT_TRUE(drive.until([&] { return drive.sink().received[0] == "first words"; }));
  ASSERT_EQ(drive.sink().opens.size(), 1U);
  const auto& opened = drive.sink().opens[0];
  EXPECT_EQ(opened.ours, service::side::client);
  EXPECT_EQ(opened.path, "/robot");
  EXPECT_EQ(opened.subprotocol, "foxglove.sdk.v1");
  EXPECT_EQ(opened.address, "127.0.0.1:" + std::to_string(server.port));
  server.peer.text.clear();
  EXPECT_EQ(write(*transport, opened.id, "hello"), 5U);
  EXPECT_TRUE(drive.until([&] { return server.peer.has("hello"); }));
  EXPECT_EQ(server.peer.text, "hello") << "libwebsockets wrote something too";
}

TEST_F(client, makes_one_attempt_however_often_it_is_asked) {
  transport->connect();
  transport->connect();
  ask();
  transport->connect();
  drive.turn();
  ASSERT_TRUE(server.peer.send(good_answer()));
  ASSERT_TRUE(drive.until([&] { return drive.sink().opens.size() == 1; }));
  drive.turn();
  EXPECT_FALSE(server.accept());
}

TEST_F(client, reports_a_status_that_is_not_101_and_whether_it_will_get_it_again) {
  const auto rejected_by = [&](int status) {
    ask();
    drive.sink().rejections.clear();
    const auto rejection = rejection_of("HTTP/1.1 " + std::to_string(status) + " So\r\n\r\n");
    EXPECT_EQ(rejection.status, status);
    EXPECT_NE(rejection.what.find(std::to_string(status)), std::string::npos) << rejection.what;
    return rejection;
  };
  for (const int status : {200, 302, 400, 401, 403, 404}) EXPECT_TRUE(rejected_by(status).lasting) << status;
  for (const int status : {408, 429, 500, 502, 503}) EXPECT_FALSE(rejected_by(status).lasting) << status;
  EXPECT_NE(rejected_by(404).remedy.find("path"), std::string::npos);
  EXPECT_NE(rejected_by(429).remedy.find("wait, then send a token"), std::string::npos);
}

TEST_F(client, refuses_an_answer_to_another_key) {
  ask();
  EXPECT_EQ(rejection_of(upgrade_answer()).status, 101);
}

TEST_F(client, refuses_what_is_not_http) {
  ask();
  const auto rejection = rejection_of("SSH-2.0-OpenSSH_9.2\r\n\r\n");
  EXPECT_EQ(rejection.status, 0);
  EXPECT_TRUE(rejection.lasting);
}

TEST_F(client, refuses_a_header_without_end) {
  ask();
  const auto rejection = rejection_of("HTTP/1.1 101 Switching Protocols\r\nX: " + std::string(5000, 'x'));
  EXPECT_NE(rejection.what.find("4096"), std::string::npos);
}

TEST_F(client, reports_a_server_that_closes_instead_of_answering) {
  ask();
  ASSERT_TRUE(server.peer.send("HTTP/1.1 101 Swit"));
  server.peer.close();
  ASSERT_TRUE(drive.until([&] { return drive.sink().rejections.size() == 1; }));
  ask();
  server.peer.reset();
  ASSERT_TRUE(drive.until([&] { return drive.sink().rejections.size() == 2; }));
  for (const auto& one : drive.sink().rejections) EXPECT_FALSE(one.lasting) << one.what;
}

TEST_F(client, gives_up_a_server_that_does_not_answer_in_time) {
  drive.stop_clock();
  ask();
  drive.skip(4900ms);
  drive.turn();
  EXPECT_TRUE(drive.sink().rejections.empty());
  drive.skip(200ms);
  drive.turn();
  ASSERT_EQ(drive.sink().rejections.size(), 1U);
  EXPECT_NE(drive.sink().rejections[0].what.find("5 s"), std::string::npos)
      << drive.sink().rejections[0].what;
  ask(); // and the next attempt begins anew
}

TEST_F(client, gives_up_a_host_that_does_not_accept_in_time) {
  raw_server full{0};
  std::vector<descriptor> waiting; // fill its queue: what comes next is not even answered
  for (int i = 0; i < 4; ++i) {
    waiting.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    (void)tests::connect_to(full.port, waiting.back().get());
  }
  auto late = connecting({.host = "127.0.0.1", .port = full.port});
  driver drive_late{*late};
  late->connect();
  drive_late.turn();
  for (int i = 0; i < 10; ++i) drive_late.turn();
  EXPECT_TRUE(drive_late.sink().rejections.empty());
  drive_late.skip(5100ms);
  drive_late.turn();
  ASSERT_EQ(drive_late.sink().rejections.size(), 1U);
  EXPECT_NE(drive_late.sink().rejections[0].what.find("no connection"), std::string::npos);
}

TEST_F(client, reports_that_nobody_listens) {
  server.close();
  for (std::size_t i = 1; i <= 3; ++i) {
    transport->connect();
    ASSERT_TRUE(drive.until([&] { return drive.sink().rejections.size() == i; }));
    EXPECT_NE(drive.sink().rejections[i - 1].what.find("nobody listens"), std::string::npos);
  }
}

TEST_F(client, leaves_nothing_behind_when_it_goes_in_the_middle) {
  const auto count_after = [&](auto&& proceed) {
    transport = make();
    driver other{*transport};
    transport->connect();
    other.turn();
    EXPECT_TRUE(other.until([&] { return server.accept(); }));
    proceed(other);
    transport.reset();
    server.peer.close();
    return open_descriptors();
  };
  const std::size_t before = count_after([](driver&) {});
  EXPECT_EQ(count_after([&](driver& other) { // the request is sent
              EXPECT_TRUE(other.until([&] { return server.peer.has("\r\n\r\n"); }));
            }),
            before);
  EXPECT_EQ(count_after([&](driver& other) { // half the answer has come
              EXPECT_TRUE(other.until([&] { return server.peer.has("\r\n\r\n"); }));
              EXPECT_TRUE(server.peer.send("HTTP/1.1 101"));
              other.turn();
              other.turn();
            }),
            before);
}

TEST_F(client, keeps_no_descriptor_of_a_hundred_attempts) {
  std::size_t before = 0;
  for (std::size_t i = 1; i <= 100; ++i) {
    ask();
    if (i % 2)
      ASSERT_TRUE(server.peer.send("HTTP/1.1 403 Forbidden\r\n\r\n"));
    else
      ASSERT_TRUE(server.peer.send(upgrade_answer()));
    ASSERT_TRUE(drive.until([&] { return drive.sink().rejections.size() == i; }));
    server.peer.close();
    if (i == 2) before = open_descriptors();
  }
  EXPECT_EQ(open_descriptors(), before);
}

} // namespace
} // namespace client_test
} // namespace rowe::net
