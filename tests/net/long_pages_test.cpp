// SPDX-License-Identifier: Apache-2.0
// Pages whose body is long, on sockets: all of it arrives, it delays nobody else, and who does not read it
// keeps it no longer than some seconds.
#include "tls_support.hpp"

#include <deque>
#include <set>
#include <thread>

namespace rowe::net {
namespace long_pages_test {
namespace {

// Every page is long, and is read in pieces of 16 KiB, the first and the last of which are shorter.
struct bodies final : service::body_source {
  std::string text;
  std::multiset<std::uint32_t> open;
  bool cut = false;
  std::size_t reads = 0;

  bodies() {
    text.resize(10'000'000);
    std::uint32_t state = 1;
    for (char& c : text) c = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
  }
  std::span<const std::byte> read_body(std::uint32_t which, std::size_t at) noexcept override {
    EXPECT_EQ(open.count(which), 1U);
    ++reads;
    if (cut) return {};
    const std::size_t ends = (at + 100) / 16384 * 16384 + 16384 - 100;
    const auto piece = std::string_view{text}.substr(at, ends - at);
    return std::as_bytes(std::span{piece});
  }
  void end_body(std::uint32_t which) noexcept override {
    EXPECT_EQ(open.count(which), 1U) << "it ends once";
    open.erase(which);
  }
  service::http_answer begin() {
    const std::uint32_t which = next_++;
    open.insert(which);
    service::http_answer answer;
    answer.status = 200;
    answer.content_type = "application/json";
    answer.cache_control = "no-store";
    answer.age_ms = 7;
    answer.in_pieces = {.from = this, .which = which, .bytes = text.size()};
    return answer;
  }

 private:
  std::uint32_t next_ = 0;
};

struct long_pages : testing::Test {
  bodies source;
  std::unique_ptr<socket_transport> transport;
  driver drive{*transport};

