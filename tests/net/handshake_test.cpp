// SPDX-License-Identifier: Apache-2.0
#include "support.hpp"

namespace rowe::net {
namespace handshake_test {
namespace {

struct handshake : served {};

TEST_F(handshake, opens_a_connection_by_an_upgrade) {
  raw_socket client = answered(drive, *transport, upgrade_request(transport->port(), {}, "/robot?token=1"));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 101");
  EXPECT_TRUE(client.has(accept_of_key));
  ASSERT_EQ(drive.sink().opens.size(), 1U);
  const auto& opened = drive.sink().opens[0];
  EXPECT_NE(opened.id.generation, 0U);
  EXPECT_EQ(opened.ours, service::side::server);
  EXPECT_EQ(opened.path, "/robot");
  EXPECT_EQ(opened.subprotocol, "");
  EXPECT_EQ(opened.address.substr(0, 10), "127.0.0.1:");
}

TEST_F(handshake, answers_a_short_key_and_an_unknown_subprotocol_of_a_lenient_client) {
  const std::string_view spoken[] = {"rowe.v1"};
  listen({.subprotocols = spoken, .lenient_handshake = true});
  raw_socket client{transport->port()};
  const std::string own_origin = "Origin: http://127.0.0.1:" + std::to_string(transport->port()) + "\r\n";
  std::string text =
      upgrade_request(transport->port(), own_origin + "Sec-WebSocket-Protocol: foo\r\n", "/hop/robot");
  ASSERT_TRUE(client.send(text.replace(text.find(key), key.size(), "d3M3")));
  ASSERT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 101");
  EXPECT_TRUE(client.has("EGzEuN9EoY/Psz9H4Y9KYm2J2rU=")) << client.text;
  EXPECT_FALSE(client.has("Sec-WebSocket-Protocol"));
  ASSERT_EQ(drive.sink().opens.size(), 1U);
  EXPECT_EQ(drive.sink().opens[0].subprotocol, "");
  EXPECT_EQ(drive.sink().opens[0].path, "/hop/robot");
}

TEST_F(handshake, asks_whether_a_peer_with_this_token_may_come_and_says_who_it_is) {
  std::string asked;
  drive.sink().when_asked = [&](const service::credentials& shown) -> service::admit_answer {
    asked += std::string{shown.address.substr(0, 10)} + " " + std::string{shown.path} + " " +
             std::string{shown.token} + (shown.in_url ? " in the URL" : "") + "\n";
    if (shown.token == "right") return {.who = {.role = 3, .identity = 7}};
    return {.status = 401, .what = "this token is not known here", .remedy = "ask for one"};
  };
  raw_socket wrong{transport->port()};
  ASSERT_TRUE(wrong.send(upgrade_request(transport->port(), {}, "/robot?token=wrong")));
  ASSERT_TRUE(drive.until([&] { return wrong.has("ask for one"); }));
  EXPECT_EQ(wrong.text.substr(0, 25), "HTTP/1.1 401 Unauthorized");
  EXPECT_TRUE(wrong.has("WWW-Authenticate: Bearer")) << wrong.text;
  EXPECT_TRUE(drive.sink().opens.empty());
  raw_socket right = answered(
      drive, *transport, upgrade_request(transport->port(), "Authorization: Bearer right\r\n", "/robot"));
  ASSERT_EQ(drive.sink().opens.size(), 1U);
  EXPECT_EQ(drive.sink().opens[0].who, (access::subject{.role = 3, .identity = 7}));
  EXPECT_EQ(asked, "127.0.0.1: /robot wrong in the URL\n127.0.0.1: /robot right\n");
}

// tests/conformance has all others.
TEST_F(handshake, refuses_with_words_and_reports_it) {
  const std::uint16_t port = transport->port();
  const std::string long_body(100000, 'x');
  for (const auto& [status, text] : std::map<std::string, std::string>{
           {"403", upgrade_request(port, "Origin: http://evil.example\r\n")},
           {"405", "POST / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                       "\r\nContent-Length: 100000\r\n\r\n" + long_body},
           {"400", "\x01\x03\x01 hello\n\n"},
           {"431", request(port, "/", "Cookie: " + std::string(5000, 'c') + "\r\n")}}) {
    SCOPED_TRACE(status);
    drive.sink().rejections.clear();
    const raw_socket client = answered_whole(drive, *transport, text);
    EXPECT_FALSE(client.failed) << "the answer came with a reset";
    EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 " + status) << client.text;
    ASSERT_EQ(drive.sink().rejections.size(), 1U);
    const auto& rejection = drive.sink().rejections[0];
    EXPECT_EQ(std::to_string(rejection.status), status);
    EXPECT_FALSE(rejection.what.empty());
    EXPECT_FALSE(rejection.remedy.empty());
    EXPECT_NE(client.text.find(rejection.remedy), std::string::npos) << client.text;
    EXPECT_EQ(rejection.peer.substr(0, 10), "127.0.0.1:");
  }
  EXPECT_TRUE(drive.sink().opens.empty());
}

TEST_F(handshake, lets_a_client_finish_sending_before_it_reads_the_rejection) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n"));
  ASSERT_TRUE(drive.until([&] { return !drive.sink().rejections.empty(); }));
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(client.send(std::string(1000, 'x'))) << "cut after " << i << " pieces";
    drive.turn();
  }
  client.shut();
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 405");
}

TEST_F(handshake, allows_listed_origins_and_hosts_and_its_own_page) {
  const std::string_view origins[] = {"http://lab.example:8000"};
  const std::string_view hosts[] = {"robot.local"};
  listen({.allow_origins = origins, .allow_hosts = hosts});
  const std::string port = std::to_string(transport->port());
  const std::string own = upgrade_request(transport->port(), "Origin: http://127.0.0.1:" + port + "\r\n");
  const std::string listed = upgrade_request(transport->port(), "Origin: http://lab.example:8000\r\n");
  std::string by_name = upgrade_request(transport->port(), "Origin: http://robot.local:" + port + "\r\n");
  by_name.replace(by_name.find("127.0.0.1"), 9, "robot.local");
  for (const std::string& text : {own, listed, by_name}) {
    raw_socket client = answered(drive, *transport, text);
    EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 101") << text;
  }
}

TEST_F(handshake, cuts_a_header_that_does_not_end_in_time) {
  drive.stop_clock();
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send("GET / HTTP/1.1\r\n"));
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  ASSERT_TRUE(drive.until([&] { return client.all_arrived(); }));
  drive.turn(); // the bytes are seen by now
  drive.turn();
  drive.skip(4900ms);
  drive.turn();
  EXPECT_TRUE(drive.sink().rejections.empty());
  drive.skip(200ms);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 408");
  ASSERT_EQ(drive.sink().rejections.size(), 1U);
}

TEST_F(handshake, answers_tls_with_its_alert_at_once_and_in_words) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send(std::string_view{"\x16\x03\x01", 3})); // the rest of the record never comes
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_EQ(client.text, (std::string{"\x15\x03\x01\x00\x02\x02\x28", 7}));
  ASSERT_EQ(drive.sink().rejections.size(), 1U);
  EXPECT_NE(drive.sink().rejections[0].what.find("speaks TLS"), std::string::npos);
}

