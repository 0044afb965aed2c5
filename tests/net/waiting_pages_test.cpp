// SPDX-License-Identifier: Apache-2.0
// Pages that wait for what they show: they are answered when it comes or when their time is over, and delay
// nobody else.
#include "support.hpp"

#include <deque>
#include <set>
#include <thread>

namespace rowe::net {
namespace waiting_pages_test {
namespace {

// Every page waits until its topic, which is its path's last digit, has a value.
struct waiting_pages : testing::Test {
  std::unique_ptr<socket_transport> transport = listening({.limits = {.handshake_bytes = 16 << 20}});
  driver drive{*transport};
  std::set<std::uint32_t> values;
  std::string body = "{}\n";
  std::size_t asked_again = 0;
  std::size_t answered = 0;

  waiting_pages() {
    drive.stop_clock();
    drive.sink().answer = [this](const service::http_request& asked) -> service::http_answer {
      if (asked.path == "/now") return page_of(body);
      service::http_answer later;
      later.later = true;
      if (asked.awaited == nullptr) {
        later.awaited = {.topic = static_cast<std::uint32_t>(asked.path.back() - '0'), .who = asked.who};
        return later;
      }
      ++asked_again;
      EXPECT_EQ(asked.awaited->who.role, 3);
      if (values.count(asked.awaited->topic) == 0) return asked.last ? service::http_answer{} : later;
      ++answered;
      service::http_answer answer = page_of(body);
      answer.age_ms = 7;
      return answer;
    };
    drive.sink().when_page_asked = [](const service::credentials&) -> service::admit_answer {
      return {.who = {.role = 3}};
    };
  }
  raw_socket ask(std::string_view path, std::string_view method = "GET") {
    raw_socket client{transport->port()};
    const std::size_t before = drive.sink().pages.size();
    EXPECT_TRUE(client.send(request(transport->port(), path).replace(0, 3, method)));
    EXPECT_TRUE(drive.until([&] { return drive.sink().pages.size() > before; }));
    EXPECT_TRUE(client.read());
    EXPECT_EQ(client.text, "");
    return client;
  }
  void give(std::uint32_t topic) {
    values.insert(topic);
    ++drive.sink().came;
  }
};

TEST_F(waiting_pages, are_answered_when_what_they_wait_for_has_come) {
  raw_socket client = ask("/1");
  raw_socket other = ask("/2");
  for (int i = 0; i < 20; ++i) drive.turn();
  EXPECT_LE(asked_again, 2U) << "nothing has come";
  give(1);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  EXPECT_TRUE(client.has("HTTP/1.1 200"));
  EXPECT_TRUE(client.has("rowe-age-ms: 7\r\n"));
  EXPECT_TRUE(client.text.ends_with("\r\n\r\n{}\n"));
  EXPECT_TRUE(other.read());
  EXPECT_EQ(other.text, "");
}

TEST_F(waiting_pages, are_answered_without_a_body_where_they_were_asked_for_by_head) {
  raw_socket client = ask("/1", "HEAD");
  give(1);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.has("content-length: 3\r\n"));
  EXPECT_TRUE(client.text.ends_with("\r\n\r\n"));
}

TEST_F(waiting_pages, are_answered_when_their_time_is_over) {
  raw_socket client = ask("/1");
  drive.skip(1990ms);
  for (int i = 0; i < 5; ++i) drive.turn();
  EXPECT_TRUE(client.read());
  drive.skip(20ms);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.has("HTTP/1.1 404"));
}

TEST_F(waiting_pages, are_answered_to_who_has_shut_its_own_end) {
  raw_socket client = ask("/1");
  client.shut();
  for (int i = 0; i < 20; ++i) drive.turn();
  give(1);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.has("HTTP/1.1 200"));
}

TEST_F(waiting_pages, are_given_up_when_who_asked_is_gone) {
  ask("/1").reset();
  for (int i = 0; i < 20; ++i) drive.turn();
  give(1);
  for (int i = 0; i < 20; ++i) drive.turn();
  EXPECT_EQ(answered, 0U);
}

TEST_F(waiting_pages, of_who_has_left_without_a_word_are_no_fault_of_ours) {
  { const raw_socket left = ask("/1"); }
  for (int i = 0; i < 20; ++i) drive.turn();
  give(1);
  ASSERT_TRUE(drive.until([&] { return answered == 1; }));
  for (int i = 0; i < 20; ++i) drive.turn();
  EXPECT_TRUE(drive.sink().rejections.empty());
}

TEST_F(waiting_pages, take_no_memory_of_libwebsockets_and_half_of_the_places) {
  const std::uint64_t resting = transport->memory().bytes_used;
  std::deque<raw_socket> all;
  for (int i = 0; i < 15; ++i) all.push_back(ask("/1"));
  EXPECT_EQ(transport->memory().bytes_used, resting);
  raw_socket beyond = answered_whole(drive, *transport, request(transport->port(), "/1"));
  EXPECT_TRUE(beyond.has("15 pages wait for a value, which is the limit"));
  raw_socket other =
      answered_whole(drive, *transport, request(transport->port(), "/now")); // of what is there
  EXPECT_TRUE(other.has("200 OK"));
  give(1);
  EXPECT_TRUE(drive.until(
      [&] { return std::all_of(all.begin(), all.end(), [](auto& one) { return one.ended(); }); }));
  EXPECT_EQ(answered, 15U);
  raw_socket next = ask("/2");
  drive.skip(3s);
  EXPECT_TRUE(drive.until([&] { return next.ended(); }));
}

// Whatever comes at once for however many: one page is answered a turn, and what a connection has sent is
// delivered in the next one. Newcomers who ask all the time keep none of them waiting.
TEST_F(waiting_pages, delay_nobody_by_more_than_one_of_them) {
  body.resize(12 << 10, 'm');
  raw_socket robot = upgraded(drive, *transport);
  std::deque<raw_socket> waiting;
  for (int i = 0; i < 12; ++i) waiting.push_back(ask("/1"));
  give(1);
  std::deque<raw_socket> newcomers;
  std::size_t turns = 0;
  for (; answered < 12; ++turns) {
    ASSERT_LT(turns, 100U);
    if (newcomers.size() == 4) newcomers.pop_front();
    newcomers.emplace_back(transport->port());
    ASSERT_TRUE(newcomers.back().send(request(transport->port(), "/9")));
    ASSERT_TRUE(robot.send("x"));
    while (!robot.all_arrived()) std::this_thread::yield();
    const std::size_t before = answered + drive.sink().pages.size() - asked_again;
    const std::size_t answered_before = answered;
    drive.turn();
    ASSERT_LE(answered, answered_before + 1) << "in one turn";
    ASSERT_LE(answered + drive.sink().pages.size() - asked_again, before + 1) << "in one turn";
    ASSERT_EQ(drive.sink().received[0].size(), turns + 1) << "what the robot said waits";
  }
  EXPECT_LE(turns, 60U);
}

} // namespace
} // namespace waiting_pages_test
} // namespace rowe::net
