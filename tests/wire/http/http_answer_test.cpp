// SPDX-License-Identifier: Apache-2.0
// What is written: rejections for the peer, clean requests for the HTTP library.
#include "wire/http/http_request.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>

#include "wire/requests.hpp"

namespace rowe::wire::test {
namespace http_answer_test {
namespace {

TEST(write_rejection, writes_a_complete_answer) {
  const http_judgement j =
      judge_request(upgrade({{"Origin", "Origin: http://evil.example"}}), policy_at(8080));
  std::array<char, http_rejection_bytes_max> buffer{};
  const std::string body = "Origin http://evil.example is not allowed here\nstart rowe serve with "
                           "--allow-origin http://evil.example\n";
  EXPECT_EQ(
      write_rejection(buffer, j.rejection),
      "HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: " +
          std::to_string(body.size()) +
          "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\r\n" +
          body);
}

TEST(write_rejection, says_what_the_status_demands) {
  std::array<char, http_rejection_bytes_max> buffer{};
  const auto answer = [&buffer](const std::string& request) {
    return std::string{write_rejection(buffer, judge_request(request, policy_at(8080)).rejection)};
  };
  const std::string version = answer(upgrade({{"Version", "Sec-WebSocket-Version: 8"}}));
  EXPECT_NE(version.find("\r\nSec-WebSocket-Version: 13\r\n"), std::string::npos);
  EXPECT_NE(version.find("\r\nUpgrade: websocket\r\n"), std::string::npos);
  EXPECT_NE(answer(upgrade({}, "POST / HTTP/1.1")).find("\r\nAllow: GET, HEAD\r\n"), std::string::npos);
  EXPECT_TRUE(answer(header({"HEAD / HTTP/1.1", "Host: evil.example"})).ends_with("\r\n\r\n"));
}

TEST(write_rejection, fits_the_buffer_it_promises_whatever_the_peer_sent) {
  std::array<char, http_rejection_bytes_max> buffer{};
  std::string origin = "Origin: http://";
  for (int i = 0; i < 1500; ++i) origin += "a.";
  const http_judgement j = judge_request(upgrade({{"Origin", origin}}), policy_at(8080));
  const std::string_view answer = write_rejection(buffer, j.rejection);
  ASSERT_FALSE(answer.empty());
  for (const char c : answer) EXPECT_TRUE(c == '\r' || c == '\n' || (c >= 0x20 && c < 0x7f));
  EXPECT_NE(j.rejection.what().find("..."), std::string_view::npos);
  EXPECT_TRUE(write_rejection(std::span{buffer}.first(100), j.rejection).empty());
  http_rejection longest;
  const std::string text(500, 'x');
  longest.set(426, text, text);
  EXPECT_FALSE(write_rejection(buffer, longest).empty());
  longest.set(401, text, text);
  longest.to_form = true;
  EXPECT_FALSE(write_rejection(buffer, longest).empty());
}

TEST(write_rejection, leads_who_logs_in_back_to_the_form_and_takes_no_markup) {
  std::array<char, http_rejection_bytes_max> buffer{};
  http_rejection rejection;
  rejection.set(401, "no % here", "<i>try</i> & again", "<script>");
  rejection.to_form = true;
  const std::string answer{write_rejection(buffer, rejection)};
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 401 Unauthorized\r\nContent-Type: text/html; charset=utf-8\r\n"));
  const std::string body = answer.substr(answer.find("\r\n\r\n") + 4);
  EXPECT_NE(answer.find("\r\nContent-Length: " + std::to_string(body.size()) + "\r\n"), std::string::npos);
  EXPECT_NE(body.find("<h1>no ?script> here</h1><p>?i>try?/i> ? again</p>"), std::string::npos) << body;
  EXPECT_NE(body.find("<a href=\"/rowe/login\">Log in</a>"), std::string::npos) << body;
}

TEST(http_rejection, shows_no_control_characters_of_the_peer) {
  http_rejection rejection;
  rejection.set(503, "peer % is one too many", "raise connections_max", "\x1b[2J%\n");
  EXPECT_EQ(rejection.what(), "peer ?[2J%? is one too many");
  EXPECT_EQ(rejection.remedy(), "raise connections_max");
}

TEST(write_clean_request, writes_a_handshake_that_means_the_same) {
  const std::string request = upgrade({{"P", "Sec-WebSocket-Protocol: chat, rowe.v1"},
                                       {"E", "Sec-WebSocket-Extensions: a, b, c"},
                                       {"C", "Cookie: x"}});
  std::array<char, http_clean_bytes_max> buffer{};
  const std::string_view clean = write_clean_request(buffer, judge_request(request, policy_at(8080)));
  EXPECT_EQ(clean,
            "GET /x?y=1 HTTP/1.1\r\nHost: localhost:8080\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Protocol: rowe.v1\r\n\r\n");
  const http_judgement again = judge_request(clean, policy_at(8080));
  EXPECT_EQ(again.outcome, http_outcome::upgrade);
  EXPECT_EQ(again.subprotocol, "rowe.v1");
}

TEST(write_clean_request, writes_a_page_request_that_means_the_same) {
  const std::string request =
      header({"HEAD /a?b HTTP/1.1", "Host: localhost", "Cookie: x", "If-None-Match: \"t\"",
              "Accept-Encoding: gzip, br", "Connection: keep-alive"});
  std::array<char, http_clean_bytes_max> buffer{};
  EXPECT_EQ(write_clean_request(buffer, judge_request(request, policy_at(8080))),
            "HEAD /a?b HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAccept-Encoding: gzip\r\n"
            "If-None-Match: \"t\"\r\n\r\n");
}

TEST(write_clean_request, writes_nothing_for_what_was_refused_or_where_it_does_not_fit) {
  std::array<char, http_clean_bytes_max> buffer{};
  EXPECT_TRUE(write_clean_request(buffer, judge_request(upgrade({{"Key", ""}}), policy_at(8080))).empty());
  const std::string request = upgrade();
  EXPECT_TRUE(
      write_clean_request(std::span{buffer}.first(80), judge_request(request, policy_at(8080))).empty());
}

} // namespace
} // namespace http_answer_test
} // namespace rowe::wire::test
