// SPDX-License-Identifier: Apache-2.0
#include "support.hpp"

#include "net/http_page.hpp"

namespace rowe::net {
namespace page_test {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

// A server with one page: "/" is "<html>rowe</html>" with an ETag.
struct page : testing::Test {
  std::unique_ptr<socket_transport> transport = listening({.limits = {.handshake_bytes = 16 << 20}});
  driver drive{*transport};
  std::string body = "<html>rowe</html>";

  page() {
    drive.sink().answer = [this](const service::http_request& asked) -> service::http_answer {
      if (asked.path != "/") return {};
      return {.status = 200,
              .content_type = "text/html; charset=utf-8",
              .content_encoding = asked.accepts_gzip ? "gzip" : "",
              .etag = "\"v1\"",
              .cache_control = "no-cache",
              .body = bytes_of(body)};
    };
  }

  raw_socket ask(std::string_view text) {
    raw_socket client{transport->port()};
    EXPECT_TRUE(client.send(text));
    EXPECT_TRUE(drive.until([&] { return client.ended(); }));
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
        "cache-control: no-cache\r\n", "x-content-type-options: nosniff\r\n", "connection: close\r\n",
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
  raw_socket client{transport->port(), "127.0.0.1", 4096};
  ASSERT_TRUE(client.send(request(transport->port(), "/")));
  ASSERT_TRUE(drive.until([&] { return !drive.sink().pages.empty(); }));
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
  raw_socket client{transport->port(), "127.0.0.1", 4096};
  ASSERT_TRUE(client.send(request(transport->port(), "/")));
  ASSERT_TRUE(drive.until([&] { return !drive.sink().pages.empty(); }));
  drive.skip(9900ms);
  drive.turn();
  EXPECT_GT(transport->memory().bytes_used, resting);
  drive.skip(200ms);
  drive.turn();
  EXPECT_EQ(transport->memory().bytes_used, resting);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed);
}

TEST_F(page, is_given_up_when_its_reader_vanishes) {
  body.resize(8 << 20, 'x');
  drive.stop_clock();
  const std::uint64_t resting = transport->memory().bytes_used;
  raw_socket client{transport->port(), "127.0.0.1", 4096};
  ASSERT_TRUE(client.send(request(transport->port(), "/")));
  ASSERT_TRUE(drive.until([&] { return !drive.sink().pages.empty(); }));
  client.reset();
  EXPECT_TRUE(drive.until([&] { return transport->memory().bytes_used == resting; }));
}

TEST(etag, is_matched_in_lists_weakly_and_by_a_star) {
  EXPECT_TRUE(etag_matches("\"a\"", "\"a\""));
  EXPECT_TRUE(etag_matches("*", "\"a\""));
  EXPECT_TRUE(etag_matches("\"x,y\", \"a\"", "\"a\""));
  EXPECT_TRUE(etag_matches("W/\"a\"", "\"a\""));
  EXPECT_TRUE(etag_matches("\"a\"", "W/\"a\""));
  EXPECT_TRUE(etag_matches(" ,\t\"b\" ,\"a\"", "\"a\""));
  EXPECT_FALSE(etag_matches("", "\"a\""));
  EXPECT_FALSE(etag_matches("\"a", "\"a\""));
  EXPECT_FALSE(etag_matches("a", "\"a\""));
  EXPECT_FALSE(etag_matches("\"ab\"", "\"a\""));
  EXPECT_FALSE(etag_matches("*", ""));
}

} // namespace
} // namespace page_test
} // namespace rowe::net
