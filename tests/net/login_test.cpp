// SPDX-License-Identifier: Apache-2.0
// The form of the log-in, over a plain port and under TLS; and who abuses it.
#include "net/handshakes/token_tries.hpp"
#include "tls_support.hpp"

namespace rowe::net {
namespace login_test {
namespace {

constexpr std::string_view good = "a-token-of-some-length";

std::string post(std::uint16_t port, std::string_view more,
                 std::string_view body = "token=a-token-of-some-length",
                 std::string_view path = "/rowe/login") {
  return "POST " + std::string{path} + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" +
         std::string{more} + "Content-Type: application/x-www-form-urlencoded\r\n\r\n" + std::string{body};
}

// Knows one token.
void know(recording_sink& sink, std::vector<std::string>& asked) {
  sink.when_page_asked = [&asked](const service::credentials& shown) -> service::admit_answer {
    if (!shown.typed_in) return {};
    asked.emplace_back(shown.token);
    if (shown.token == good && !shown.in_url) return {};
    return {.status = 401, .what = "this token is not known here", .remedy = "ask"};
  };
}

struct plain_login : served {
  std::uint16_t port = transport->port();
  std::string own = "Origin: http://127.0.0.1:" + std::to_string(port) + "\r\n";
  std::vector<std::string> asked;
  plain_login() { know(drive.sink(), asked); }

  std::string answer_to(const std::string& request) {
    const raw_socket client = answered_whole(drive, *transport, request);
    EXPECT_FALSE(client.failed) << "a reset may destroy the answer";
    return client.text;
  }
};

TEST_F(plain_login, sets_a_cookie) {
  const std::string answer = answer_to(post(port, own + "Content-Length: 28\r\n"));
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 303 See Other\r\nLocation: /\r\n")) << answer;
  EXPECT_NE(answer.find("Set-Cookie: rowe-" + std::to_string(port) + "=" + std::string{good} + "; Path=/; "),
            std::string::npos);
  EXPECT_EQ(asked, std::vector<std::string>{std::string{good}});
  EXPECT_TRUE(drive.sink().rejections.empty());
  EXPECT_TRUE(drive.sink().pages.empty());
}

TEST_F(plain_login, takes_a_form_that_comes_byte_by_byte_and_ignores_what_follows) {
  raw_socket client{port};
  const std::string request = post(port, own + "Content-Length: 28\r\n");
  for (const char c : request) {
    ASSERT_TRUE(client.send({&c, 1}));
    drive.turn();
  }
  ASSERT_TRUE(client.send("GET /more HTTP/1.1\r\n\r\n"));
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 303 "));
  EXPECT_EQ(asked.size(), 1U);
  EXPECT_TRUE(drive.sink().pages.empty());
}

TEST_F(plain_login, says_that_nobody_has_the_token_and_slows_who_tries_many) {
  const std::string wrong = post(port, own + "Content-Length: 28\r\n", "token=b-token-of-some-length");
  for (std::uint32_t i = 0; i < token_tries::wrong_max; ++i)
    ASSERT_TRUE(answer_to(wrong).starts_with("HTTP/1.1 401 ")) << i;
  const auto before = rt::monotonic_clock::now();
  EXPECT_TRUE(answer_to(wrong).starts_with("HTTP/1.1 429 "));
  EXPECT_GE(rt::monotonic_clock::now() - before, token_tries::answered_after);
  EXPECT_EQ(transport->counters().handshakes_slowed, 1U);
  EXPECT_TRUE(answer_to(post(port, own + "Content-Length: 28\r\n")).starts_with("HTTP/1.1 303 "));
  for (const auto& one : drive.sink().rejections) {
    EXPECT_EQ(one.what.find("b-token"), std::string::npos);
    EXPECT_EQ(one.remedy.find("b-token"), std::string::npos);
  }
}

TEST_F(plain_login, takes_no_token_from_anywhere_but_the_form) {
  const std::string answer =
      answer_to(post(port, own + "Authorization: Bearer " + std::string{good} + "\r\nContent-Length: 0\r\n",
                     "", "/rowe/login?token=" + std::string{good}));
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 401 ")) << answer;
  EXPECT_NE(answer.find("<a href=\"/rowe/login\">"), std::string::npos) << "there is a way back to the form";
  EXPECT_EQ(asked, std::vector<std::string>{""});
}

TEST_F(plain_login, ends_with_the_log_out) {
  const std::string answer = answer_to(post(port, own + "Content-Length: 0\r\n", "", "/rowe/logout"));
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 303 See Other\r\nLocation: /rowe/login\r\n")) << answer;
  EXPECT_NE(answer.find("Max-Age=0"), std::string::npos);
  EXPECT_TRUE(asked.empty()) << "whoever logs out shows no token";
}

TEST_F(plain_login, is_refused_at_once_where_its_length_is_not_right) {
  for (const auto& [lines, status] : {std::pair{"", "411"},
                                      {"Transfer-Encoding: chunked\r\n", "411"},
                                      {"Content-Length: 513\r\n", "413"},
                                      {"Content-Length: 4294967297\r\n", "413"},
                                      {"Content-Length: nought\r\n", "400"},
                                      {"Content-Length: 5\r\nContent-Length: 5\r\n", "400"}})
    EXPECT_TRUE(answer_to(post(port, own + lines, "")).starts_with("HTTP/1.1 " + std::string{status} + " "))
        << lines;
  EXPECT_TRUE(answer_to(post(port, own + "Content-Length: 600\r\n", std::string(600, 'x')))
                  .starts_with("HTTP/1.1 413 "));
  EXPECT_TRUE(asked.empty());
}

TEST_F(plain_login, has_the_time_of_a_header_for_its_form) {
  raw_socket client{port};
  ASSERT_TRUE(client.send(post(port, own + "Content-Length: 28\r\n", "token=a-tok")));
  drive.stop_clock();
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  for (int i = 0; i < 10; ++i) drive.turn();
  drive.skip(socket_limits{}.header_timeout - 1ms);
  drive.turn();
  EXPECT_FALSE(client.has("HTTP/1.1"));
  drive.skip(2ms);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 408 ")) << client.text;
  EXPECT_TRUE(asked.empty());
}

TEST_F(plain_login, lets_slow_forms_keep_nobody_out) {
  std::vector<raw_socket> slow;
  const std::uint32_t places = socket_limits{}.handshakes_max;
  for (std::uint32_t i = 0; i < 2 * places; ++i) {
    slow.emplace_back(port);
    ASSERT_TRUE(slow.back().send(post(port, own + "Content-Length: 28\r\n", "token=")));
    drive.turn();
  }
  (void)upgraded(drive, *transport);
  EXPECT_GE(transport->counters().handshakes_evicted, places);
}

struct tls_login : served_tls {};

TEST_F(tls_login, sets_a_cookie_that_only_tls_carries) {
  std::vector<std::string> asked;
  know(drive.sink(), asked);
  const std::string port = std::to_string(transport->port());
  const std::string request =
      post(transport->port(), "Origin: https://127.0.0.1:" + port + "\r\nContent-Length: 28\r\n");
  for (const std::size_t cut : {request.size(), request.size() - 28, request.size() - 5, std::size_t{7}}) {
    tls_socket client{transport->port()};
    ASSERT_TRUE(asks(drive, client, request.substr(0, cut))) << client.fault;
    for (int i = 0; i < 20; ++i) drive.turn();
    if (cut < request.size()) {
      ASSERT_TRUE(client.send(request.substr(cut)));
    }
    ASSERT_TRUE(drive.until([&] { return client.ended(); }));
    EXPECT_TRUE(client.ended_well);
    EXPECT_TRUE(client.text.starts_with("HTTP/1.1 303 ")) << cut << client.text;
    EXPECT_NE(client.text.find("Set-Cookie: __Host-rowe-" + port + "=" + std::string{good} +
                               "; Path=/; HttpOnly; SameSite=Strict; Secure\r\n"),
              std::string::npos);
  }
  EXPECT_EQ(asked.size(), 4U);
  EXPECT_TRUE(drive.sink().rejections.empty());
}

TEST_F(tls_login, has_the_time_of_a_header_for_its_form) {
  listen({.header_timeout = 300ms});
  tls_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return client.shaken(); }));
  const std::string own = "Origin: https://127.0.0.1:" + std::to_string(transport->port()) + "\r\n";
  ASSERT_TRUE(client.send(post(transport->port(), own + "Content-Length: 28\r\n", "token=")));
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 408 ")) << client.text;
}