TEST_F(handshake, closes_a_silent_socket_in_time_without_a_report) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  drive.skip(5100ms);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.text.empty());
  EXPECT_TRUE(drive.sink().rejections.empty());
}

TEST_F(handshake, forgets_a_client_that_leaves_before_its_header_ends) {
  const std::size_t before = open_descriptors();
  {
    raw_socket client{transport->port()};
    ASSERT_TRUE(client.send("GET / HT"));
    ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  }
  EXPECT_TRUE(drive.until([&] { return open_descriptors() == before; }));
  raw_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 2; }));
  client.reset();
  EXPECT_TRUE(drive.until([&] { return open_descriptors() == before; }));
  EXPECT_TRUE(drive.sink().rejections.empty());
}

TEST_F(handshake, takes_one_step_a_turn_whoever_waits) {
  std::vector<raw_socket> clients;
  for (int i = 0; i < 4; ++i) clients.emplace_back(transport->port());
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 4; }));
  for (const raw_socket& one : clients) ASSERT_TRUE(one.send(upgrade_request(transport->port())));
  for (std::size_t turns = 1; turns <= 4; ++turns) {
    wait_for_event(*transport, drive.now()); // one that is ready counts
    drive.turn();
    EXPECT_EQ(drive.sink().opens.size(), turns);
  }
}

