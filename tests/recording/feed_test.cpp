// SPDX-License-Identifier: Apache-2.0
#include "recording/feed.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace {

using rowe::recording::feed;
using rowe::recording::record_head;
using rowe::recording::record_kind;

struct record {
  record_head head;
  std::string content;
};

// All that is there, taken at once.
std::vector<record> take_all(feed& from, std::string& rest) {
  while (from.take(rest) != 0) {
  }
  std::vector<record> all;
  std::string_view bytes = rest;
  record_head head;
  std::string_view content;
  while (feed::next(bytes, head, content)) all.push_back({head, std::string{content}});
  rest.erase(0, rest.size() - bytes.size());
  return all;
}

bool put(feed& into, std::string_view text, std::uint32_t topic = 0, std::int64_t logged_ns = 0) {
  return into.put({.kind = record_kind::message, .topic = topic, .logged_ns = logged_ns}, std::array{text});
}

TEST(feed, gives_records_of_each_length_as_they_were_put) {
  const auto tried = std::make_unique<feed>(std::size_t{1} << 20, 512);
  ASSERT_TRUE(*tried);
  std::string rest;
  for (std::size_t bytes = 0; bytes < 400; ++bytes) {
    const std::string text(bytes, static_cast<char>('a' + bytes % 26));
    ASSERT_TRUE(tried->put(
        {.kind = record_kind::message,
         .topic = static_cast<std::uint32_t>(bytes),
         .logged_ns = 5,
         .published_ns = 6},
        std::array{std::string_view{text}.substr(0, bytes / 3), std::string_view{text}.substr(bytes / 3)}));
    const auto all = take_all(*tried, rest);
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].content, text);
    EXPECT_EQ(all[0].head.topic, bytes);
    EXPECT_EQ(all[0].head.logged_ns, 5);
    EXPECT_EQ(all[0].head.published_ns, 6);
  }
  EXPECT_TRUE(rest.empty());
}

TEST(feed, counts_what_has_no_room_and_says_so_in_its_place) {
  const auto tried = std::make_unique<feed>(64 * std::size_t{64}, 8);
  ASSERT_TRUE(*tried);
  std::string rest;
  for (const std::uint32_t topic : {3U, 4U})
    ASSERT_TRUE(tried->put({.kind = record_kind::topic, .topic = topic}, {}));
  std::size_t put_in = 0;
  while (put(*tried, "x", 3)) ++put_in;
  EXPECT_EQ(put_in, 62U);
  EXPECT_FALSE(put(*tried, "x", 3));
  EXPECT_FALSE(put(*tried, "x", 4));
  EXPECT_EQ(tried->lost(), 3U);
  EXPECT_FALSE(tried->put_lost(9)); // there is no room for that either
  EXPECT_EQ(take_all(*tried, rest).size(), 64U);

  EXPECT_TRUE(put(*tried, "again", 3, 7));
  EXPECT_TRUE(tried->put_lost(9));
  const auto all = take_all(*tried, rest);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].head.kind, record_kind::lost);
  EXPECT_EQ(all[0].head.topic, 3U);
  EXPECT_EQ(all[0].head.count, 2U);
  EXPECT_EQ(all[0].head.logged_ns, 7);
  EXPECT_EQ(all[1].content, "again");
  EXPECT_EQ(all[2].head.kind, record_kind::lost);
  EXPECT_EQ(all[2].head.topic, 4U);
  EXPECT_EQ(all[2].head.count, 1U);
  EXPECT_EQ(tried->lost(), 3U);
}

// Who reads the feed knows a topic only from when it was told what it is called.
TEST(feed, says_a_loss_under_the_topics_name_and_not_before_it) {
  const auto tried = std::make_unique<feed>(64 * std::size_t{64}, 8);
  ASSERT_TRUE(*tried);
  std::string rest;
  tried->count_lost(5, 3);
  EXPECT_TRUE(tried->put_lost(1));
  EXPECT_TRUE(take_all(*tried, rest).empty());
  ASSERT_TRUE(tried->put({.kind = record_kind::topic, .topic = 5}, {}));
  ASSERT_TRUE(put(*tried, "x", 5, 2));
  const auto all = take_all(*tried, rest);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].head.kind, record_kind::topic);
  EXPECT_EQ(all[1].head.kind, record_kind::lost);
  EXPECT_EQ(all[1].head.count, 3U);
  EXPECT_EQ(all[1].head.logged_ns, 2);
  EXPECT_EQ(all[2].content, "x");
}

