// SPDX-License-Identifier: Apache-2.0
#include "support.hpp"

#include <deque>
#include <thread>

#include "net/http/http_page.hpp"

namespace rowe::net {
namespace page_test {
namespace {

// A server with one page: "/" is "<html>rowe</html>" with an ETag.
struct page : testing::Test {
  std::unique_ptr<socket_transport> transport;
  driver drive{*transport};
  std::string body = "<html>rowe</html>";
  bool lasts = false; // the body

  explicit page(std::size_t heap_bytes = 16 << 20)
      : transport{listening({.limits = {.handshake_bytes = heap_bytes}})} {
    drive.sink().answer = [this](const service::http_request& asked) -> service::http_answer {
      if (asked.path != "/") return {};
      return {.status = 200,
              .content_type = "text/html; charset=utf-8",
              .content_encoding = asked.accepts_gzip ? "gzip" : "",
              .etag = "\"v1\"",
              .cache_control = "no-cache",
              .lasts = lasts,
              .body = std::as_bytes(std::span{body})};
    };
  }

  raw_socket ask(std::string_view text) {
    raw_socket client = answered_whole(drive, *transport, text);
    EXPECT_FALSE(client.failed) << "the answer came with a reset";
    return client;
  }
  raw_socket get(std::string_view path, std::string_view more = {}) {
    return ask(request(transport->port(), path, more));
  }
};

std::string body_of(const raw_socket& client) {
  const auto end = client.text.find("\r\n\r\n");
  return end == std::string::npos ? "no header" : client.text.substr(end + 4);
}

TEST_F(page, is_answered_with_the_headers_that_protect_it) {
  raw_socket client = get("/?from=bookmark");
  EXPECT_EQ(client.text.substr(0, 17), "HTTP/1.1 200 OK\r\n");
  for (const std::string_view line :
       {"content-type: text/html; charset=utf-8\r\n", "content-length: 17\r\n", "etag: \"v1\"\r\n",
        "cache-control: no-cache\r\n", "cross-origin-resource-policy: same-origin\r\n",
        "x-content-type-options: nosniff\r\n", "connection: close\r\n",
        "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src "
        "'self'; "
        "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"})
    EXPECT_TRUE(client.has(line)) << line << "is missing in\n" << client.text;
  EXPECT_FALSE(client.has("content-encoding"));
  EXPECT_EQ(body_of(client), body);
  ASSERT_EQ(drive.sink().pages.size(), 1U);
  EXPECT_EQ(drive.sink().pages[0].path, "/");
  EXPECT_FALSE(drive.sink().pages[0].accepts_gzip);
  EXPECT_TRUE(drive.sink().opens.empty());
  EXPECT_TRUE(drive.sink().rejections.empty());
}

TEST_F(page, says_when_its_body_is_compressed) {
  raw_socket client = get("/", "Accept-Encoding: br, gzip\r\n");
  EXPECT_TRUE(drive.sink().pages.at(0).accepts_gzip);
  EXPECT_TRUE(client.has("content-encoding: gzip\r\n"));
}

TEST_F(page, is_not_sent_again_to_who_has_it) {
  raw_socket client = get("/", "If-None-Match: \"v0\", W/\"v1\"\r\n");
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 304");
  EXPECT_TRUE(client.has("etag: \"v1\"\r\n"));
  EXPECT_EQ(body_of(client), "");
  client = get("/", "If-None-Match: \"v0\"\r\n");
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 200");
  EXPECT_EQ(drive.sink().pages.at(1).if_none_match, "\"v0\"");
}

TEST_F(page, answers_head_with_the_length_and_without_the_body) {
  std::string text = request(transport->port(), "/");
  raw_socket client = ask(text.replace(0, 3, "HEAD"));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 200");
  EXPECT_TRUE(client.has("content-length: 17\r\n"));
  EXPECT_EQ(body_of(client), "");
}

TEST_F(page, is_404_where_there_is_none) {
  raw_socket client = get("/nothing%20here/%2e%2e/%zz");
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 404");
  EXPECT_EQ(drive.sink().pages.at(0).path, "/nothing%20here/%2e%2e/%zz");
}

TEST_F(page, is_sent_whole_to_who_asks_for_more_on_the_same_connection) {
  const std::string once = request(transport->port(), "/");
  raw_socket client = ask(once + once + once);
  EXPECT_EQ(body_of(client), body);
  EXPECT_EQ(drive.sink().pages.size(), 1U);
}

TEST_F(page, is_sent_to_who_shuts_its_own_end) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send(request(transport->port(), "/")));
  client.shut();
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_EQ(body_of(client), body);
}

TEST_F(page, reaches_a_slow_reader_whole_though_the_body_changes_after_the_poll) {
  body.resize(8 << 20, 'x');
  for (std::size_t i = 0; i < body.size(); i += 4096) body[i] = static_cast<char>('a' + i / 4096 % 26);
  const std::string expected = body;
  drive.stop_clock();
  const std::uint64_t resting = transport->memory().bytes_used;
  raw_socket client = reader_of(drive, *transport, "/");
  EXPECT_GT(transport->memory().bytes_used, resting);
  std::fill(body.begin(), body.end(), '!');
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  EXPECT_TRUE(body_of(client) == expected);
  EXPECT_EQ(transport->memory().bytes_used, resting);
}

TEST_F(page, is_cut_when_its_reader_does_not_read) {
  body.resize(8 << 20, 'x');
  drive.stop_clock();
  const std::uint64_t resting = transport->memory().bytes_used;
  raw_socket client = reader_of(drive, *transport, "/");
  drive.skip(9900ms);
  drive.turn();
  EXPECT_GT(transport->memory().bytes_used, resting);
  drive.skip(200ms);
  drive.turn();
  EXPECT_EQ(transport->memory().bytes_used, resting);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed);
}

