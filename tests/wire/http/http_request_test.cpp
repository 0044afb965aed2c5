// SPDX-License-Identifier: Apache-2.0
#include "wire/http/http_request.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "wire/requests.hpp"

namespace rowe::wire::test {
namespace http_request_test {
namespace {

using namespace std::string_view_literals;

TEST(find_header_end, ends_a_header_of_bare_line_feeds_too) {
  for (const std::string_view bytes :
       {"GET / HTTP/1.1\n\n"sv, "GET / HTTP/1.1\n\r\n"sv, "GET / HTTP/1.1\r\n\n"sv}) {
    EXPECT_EQ(find_header_end(bytes), bytes.size());
    for (std::size_t scanned = 0; scanned < bytes.size(); ++scanned) {
      EXPECT_EQ(find_header_end(bytes, scanned), bytes.size()) << scanned;
    }
  }
  EXPECT_EQ(find_header_end("GET / HTTP/1.1\r\nA: b\r\n"), 0U);
  EXPECT_EQ(find_header_end(""), 0U);
}

TEST(judge_request, takes_gzip_only_where_it_is_wanted) {
  handshake_policy policy = policy_at(8080);
  const auto gzip = [&policy](std::string_view line) {
    const http_judgement j = judge_request(header({"GET / HTTP/1.1", "Host: localhost", line}), policy);
    EXPECT_EQ(j.outcome, http_outcome::page);
    return j.accepts_gzip;
  };
  EXPECT_TRUE(gzip("Accept-Encoding: gzip"));
  EXPECT_TRUE(gzip("Accept-Encoding: deflate , GZIP ; q=0.01"));
  EXPECT_FALSE(gzip("Accept-Encoding: gzip;q=0"));
  EXPECT_FALSE(gzip("Accept-Encoding: gzip; q=0.000"));
  EXPECT_FALSE(gzip("Accept-Encoding: gzipped"));
  EXPECT_FALSE(gzip("Accept: gzip"));
  policy.secure = true;
  EXPECT_FALSE(gzip("Accept-Encoding: gzip")) << "under TLS nothing is compressed";
}

TEST(judge_request, ignores_entity_tags_that_come_in_two_fields) {
  const http_judgement j = judge_request(
      header({"GET / HTTP/1.1", "Host: localhost", "If-None-Match: \"a\"", "If-None-Match: \"b\""}),
      policy_at(8080));
  EXPECT_EQ(j.outcome, http_outcome::page);
  EXPECT_EQ(j.if_none_match, "");
}

// The request line

TEST(judge_request, refuses_methods_other_than_get_and_head) {
  for (const std::string_view method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "get"}) {
    const std::string first = std::string{method} + " / HTTP/1.1";
    EXPECT_TRUE(refused(upgrade({}, first), 405, method, "use GET"));
    EXPECT_TRUE(refused(header({first, "Host: localhost"}), 405, method, "use GET"));
  }
  EXPECT_TRUE(refused(header({"CONNECT localhost:22 HTTP/1.1", "Host: localhost"}), 405, "CONNECT"));
  EXPECT_TRUE(refused(upgrade({}, "HEAD / HTTP/1.1"), 405, "HEAD", "use GET"));
}

TEST(judge_request, refuses_other_versions_of_http) {
  for (const std::string_view version : {"HTTP/1.0", "HTTP/0.9", "HTTP/2.0", "HTTP/1.10"}) {
    EXPECT_TRUE(refused(upgrade({}, "GET / " + std::string{version}), 505, "is not spoken here", "HTTP/1.1"));
  }
  EXPECT_TRUE(refused("PRI * HTTP/2.0\r\n\r\n", 505, "HTTP/2.0"));
}

TEST(judge_request, refuses_malformed_request_lines) {
  for (const std::string_view first :
       {"GET /", "GET", "", " GET / HTTP/1.1", "GET  / HTTP/1.1", "GET /a b HTTP/1.1", "GET / HTTP/1.1 ",
        "GET / http/1.1", "G@T / HTTP/1.1", "\x16\x03\x01 / HTTP/1.1", "GET / FTP/1.1"}) {
    EXPECT_TRUE(refused(header({first, "Host: localhost"}), 400, "")) << first;
  }
}

TEST(judge_request, refuses_targets_that_are_no_path) {
  for (const std::string_view target : {"http://localhost:8080/", "*", "x", "/#part", "/\xc3\xa4", "/\x7f"}) {
    EXPECT_TRUE(refused(header({"GET " + std::string{target} + " HTTP/1.1", "Host: localhost"}), 400, ""))
        << target;
  }
}

// Header lines

TEST(judge_request, refuses_malformed_lines_and_numbers_them) {
  EXPECT_TRUE(refused(upgrade({{"X", "no colon"}}), 400, "no colon"));
  EXPECT_TRUE(refused(upgrade({{"X", "Name : value"}}), 400, "malformed: line 7"));
  EXPECT_TRUE(refused(upgrade({{"X", ": value"}}), 400, "malformed: line 7"));
  EXPECT_TRUE(refused(upgrade({{"X", "Na(me: value"}}), 400, "malformed: line 7"));
  EXPECT_TRUE(refused(upgrade({{"X", " folded: value"}}), 400, "folded"));
  EXPECT_TRUE(refused(upgrade({{"X", "\tfolded"}}), 400, "folded"));
  EXPECT_TRUE(refused(upgrade({{"X", "A: b\nC: d"}}), 400, "CR LF"));
  EXPECT_TRUE(refused(upgrade({{"X", "A: b\rC: d"}}), 400, "CR LF"));
  EXPECT_TRUE(refused(upgrade({{"X", "A: \x01"}}), 400, "control"));
  EXPECT_TRUE(refused(upgrade({{"X", "A: \0"sv}}), 400, "control"));
  EXPECT_TRUE(refused(upgrade({{"X", "A: \x7f"}}), 400, "control"));
}

TEST(judge_request, refuses_headers_that_do_not_end_where_they_should) {
  EXPECT_TRUE(refused(upgrade() + "x", 400, "does not end"));
  EXPECT_TRUE(refused("GET / HTTP/1.1\r\nHost: localhost\r\n", 400, "does not end"));
  EXPECT_TRUE(refused("GET / HTTP/1.1\nHost: localhost\n\n", 400, "CR LF"));
  EXPECT_TRUE(refused("", 400, "does not end"));
}

TEST(judge_request, refuses_fields_that_decide_and_stand_there_twice) {
  for (const std::string_view line :
       {"Host: localhost:8080", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="}) {
    EXPECT_TRUE(refused(upgrade({{"X", line}}), 400, "twice")) << line;
  }
  EXPECT_TRUE(
      refused(upgrade({{"A", "Origin: http://localhost:8080"}, {"B", "origin: http://localhost:8080"}}), 400,
              "origin", "once"));
  EXPECT_TRUE(refused(upgrade({{"A", "Content-Length: 0"}, {"B", "Content-Length: 0"}}), 400, "twice"));
}

// The upgrade

TEST(judge_request, refuses_upgrades_to_anything_but_websocket) {
  for (const std::string_view value :
       {"h2c", "websocket, h2c", "h2c, websocket", "TLS/1.0", "websocket/13", ""}) {
    EXPECT_TRUE(refused(upgrade({{"Upgrade", "Upgrade: " + std::string{value}}}), 400, "is not offered here"))
        << value;
  }
  EXPECT_TRUE(refused(header({"GET / HTTP/1.1", "Host: localhost", "Connection: Upgrade, HTTP2-Settings",
                              "Upgrade: h2c", "HTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA"}),
                      400, "h2c"));
}

TEST(judge_request, refuses_a_handshake_without_upgrade_connection_or_key) {
  EXPECT_TRUE(
      refused(upgrade({{"Upgrade", ""}}), 426, "Upgrade header is missing", "send Upgrade: websocket"));
  EXPECT_TRUE(refused(upgrade({{"Connection", ""}}), 400, "Connection", "proxy"));
  EXPECT_TRUE(
      refused(upgrade({{"Connection", "Connection: keep-alive, upgraded"}}), 400, "Connection", "proxy"));
  EXPECT_TRUE(refused(upgrade({{"Key", ""}}), 400, "Sec-WebSocket-Key is missing", "16 random bytes"));
}

TEST(judge_request, refuses_other_versions_of_websocket) {
  EXPECT_TRUE(refused(upgrade({{"Version", ""}}), 426, "missing", "13"));
  for (const std::string_view version : {"8", "12", "99", "013", "13, 8", ""}) {
    EXPECT_TRUE(
        refused(upgrade({{"Version", "Sec-WebSocket-Version: " + std::string{version}}}), 426, "", "13"));
  }
}

TEST(judge_request, refuses_bodies) {
  EXPECT_TRUE(refused(upgrade({{"X", "Content-Length: 5"}}), 400, "Content-Length 5", "no body"));
  EXPECT_TRUE(refused(upgrade({{"X", "Content-Length: -1"}}), 400, "Content-Length -1"));
  EXPECT_TRUE(refused(upgrade({{"X", "Content-Length: 0x0"}}), 400, "Content-Length 0x0"));
  EXPECT_TRUE(refused(upgrade({{"X", "Content-Length:"}}), 400, "Content-Length"));
  EXPECT_TRUE(refused(upgrade({{"X", "Transfer-Encoding: chunked"}}), 400, "Transfer-Encoding chunked"));
  EXPECT_TRUE(
      refused(header({"GET / HTTP/1.1", "Host: localhost", "Content-Length: 3"}), 400, "Content-Length 3"));
  EXPECT_TRUE(accepted(upgrade({{"X", "Content-Length: 0"}})));
}

// Subprotocols

TEST(judge_request, refuses_subprotocols_none_of_which_it_speaks) {
  EXPECT_TRUE(
      refused(upgrade({{"P", "Sec-WebSocket-Protocol: chat, ROWE.V1"}}), 400, "chat", "offer rowe.v1"));
  EXPECT_TRUE(
      refused(upgrade({{"P", "Sec-WebSocket-Protocol: chat"}}), 400, "chat", "offer none", {.port = 8080}));
  EXPECT_TRUE(refused(upgrade({{"P", "Sec-WebSocket-Protocol: a b"}}), 400, "malformed"));
}

// Tokens

struct shown {
  std::string token;
  bool in_url;
  std::string subprotocol;
};
shown token_of(std::initializer_list<change> changes, std::string_view first = "GET /x HTTP/1.1") {
  const std::string request = upgrade(changes, first);
  const http_judgement j = judge_request(request, policy_at(8080));
  EXPECT_EQ(j.outcome, http_outcome::upgrade) << j.rejection.what();
  return {std::string{j.token}, j.token_in_url, std::string{j.subprotocol}};
}

TEST(judge_request, finds_a_token_in_the_header_in_a_subprotocol_and_in_the_url) {
  EXPECT_EQ(token_of({}).token, "");
  EXPECT_EQ(token_of({{"A", "Authorization: Bearer abc"}}).token, "abc");
  EXPECT_EQ(token_of({{"A", "authorization: bEARER  abc "}}).token, "abc");
  const shown offered = token_of({{"P", "Sec-WebSocket-Protocol: rowe.token.abc, rowe.v1"}});
  EXPECT_EQ(offered.token, "abc");
  EXPECT_EQ(offered.subprotocol, "rowe.v1"); // never the token
  EXPECT_EQ(token_of({{"P", "Sec-WebSocket-Protocol: rowe.token.abc"}}).subprotocol, "");
  for (const auto& [first, token] : {std::pair{"GET /x?token=abc HTTP/1.1", "abc"},
                                     {"GET /x?a=1&token=abc&b=2 HTTP/1.1", "abc"},
                                     {"GET /x?mytoken=abc HTTP/1.1", ""},
                                     {"GET /x?token= HTTP/1.1", ""},
                                     {"GET /x?token=&token=abc HTTP/1.1", "abc"},
                                     {"GET /x?& HTTP/1.1", ""}}) {
    const shown found = token_of({}, first);
    EXPECT_EQ(found.token, token) << first;
    EXPECT_EQ(found.in_url, !found.token.empty()) << first;
  }
}

TEST(judge_request, finds_the_token_of_who_asks_for_a_page) {
  for (const auto& [text, in_url] :
       {std::pair{"GET /metrics HTTP/1.1\r\nHost: localhost:8080\r\nAuthorization: Bearer abc\r\n\r\n",
                  false},
        {"HEAD /metrics?token=abc HTTP/1.1\r\nHost: localhost:8080\r\n\r\n", true}}) {
    const http_judgement j = judge_request(text, policy_at(8080));
    EXPECT_EQ(j.outcome, http_outcome::page) << j.rejection.what();
    EXPECT_EQ(j.token, "abc");
    EXPECT_EQ(j.token_in_url, in_url);
    EXPECT_EQ(j.path, "/metrics");
  }
}

TEST(judge_request, takes_the_header_before_the_subprotocol_before_the_url) {
  const shown first =
      token_of({{"A", "Authorization: Bearer one"}, {"P", "Sec-WebSocket-Protocol: rowe.token.two, rowe.v1"}},
               "GET /x?token=three HTTP/1.1");
  EXPECT_EQ(first.token, "one");
  const shown second =
      token_of({{"P", "Sec-WebSocket-Protocol: rowe.v1, rowe.token.two"}}, "GET /x?token=three HTTP/1.1");
  EXPECT_EQ(second.token, "two");
  EXPECT_FALSE(second.in_url);
  EXPECT_EQ(token_of({{"A", "Authorization: Basic abc"}}).token, ""); // for a proxy
  EXPECT_TRUE(
      refused(upgrade({{"A", "Authorization: Bearer a"}, {"B", "Authorization: Bearer b"}}), 400, "twice"));
}

TEST(judge_request, refuses_two_tokens_of_one_kind) {
  EXPECT_TRUE(refused(upgrade({{"P", "Sec-WebSocket-Protocol: rowe.token.a, rowe.v1, rowe.token.b"}}), 400,
                      "two tokens are offered as subprotocols", "offer one"));
  EXPECT_TRUE(refused(
      upgrade({{"P", "Sec-WebSocket-Protocol: rowe.token.a"}, {"Q", "Sec-WebSocket-Protocol: rowe.token.a"}}),
      400, "two tokens are offered as subprotocols", "offer one"));
  EXPECT_TRUE(
      refused(upgrade({}, "GET /x?token=a&token=a HTTP/1.1"), 400, "two tokens are in the URL", "send one"));
  EXPECT_TRUE(refused(upgrade({{"A", "Authorization: Bearer one"}}, "GET /?token=a&b&token=c HTTP/1.1"), 400,
                      "two tokens are in the URL", "send one"));
}

// Wherever a client has put its token, no rejection repeats it.
void repeats_nothing_of(const std::string& secret) {
  const std::vector<std::string> placed = {secret,
                                           secret + "@localhost",
                                           "user:" + secret + "@localhost",
                                           "http://" + secret + "@localhost:8080",
                                           secret + ".local",
                                           "http://" + secret,
                                           "token=" + secret,
                                           "Bearer " + secret,
                                           "rowe.token." + secret,
                                           "Rowe.Token." + secret,
                                           "chat, " + secret,
                                           secret + " x",
                                           secret + "\x01",
                                           "x\r\n " + secret,
                                           secret + "\n"};
  std::vector<std::string> requests;
  const auto both = [&](const std::string& first, const std::vector<std::string>& fields) {
    std::string more;
    for (const std::string& field : fields) more += field + "\r\n";
    for (const char* const host : {"localhost", "evil.example"})
      for (const bool upgrades : {false, true}) {
        std::string request = first + "\r\nHost: " + host + "\r\n" + more;
        if (upgrades)
          request += "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 12\r\n"
                     "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n";
        requests.push_back(request + "\r\n");
      }
  };
  for (const std::string& text : placed) {
    for (const std::string& first : {text + " / HTTP/1.1", "GET " + text + " HTTP/1.1", "GET / " + text,
                                     "GET /" + text + " HTTP/1.0", "GET /?" + text + "# HTTP/1.1", text,
                                     "POST /" + text + " HTTP/1.1", "GET /?token=a " + text + " HTTP/1.1"})
      both(first, {});
    for (const char* const name :
         {"Host", "Origin", "Upgrade", "Connection", "Sec-WebSocket-Version", "Sec-WebSocket-Key",
          "Sec-WebSocket-Protocol", "Sec-WebSocket-Extensions", "Content-Length", "Content-Type",
          "Transfer-Encoding", "Authorization", "Cookie", "Accept-Encoding", "If-None-Match", "User-Agent"}) {
      const std::string field = std::string{name} + ": " + text;
      both("GET / HTTP/1.1", {field});
      both("GET / HTTP/1.1", {field, field}); // twice
      both("POST /login HTTP/1.1", {"Origin: http://localhost:8080", field});
      requests.push_back("GET / HTTP/1.1\r\n" + field + "\r\n\r\n");
    }
    both("GET / HTTP/1.1", {text});
    both("GET / HTTP/1.1", {text + ": x"});
    both("GET / HTTP/1.1", {"Cookie : " + text});
    both("GET / HTTP/1.1", {text + ": x", text + ": x"});
  }
  int rejected = 0;
  for (const std::string& request : requests) {
    const http_judgement j = judge_request(request, policy_at(8080));
    if (j.outcome != http_outcome::rejected) continue;
    ++rejected;
    for (const std::string_view text : {j.rejection.what(), j.rejection.remedy()})
      for (const char* const part : {"s3cret", "S3CRET"})
        EXPECT_EQ(text.find(part), std::string_view::npos) << text << "\nof\n" << request;
  }
  EXPECT_GT(rejected, 1000);
}

TEST(judge_request, repeats_nothing_that_may_be_a_token) {
  repeats_nothing_of("s3cret-S3CRET_s3cret-S3CRET");
  repeats_nothing_of("s3cret-S3CRET_s3"); // no token is shorter
}

TEST(judge_request, repeats_what_is_known_to_be_harmless) {
  EXPECT_TRUE(
      refused(upgrade({{"Host", "Host: robot.local:8080"}}), 403, "Host robot.local:8080", "robot.local"));
  EXPECT_TRUE(
      refused(upgrade({{"X", "Origin: https://lab.example:8000"}}), 403, "Origin https://lab.example:8000"));
  EXPECT_TRUE(refused(upgrade({{"P", "Sec-WebSocket-Protocol: graphql-ws"}}), 400, "graphql-ws"));
  EXPECT_TRUE(
      refused(upgrade({{"Host", "Host: fifteen-letters.example"}}), 403, "Host fifteen-letters.example"));
}

} // namespace
} // namespace http_request_test
} // namespace rowe::wire::test
