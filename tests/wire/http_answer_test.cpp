// SPDX-License-Identifier: Apache-2.0
// What is written: refusals for the peer, clean requests for the HTTP library.
#include "wire/http_request.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>

#include "wire/requests.hpp"

namespace rowe::wire::test {
namespace http_answer_test {
namespace {

TEST(write_refusal, writes_a_complete_answer) {
  const http_judgement j =
      judge_request(upgrade({{"Origin", "Origin: http://evil.example"}}), policy_at(8080));
  std::array<char, http_refusal_bytes_max> room{};
  const std::string body = "Origin http://evil.example is not allowed here\nstart rowe serve with "
                           "--allow-origin http://evil.example\n";
  EXPECT_EQ(
      write_refusal(room, j.refusal),
      "HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: " +
          std::to_string(body.size()) +
          "\r\nConnection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\r\n" +
          body);
}

TEST(write_refusal, says_what_the_status_demands) {
  std::array<char, http_refusal_bytes_max> room{};
  const auto answer = [&room](const std::string& request) {
    return std::string{write_refusal(room, judge_request(request, policy_at(8080)).refusal)};
  };
  const std::string version = answer(upgrade({{"Version", "Sec-WebSocket-Version: 8"}}));
  EXPECT_NE(version.find("\r\nSec-WebSocket-Version: 13\r\n"), std::string::npos);
  EXPECT_NE(version.find("\r\nUpgrade: websocket\r\n"), std::string::npos);
  EXPECT_NE(answer(upgrade({}, "POST / HTTP/1.1")).find("\r\nAllow: GET, HEAD\r\n"), std::string::npos);
  EXPECT_TRUE(answer(header({"HEAD / HTTP/1.1", "Host: evil.example"})).ends_with("\r\n\r\n"));
}

TEST(write_refusal, names_every_status_that_rowe_answers) {
  std::array<char, http_refusal_bytes_max> room{};
  constexpr std::uint16_t statuses[] = {400, 401, 403, 404, 405, 408, 426, 429, 431, 500, 503, 505};
  for (const std::uint16_t status : statuses) {
    http_refusal refusal;
    refusal.set(status, "what", "remedy");
    const std::string_view answer = write_refusal(room, refusal);
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 " + std::to_string(status) + " "));
    EXPECT_FALSE(answer.starts_with("HTTP/1.1 " + std::to_string(status) + " Refused")) << status;
  }
  http_refusal other;
  other.set(418, "what", "remedy");
  EXPECT_TRUE(write_refusal(room, other).starts_with("HTTP/1.1 418 Refused\r\n"));
}

TEST(write_refusal, fits_the_room_it_promises_whatever_the_peer_sent) {
  std::array<char, http_refusal_bytes_max> room{};
  const std::string origin = "Origin: " + std::string(3000, '\xff');
  const http_judgement j = judge_request(upgrade({{"Origin", origin}}), policy_at(8080));
  const std::string_view answer = write_refusal(room, j.refusal);
  ASSERT_FALSE(answer.empty());
  for (const char c : answer) EXPECT_TRUE(c == '\r' || c == '\n' || (c >= 0x20 && c < 0x7f));
  EXPECT_NE(j.refusal.what().find("..."), std::string_view::npos);
  EXPECT_TRUE(write_refusal(std::span{room}.first(100), j.refusal).empty());
  http_refusal longest;
  const std::string text(500, 'x');
  longest.set(426, text, text);
  EXPECT_FALSE(write_refusal(room, longest).empty());
}

TEST(http_refusal, shows_no_control_characters_of_the_peer) {
  http_refusal refusal;
  refusal.set(503, "peer % is one too many", "raise connections_max", "\x1b[2J%\n");
  EXPECT_EQ(refusal.what(), "peer ?[2J%? is one too many");
  EXPECT_EQ(refusal.remedy(), "raise connections_max");
}

TEST(write_clean_request, writes_a_handshake_that_means_the_same) {
  const std::string request = upgrade({{"P", "Sec-WebSocket-Protocol: chat, rowe.v1"},
                                       {"E", "Sec-WebSocket-Extensions: a, b, c"},
                                       {"C", "Cookie: x"}});
  std::array<char, http_clean_bytes_max> room{};
  const std::string_view clean = write_clean_request(room, judge_request(request, policy_at(8080)));
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
  std::array<char, http_clean_bytes_max> room{};
  EXPECT_EQ(write_clean_request(room, judge_request(request, policy_at(8080))),
            "HEAD /a?b HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAccept-Encoding: gzip\r\n"
            "If-None-Match: \"t\"\r\n\r\n");
}

TEST(write_clean_request, writes_nothing_for_what_was_refused_or_where_it_does_not_fit) {
  std::array<char, http_clean_bytes_max> room{};
  EXPECT_TRUE(write_clean_request(room, judge_request(upgrade({{"Key", ""}}), policy_at(8080))).empty());
  const std::string request = upgrade();
  EXPECT_TRUE(
      write_clean_request(std::span{room}.first(80), judge_request(request, policy_at(8080))).empty());
}

} // namespace
} // namespace http_answer_test
} // namespace rowe::wire::test