// A body whose memory lasts is written in pieces, so it takes no more memory than one.
struct long_page : page {
  long_page() : page{std::size_t{96} << 10} {
    lasts = true;
    body.resize((8 << 20) + 5, 'x');
    for (std::size_t i = 0; i < body.size(); i += 4096) body[i] = static_cast<char>('a' + i / 4096 % 26);
    drive.stop_clock();
  }
};

TEST_F(long_page, reaches_its_reader_whole_through_a_small_heap) {
  const std::uint64_t resting = transport->memory().bytes_used;
  raw_socket client = get("/");
  EXPECT_TRUE(body_of(client) == body);
  EXPECT_EQ(transport->memory().bytes_used, resting);
  std::string head = request(transport->port(), "/");
  EXPECT_EQ(body_of(ask(head.replace(0, 3, "HEAD"))), "");
}

TEST_F(long_page, may_take_as_long_as_its_reader_goes_on_reading) {
  raw_socket client = reader_of(drive, *transport, "/");
  for (int i = 0; i < 20; ++i) { // 20 times 9 s, and in each more than a piece
    drive.skip(9s);
    const std::size_t had = client.text.size();
    ASSERT_TRUE(drive.until([&] { return client.ended() || client.text.size() > had + (64 << 10); })) << i;
    ASSERT_FALSE(client.failed);
  }
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  EXPECT_TRUE(body_of(client) == body);
}

TEST_F(long_page, is_cut_when_its_reader_does_not_read) {
  raw_socket client = reader_of(drive, *transport, "/");
  const std::uint64_t resting = transport->memory().bytes_used;
  for (int i = 0; i < 1000; ++i) drive.turn(); // until the socket is full
  drive.skip(9900ms);
  drive.turn();
  EXPECT_GE(transport->memory().bytes_used, resting);
  drive.skip(200ms);
  drive.turn();
  EXPECT_LT(transport->memory().bytes_used, resting);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed);
}

TEST_F(long_page, is_cut_for_another_when_there_is_no_memory_for_both) {
  std::vector<raw_socket> slow;
  for (int i = 0; i < 20; ++i) slow.push_back(reader_of(drive, *transport, "/"));
  EXPECT_GT(transport->counters().handshakes_evicted, 0U);
  EXPECT_EQ(transport->counters().handshakes_starved, 0U);
  EXPECT_TRUE(body_of(get("/")) == body);
}