TEST(feed, refuses_what_would_never_fit) {
  const auto tried = std::make_unique<feed>(64 * std::size_t{64}, 8);
  EXPECT_TRUE(tried->fits(64 * 62));
  EXPECT_FALSE(tried->fits(64 * 64));
}

// While the parts of long messages come, others come between them. What was begun has room.
TEST(feed, gives_messages_in_parts_whatever_comes_between) {
  const auto tried = std::make_unique<feed>(std::size_t{64} * 1024, 8);
  ASSERT_TRUE(*tried);
  const std::string text(20'000, 'y');
  ASSERT_TRUE(tried->begin_long({.place = 2, .topic = 1, .logged_ns = 5}, text.size(), 1000));
  EXPECT_FALSE(tried->begin_long({.place = 1, .topic = 1}, 64'000, 1000));
  EXPECT_EQ(tried->lost(), 1U);
  while (put(*tried, "between")) {
  }
  for (std::size_t at = 0; at < text.size(); at += 1000)
    tried->put_part(2, std::string_view{text}.substr(at, 1000));
  std::string rest;
  std::string whole;
  for (const record& one : take_all(*tried, rest))
    if (one.head.kind == record_kind::long_part) whole += one.content;
  EXPECT_EQ(whole, text);
  std::size_t all = 0; // what was reserved is free again
  while (put(*tried, "x", 2)) ++all;
  EXPECT_EQ(all, 1024U);
}

// One thread puts in as fast as it can, another takes out: what comes is whole and in order, and what does
// not come was said to be lost, at its place.
TEST(feed, loses_nothing_in_silence_between_two_threads) {
  constexpr std::uint32_t messages = 200'000;
  const auto tried = std::make_unique<feed>(std::size_t{64} * 1024, 8);
  ASSERT_TRUE(*tried);
  std::atomic<bool> ended{false};
  ASSERT_TRUE(tried->put({.kind = record_kind::topic}, {}));
  std::thread puts{[&] {
    std::string text;
    for (std::uint32_t i = 0; i < messages; ++i) {
      text.assign(i % 200, static_cast<char>('a' + i % 26));
      (void)put(*tried, text, 0, i);
      if (i % 512 == 0) std::this_thread::yield();
    }
    while (!tried->put_lost(messages)) std::this_thread::yield();
    ended = true;
  }};
  std::uint32_t next = 0;
  std::uint64_t lost = 0;
  std::string rest;
  for (bool over = false; !over;) {
    over = ended;
    for (const record& one : take_all(*tried, rest)) {
      if (one.head.kind == record_kind::topic) continue;
      if (one.head.kind == record_kind::lost) {
        next += one.head.count;
        lost += one.head.count;
        continue;
      }
      ASSERT_EQ(one.head.logged_ns, next);
      ASSERT_EQ(one.content, std::string(next % 200, static_cast<char>('a' + next % 26)));
      ++next;
    }
  }
  puts.join();
  EXPECT_EQ(next, messages);
  EXPECT_EQ(lost, tried->lost());
}

TEST(feed, has_one_snapshot_on_its_way_however_often_it_is_asked) {
  const auto tried = std::make_unique<feed>(std::size_t{1} << 20, 4);
  std::string rest;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(tried->ask_for_snapshot("why", 7));
  auto all = take_all(*tried, rest);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].head.kind, record_kind::snapshot);
  EXPECT_EQ(all[0].content, "why");
  EXPECT_EQ(all[0].head.logged_ns, 7);
  EXPECT_TRUE(tried->ask_for_snapshot("more", 8));
  EXPECT_TRUE(take_all(*tried, rest).empty());
  tried->note_snapshot();
  EXPECT_TRUE(tried->ask_for_snapshot("more", 9));
  EXPECT_EQ(take_all(*tried, rest).size(), 1U);
}

TEST(feed, says_what_was_lost_of_a_topic_by_none_that_is_asked) {
  const auto tried = std::make_unique<feed>(std::size_t{1} << 20, 4);
  std::string rest;
  ASSERT_TRUE(tried->put({.kind = record_kind::topic, .topic = 0}, std::array{std::string_view{"name"}}));
  tried->count_lost(0, 3);
  ASSERT_TRUE(tried->ask_for_snapshot("why", 7));
  for (const record& one : take_all(*tried, rest)) EXPECT_NE(one.head.kind, record_kind::lost);
}

} // namespace