TEST_F(tls_login, lets_slow_forms_keep_nobody_out) {
  listen({.handshakes_max = 8});
  std::vector<std::unique_ptr<tls_socket>> slow;
  const std::string own = "Origin: https://127.0.0.1:" + std::to_string(transport->port()) + "\r\n";
  for (int i = 0; i < 16; ++i) {
    slow.push_back(std::make_unique<tls_socket>(transport->port()));
    ASSERT_TRUE(asks(drive, *slow.back(), post(transport->port(), own + "Content-Length: 28\r\n", "token=")));
  }
  tls_socket client{transport->port()};
  ASSERT_TRUE(asks(drive, client, upgrade_request(transport->port())));
  ASSERT_TRUE(
      drive.until([&] { return client.text.find("\r\n\r\n") != std::string::npos || client.ended(); }));
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 101 ")) << client.text;
}

TEST_F(plain_login, has_a_page_that_may_send_its_form_and_tell_its_origin) {
  drive.sink().answer = [](const service::http_request& request) {
    service::http_answer answer = page_of("a page");
    if (request.path == "/rowe/login") answer.kind = service::page_kind::form;
    return answer;
  };
  for (const auto& [path, action, referrer] :
       {std::tuple{"/rowe/login", "form-action 'self'", "referrer-policy: same-origin\r\n"},
        {"/", "form-action 'none'", "referrer-policy: no-referrer\r\n"}}) {
    raw_socket client = answered_whole(drive, *transport, request(transport->port(), path));
    EXPECT_NE(client.text.find(action), std::string::npos) << client.text;
    EXPECT_NE(client.text.find(referrer), std::string::npos) << client.text;
  }
}

} // namespace
} // namespace login_test
} // namespace rowe::net