TEST_F(long_page, of_a_user_may_have_scripts_of_its_own) {
  drive.sink().answer = [this](const service::http_request&) -> service::http_answer {
    service::http_answer answer = page_of(body);
    answer.kind = service::page_kind::users;
    answer.lasts = true;
    return answer;
  };
  raw_socket client = get("/");
  EXPECT_TRUE(client.has("content-security-policy: default-src 'self' 'unsafe-inline' "));
  EXPECT_TRUE(client.has("frame-ancestors 'none'"));
  EXPECT_TRUE(body_of(client) == body);
}

TEST_F(page, is_refused_in_words_to_who_may_not_have_it) {
  drive.sink().when_page_asked = [](const service::credentials& shown) -> service::admit_answer {
    if (shown.path != "/metrics" || shown.token == "right") return {};
    if (shown.token.empty()) return {.status = 401, .what = "who are you", .remedy = "say so"};
    EXPECT_TRUE(shown.address.starts_with("127.0.0.1:"));
    return {.status = 403, .what = "% may not", .remedy = "ask for it", .value = "the arm"};
  };
  raw_socket nobody = get("/metrics");
  EXPECT_EQ(nobody.text.substr(0, 12), "HTTP/1.1 401");
  EXPECT_TRUE(nobody.has("WWW-Authenticate: Bearer\r\n"));
  EXPECT_EQ(body_of(nobody), "who are you\nsay so\n");
  EXPECT_EQ(get("/metrics", "Authorization: Bearer wrong\r\n").text.substr(0, 12), "HTTP/1.1 403");
  EXPECT_EQ(get("/metrics?token=wrong").text.substr(0, 12), "HTTP/1.1 403");
  ASSERT_EQ(drive.sink().rejections.size(), 3U);
  EXPECT_EQ(drive.sink().rejections[1].what, "the arm may not");
  std::string head = request(transport->port(), "/metrics");
  EXPECT_EQ(body_of(ask(head.replace(0, 3, "HEAD"))), "");
  EXPECT_TRUE(drive.sink().pages.empty());
  EXPECT_EQ(get("/metrics", "Authorization: Bearer right\r\n").text.substr(0, 12), "HTTP/1.1 404");
  EXPECT_EQ(get("/").text.substr(0, 12), "HTTP/1.1 200");
}

// However many ask, and whether or not they read: a turn makes one page at most, and what others have sent
// is delivered in the next turn.
TEST_F(page, of_a_thousand_who_ask_delays_nobody_else_by_more_than_one_of_them) {
  body.resize(12 << 10, 'm'); // as large as /metrics may be
  raw_socket robot = upgraded(drive, *transport);
  std::deque<raw_socket> scrapers;
  std::size_t sent = 0;
  for (std::size_t turn = 0; transport->counters().accepted <= 1000; ++turn) {
    ASSERT_LT(turn, 100'000U);
    if (scrapers.size() == 20) scrapers.pop_front(); // answered or not
    // One in two has little room, and reads nothing.
    scrapers.emplace_back(transport->port(), "127.0.0.1", turn % 2 ? 0 : 1);
    ASSERT_TRUE(scrapers.back().send(request(transport->port(), "/")));
    const bool looked_at = turn % 20 == 0;
    if (looked_at) {
      ASSERT_TRUE(robot.send("x"));
      ++sent;
      while (!robot.all_arrived()) std::this_thread::yield();
    }
    const std::size_t before = drive.sink().pages.size();
    drive.turn();
    ASSERT_LE(drive.sink().pages.size(), before + 1) << "in one turn";
    ASSERT_EQ(drive.sink().received[0].size(), sent) << "what the robot said waits";
  }
  EXPECT_GT(sent, 40U);
  EXPECT_GT(drive.sink().pages.size(), 500U);
}

TEST(etag, is_matched_in_lists_weakly_and_by_a_star) {
  for (const std::string_view given : {"\"a\"", "*", "\"x,y\", \"a\"", "W/\"a\"", " ,\t\"b\" ,\"a\""})
    EXPECT_TRUE(etag_matches(given, "\"a\"")) << given;
  for (const std::string_view given : {"", "\"a", "a", "\"ab\""})
    EXPECT_FALSE(etag_matches(given, "\"a\"")) << given;
  EXPECT_TRUE(etag_matches("\"a\"", "W/\"a\""));
  EXPECT_FALSE(etag_matches("*", ""));
}

} // namespace
} // namespace page_test
} // namespace rowe::net
