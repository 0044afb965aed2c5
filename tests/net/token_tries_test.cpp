// SPDX-License-Identifier: Apache-2.0
#include "net/handshakes/token_tries.hpp"

#include "support.hpp"

#include <list>

namespace rowe::net {
namespace token_tries_test {
namespace {

constexpr rt::time_point start{1000s};

socket_address at(const std::string& address, std::uint16_t port = 1) {
  return numeric_address(address, port).value();
}

// How many of `count` wrong tokens are answered late.
int slow(token_tries& of, const socket_address& from, rt::time_point now, int count) {
  int late = 0;
  for (int i = 0; i < count; ++i) late += of.note_wrong(from, now) ? 1 : 0;
  return late;
}

TEST(token_tries, are_slow_behind_five_of_one_source) {
  token_tries of;
  EXPECT_EQ(slow(of, at("10.0.0.7", 1), start, 5), 0);
  EXPECT_EQ(slow(of, at("10.0.0.7", 2), start, 5), 5); // whatever the port
  EXPECT_EQ(slow(of, at("10.0.0.8"), start, 5), 0);
  EXPECT_EQ(slow(of, at("2001:db8:0:1::1"), start, 5), 0);
  EXPECT_EQ(slow(of, at("2001:db8:0:1:ffff::2"), start, 1), 1); // the same /64
  EXPECT_EQ(slow(of, at("2001:db8:0:2::1"), start, 1), 0);
}

TEST(token_tries, are_forgiven_one_each_ten_seconds_after_the_last_one) {
  token_tries of;
  EXPECT_EQ(slow(of, at("10.0.0.7"), start, 1000), 995);
  EXPECT_EQ(slow(of, at("10.0.0.7"), start + 9s, 1), 1);
  EXPECT_EQ(slow(of, at("10.0.0.7"), start + 19s, 2), 1);
  EXPECT_EQ(slow(of, at("10.0.0.7"), start + 60s, 6), 2);
  EXPECT_EQ(slow(of, at("10.0.0.7"), start + 1h, 6), 1);
}

TEST(token_tries, are_remembered_however_many_others_try) {
  token_tries of;
  EXPECT_EQ(slow(of, at("10.0.0.7"), start, 5), 0);
  for (int i = 0; i < 200; ++i) slow(of, at("10.0.1." + std::to_string(i)), start + 1ms, 5);
  EXPECT_EQ(slow(of, at("10.0.0.7"), start + 1s, 1), 1);
}

TEST(source_tally, takes_hardly_anybody_for_another) {
  source_tally of{2s, 64};
  for (int times = 0; times < 20; ++times)
    for (int i = 0; i < 200; ++i) (void)of.note(at("10.0.1." + std::to_string(i)), start + 1ms * times);
  int mistaken = 0;
  for (int i = 0; i < 1000; ++i)
    if (of.note(at("10." + std::to_string(1 + i / 250) + ".2." + std::to_string(i % 250)), start + 1s) != 0)
      ++mistaken;
  EXPECT_LE(mistaken, 60); // the last of the thousand stand beside 1200 others
}

TEST(source_tally, forgives_what_does_not_count_after_all) {
  source_tally of{2s, 64};
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(of.note(at("10.0.0.7"), start + 1ms * i), 0U);
    of.forgive(at("10.0.0.7"), start + 1ms * i);
  }
  EXPECT_EQ(of.note(at("10.0.0.7"), start + 5ms), 0U);
  EXPECT_EQ(of.note(at("10.0.0.7"), start + 5ms), 1U);
  EXPECT_EQ(of.note(at("10.0.0.7"), start + 4s + 6ms), 0U);
}

// A peer that shows a token, and how far the answer has come.
struct try_of_token {
  explicit try_of_token(const socket_transport& to, std::string_view token, std::string_view path = "/")
      : socket{to.port()} {
    EXPECT_TRUE(socket.send(
        upgrade_request(to.port(), "Authorization: Bearer " + std::string{token} + "\r\n", path)));
  }
  std::string status() {
    socket.read();
    return socket.text.substr(0, std::min<std::size_t>(socket.text.size(), 12));
  }
  raw_socket socket;
};

struct tries : served {
  tries() {
    drive.sink().when_asked = [](const service::credentials& shown) -> service::admit_answer {
      if (shown.token == "right") return {};
      return {.status = 401, .what = "this token is not known here", .remedy = "ask for one"};
    };
    for (std::uint32_t i = 0; i < token_tries::wrong_max; ++i) {
      try_of_token one{*transport, "wrong"};
      EXPECT_TRUE(drive.until([&] { return one.status() == "HTTP/1.1 401"; })) << i;
    }
    drive.stop_clock();
  }
  bool told(std::size_t rejections) {
    return drive.until([&] { return drive.sink().rejections.size() == rejections; });
  }
};

TEST_F(tries, are_answered_a_second_late_by_429) {
  try_of_token sixth{*transport, "wrong"};
  ASSERT_TRUE(told(6));
  EXPECT_EQ(drive.sink().rejections[5].status, 429);
  drive.skip(999ms);
  for (int i = 0; i < 10; ++i) drive.turn();
  EXPECT_EQ(sixth.status(), "");
  drive.skip(1ms);
  ASSERT_TRUE(drive.until([&] { return sixth.socket.ended(); }));
  EXPECT_EQ(sixth.status(), "HTTP/1.1 429");
  EXPECT_TRUE(sixth.socket.has("Retry-After: 1\r\n")) << sixth.socket.text;
  EXPECT_FALSE(sixth.socket.failed);
  EXPECT_EQ(transport->counters().handshakes_slowed, 1U);
}

TEST_F(tries, of_others_of_the_same_address_with_a_right_token_are_not_slow) {
  std::list<try_of_token> wrong;
  for (int i = 0; i < 40; ++i) wrong.emplace_back(*transport, "wrong");
  try_of_token right{*transport, "right"};
  ASSERT_TRUE(drive.until([&] { return right.status() == "HTTP/1.1 101"; }));
  try_of_token button{*transport, "right", service::stop_path};
  ASSERT_TRUE(drive.until([&] { return button.status() == "HTTP/1.1 101"; }));
}

TEST_F(tries, wait_for_their_answers_only_so_many_at_a_time) {
  std::list<try_of_token> wrong;
  for (std::size_t i = 0; i < token_tries::waiting_max + 3; ++i) {
    wrong.emplace_back(*transport, "wrong");
    ASSERT_TRUE(told(6 + i));
  }
  int answered = 0;
  for (try_of_token& one : wrong) answered += one.status() == "HTTP/1.1 429" ? 1 : 0;
  EXPECT_EQ(answered, 3); // the oldest
  wrong.clear();          // they do not wait for their answers
  drive.skip(1s);
  for (int i = 0; i < 10; ++i) drive.turn();
  EXPECT_EQ(transport->counters().handshakes_slowed, token_tries::waiting_max + 3);
}

} // namespace
} // namespace token_tries_test
} // namespace rowe::net