TEST_F(handshake, refuses_an_upgrade_beyond_connections_max_in_words) {
  listen({.limits = {.connections_max = 4}});
  const raw_socket first = upgraded(drive, *transport);
  const raw_socket second = upgraded(drive, *transport);
  const raw_socket third = answered_whole(drive, *transport, upgrade_request(transport->port()));
  EXPECT_FALSE(third.failed);
  EXPECT_EQ(third.text.substr(0, 12), "HTTP/1.1 503");
  ASSERT_EQ(drive.sink().rejections.size(), 1U);
  EXPECT_EQ(drive.sink().rejections[0].what, "all 2 connections are taken");
  EXPECT_NE(drive.sink().rejections[0].remedy.find("connections_max"), std::string::npos);
}

TEST_F(handshake, refuses_what_finds_no_place_on_the_spot) {
  listen({.limits = {.handshakes_max = 1, .handshake_bytes = 16 << 20}});
  const std::uint64_t resting = transport->memory().bytes_used;
  const std::string large(4 << 20, 'p');
  drive.sink().answer = [&](const service::http_request&) { return page_of(large); };
  raw_socket reader = reader_of(drive, *transport, "/large", 2048); // of nothing: its page stays under way
  raw_socket next{transport->port()};
  ASSERT_TRUE(drive.until([&] { return next.ended(); }));
  EXPECT_EQ(next.text.substr(0, 12), "HTTP/1.1 503");
  EXPECT_EQ(transport->counters().handshakes_cut, 1U);
  ASSERT_EQ(drive.sink().rejections.size(), 1U);

  reader.reset();
  ASSERT_TRUE(drive.until([&] { return transport->memory().bytes_used == resting; }));
  const raw_socket client = upgraded(drive, *transport);
  EXPECT_EQ(drive.sink().opens.size(), 1U);
}

TEST_F(handshake, gives_the_place_of_someone_answered_to_a_newcomer) {
  listen({.limits = {.handshakes_max = 1}});
  raw_socket refused{transport->port()};
  ASSERT_TRUE(refused.send("GET / HTTP/1.0\r\n\r\n"));
  ASSERT_TRUE(drive.until([&] { return !drive.sink().rejections.empty(); })); // answered, and does not close
  const raw_socket client = upgraded(drive, *transport);
  EXPECT_EQ(drive.sink().opens.size(), 1U);
}

TEST_F(handshake, limits_connections_of_one_address_beyond_loopback) {
  // The machine's own address is as far away as a test gets.
  const std::string address = address_beyond_loopback(AF_INET);
  if (address.empty()) GTEST_SKIP() << "this machine has no address beyond loopback";
  listen({.address = address, .insecure = true, .limits = {.connections_per_address_max = 2}});
  ASSERT_TRUE(transport);
  std::vector<raw_socket> clients;
  for (int i = 0; i < 3; ++i) {
    raw_socket& client = clients.emplace_back(transport->port(), address.c_str());
    std::string text = upgrade_request(transport->port());
    ASSERT_TRUE(client.send(text.replace(text.find("127.0.0.1"), 9, address)));
    ASSERT_TRUE(drive.until([&] { return client.has("\r\n\r\n"); }));
  }
  EXPECT_EQ(clients[0].text.substr(0, 12), "HTTP/1.1 101");
  EXPECT_EQ(clients[1].text.substr(0, 12), "HTTP/1.1 101");
  EXPECT_EQ(clients[2].text.substr(0, 12), "HTTP/1.1 503");
  ASSERT_TRUE(drive.until([&] { return clients[2].ended(); }));
  EXPECT_FALSE(clients[2].failed);
}

} // namespace
} // namespace handshake_test
} // namespace rowe::net