  explicit long_pages(const listen_options& options = {}) : transport{listening(options)} {
    drive.sink().answer = [this](const service::http_request& asked) -> service::http_answer {
      if (asked.path == "/short") return page_of("short\n");
      if (asked.path == "/busy") {
        service::http_answer busy = page_of("busy\n");
        busy.status = 503;
        busy.retry_after_s = 1;
        return busy;
      }
      return source.begin();
    };
  }
  raw_socket ask(std::string_view path = "/", int receive_buffer = 0) {
    return reader_of(drive, *transport, path, receive_buffer);
  }
  void turns(int count) {
    for (int i = 0; i < count; ++i) drive.turn();
  }
  std::uint64_t cut() const { return transport->counters().pages_cut; }
};

bool is_whole(const std::string& answer, const std::string& body) {
  const std::size_t head = answer.find("\r\n\r\n") + 4;
  return answer.size() == head + body.size() && answer.compare(head, body.size(), body) == 0;
}

TEST_F(long_pages, arrive_whole_behind_the_headers_of_any_page) {
  raw_socket client = ask();
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  EXPECT_TRUE(client.text.starts_with("HTTP/1.1 200 OK\r\n"));
  for (const std::string_view line :
       {"content-type: application/json\r\n", "content-length: 10000000\r\n", "cache-control: no-store\r\n",
        "rowe-age-ms: 7\r\n", "content-security-policy: default-src 'none'; script-src 'self'",
        "cross-origin-resource-policy: same-origin\r\n", "x-content-type-options: nosniff\r\n",
        "referrer-policy: no-referrer\r\n", "connection: close\r\n\r\n"})
    EXPECT_NE(client.text.find(line), std::string::npos) << line;
  EXPECT_TRUE(is_whole(client.text, source.text));
  EXPECT_TRUE(source.open.empty());
  EXPECT_EQ(cut(), 0U);
}

TEST_F(long_pages, take_no_memory_of_libwebsockets) {
  const std::uint64_t resting = transport->memory().bytes_used;
  raw_socket client = ask("/", 4096);
  turns(100);
  EXPECT_EQ(source.open.size(), 1U);
  EXPECT_EQ(transport->memory().bytes_used, resting);
}

TEST_F(long_pages, are_read_a_piece_in_a_turn) {
  raw_socket client = ask();
  while (!client.ended()) {
    source.reads = 0;
    drive.turn();
    EXPECT_LE(source.reads, 3U) << "of 16 KiB, with which a step need not begin";
  }
  EXPECT_TRUE(is_whole(client.text, source.text));
}

TEST_F(long_pages, have_no_body_for_who_asks_by_head) {
  raw_socket client =
      answered_whole(drive, *transport, request(transport->port(), "/").replace(0, 3, "HEAD"));
  EXPECT_TRUE(client.has("content-length: 10000000\r\n"));
  EXPECT_TRUE(client.text.ends_with("\r\n\r\n"));
  EXPECT_TRUE(source.open.empty());
}

TEST_F(long_pages, say_when_to_ask_again) {
  raw_socket client = answered_whole(drive, *transport, request(transport->port(), "/busy"));
  EXPECT_TRUE(client.has("HTTP/1.1 503"));
  EXPECT_TRUE(client.has("retry-after: 1\r\n"));
  EXPECT_TRUE(client.text.ends_with("\r\n\r\nbusy\n"));
}

TEST_F(long_pages, are_cut_when_their_reader_takes_nothing_for_some_seconds) {
  drive.stop_clock();
  raw_socket client = ask("/", 4096);
  turns(200);
  drive.skip(4900ms);
  turns(3);
  EXPECT_EQ(cut(), 0U);
  drive.skip(200ms);
  turns(3); // the socket's buffer has taken much, but its reader not
  drive.skip(5s);
  turns(3);
  EXPECT_EQ(cut(), 1U);
  EXPECT_TRUE(source.open.empty());
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed) << "it sees that the body is not whole";
}

TEST_F(long_pages, are_sent_to_the_end_to_who_reads_slowly) {
  drive.stop_clock();
  source.text.resize(2'000'000);
  raw_socket client = ask("/", 4096);
  std::string got;
  char bytes[4096];
  for (int i = 0; i < 5000 && !is_whole(got, source.text); ++i) {
    turns(2);
    for (int part = 0; part < 16; ++part) { // some 64 KB in half a second
      const ssize_t here = ::recv(client.fd(), bytes, sizeof bytes, MSG_DONTWAIT);
      if (here > 0) got.append(bytes, static_cast<std::size_t>(here));
      turns(1);
    }
    drive.skip(500ms);
  }
  EXPECT_TRUE(is_whole(got, source.text)) << got.size();
  EXPECT_EQ(cut(), 0U);
}

TEST_F(long_pages, end_with_their_reader) {
  raw_socket first = ask();
  raw_socket second = ask();
  turns(3);
  first.reset();
  second.close();
  ASSERT_TRUE(drive.until([&] { return source.open.empty(); }));
  EXPECT_EQ(cut(), 0U);
}

TEST_F(long_pages, go_to_who_has_shut_its_own_end) {
  raw_socket client = ask();
  client.shut();
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(is_whole(client.text, source.text));
}

TEST_F(long_pages, are_cut_where_their_source_ends) {
  raw_socket client = ask("/", 4096);
  turns(3);
  source.cut = true;
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed);
  EXPECT_EQ(cut(), 1U);
  EXPECT_TRUE(source.open.empty());
}

TEST_F(long_pages, do_not_touch_their_source_when_the_transport_goes) {
  raw_socket client = ask("/", 4096);
  turns(3);
  ASSERT_EQ(source.open.size(), 1U);
  transport.reset();
  EXPECT_EQ(source.open.size(), 1U);
}

TEST_F(long_pages, delay_nobody_else) {
  raw_socket robot = upgraded(drive, *transport);
  raw_socket one = ask();
  raw_socket other = ask();
  for (std::size_t i = 0; i < 60; ++i) {
    ASSERT_TRUE(robot.send("x"));
    while (!robot.all_arrived()) std::this_thread::yield();
    source.reads = 0;
    drive.turn();
    one.read();
    other.read();
    ASSERT_EQ(drive.sink().received[0].size(), i + 1) << "what the robot said waits";
    ASSERT_LE(source.reads, 3U) << "one of them in a turn";
  }
  ASSERT_TRUE(drive.until([&] {
    const bool ended = one.ended();
    return other.ended() && ended;
  }));
  EXPECT_TRUE(is_whole(one.text, source.text) && is_whole(other.text, source.text));
}

TEST_F(long_pages, keep_their_places_to_themselves) {
  std::deque<raw_socket> deaf;
  for (int i = 0; i < 30; ++i) deaf.push_back(ask("/", 4096));
  raw_socket beyond = answered_whole(drive, *transport, request(transport->port(), "/short"));
  EXPECT_TRUE(beyond.has("30 pages are under way, which is the limit"));
  raw_socket robot = upgraded(drive, *transport);
  EXPECT_EQ(drive.sink().opens.size(), 1U);
  drive.skip(3s);
  turns(3);
  drive.skip(3s);
  ASSERT_TRUE(drive.until([&] { return source.open.empty(); }));
  raw_socket next = answered_whole(drive, *transport, request(transport->port(), "/short"));
  EXPECT_TRUE(next.has("200 OK"));
}

struct tls_long_pages : served_tls {
  tls_long_pages() {
    drive.sink().answer = [this](const service::http_request&) { return source.begin(); };
  }
  ~tls_long_pages() override { transport.reset(); } // it reads from the source until then
  bodies source;
};

TEST_F(tls_long_pages, arrive_whole) {
  tls_socket client{transport->port()};
  ASSERT_TRUE(asks(drive, client, request(transport->port(), "/")));
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.ended_well);
  EXPECT_TRUE(is_whole(client.text, source.text)) << client.text.size();
  EXPECT_TRUE(source.open.empty());
}

TEST_F(tls_long_pages, are_cut_when_their_reader_takes_nothing_and_end_with_it) {
  for (const bool leaves : {false, true}) {
    tls_socket client{transport->port(), {}, 4096};
    ASSERT_TRUE(asks(drive, client, request(transport->port(), "/")));
    ASSERT_TRUE(drive.until([&] { return !source.open.empty(); }));
    if (leaves) client.raw.reset();
    ASSERT_TRUE(drive.until([&] { return source.open.empty(); }));
    EXPECT_EQ(transport->counters().pages_cut, 1U);
  }
}

} // namespace
} // namespace long_pages_test
} // namespace rowe::net
