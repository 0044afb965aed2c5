// SPDX-License-Identifier: Apache-2.0
#include "service/state/page_texts.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

namespace page_texts_test {
namespace {

using rowe::service::chunk_store;
using rowe::service::page_texts;
using rowe::service::text_id;

struct page_texts_test : testing::Test {
  rowe::limits bounds{
      .message_bytes_max = 1024,
      .long_message_bytes_max = 2 * chunk_store::chunk_bytes,
      .long_slots = 4 // 8 chunks: a quarter are 2
  };
  rowe::rt::arena memory{chunk_store::footprint_bytes(bounds), rowe::rt::page_lock::none};
  std::unique_ptr<std::byte[]> pool{new std::byte[chunk_store::pool_bytes(bounds)]};
  chunk_store store{memory, {pool.get(), chunk_store::pool_bytes(bounds)}, bounds};
  page_texts pages{store};
  rowe::rt::time_point now{std::chrono::seconds{100}};

  text_id text_of(std::size_t chunks) {
    const std::string content(chunks * chunk_store::chunk_bytes, 'x');
    const text_id made = store.begin(content.size());
    store.append(made, std::as_bytes(std::span{content}));
    return made;
  }
  void TearDown() override {
    EXPECT_EQ(pages.in_use(), 0U);
    EXPECT_EQ(store.texts(), 0U);
    EXPECT_TRUE(store.check());
  }
};

TEST_F(page_texts_test, of_two_texts_have_a_quarter_of_the_chunks) {
  const text_id small = text_of(1), other = text_of(1), large = text_of(2);
  EXPECT_TRUE(pages.has_room_for(large)) << "one may be as long as any";
  const std::uint32_t which = pages.begin(small, now);
  EXPECT_TRUE(pages.has_room_for(other));
  EXPECT_FALSE(pages.has_room_for(large));
  EXPECT_TRUE(pages.has_room_for(small)) << "one text is counted once";
  pages.end(which);
  EXPECT_TRUE(pages.has_room_for(large));
  for (const text_id text : {small, other, large}) store.release(text);
}

TEST_F(page_texts_test, of_slow_readers_make_way_but_for_the_first) {
  const text_id text = text_of(2);
  const std::uint32_t first = pages.begin(text, now);
  now += std::chrono::milliseconds{1};
  const std::uint32_t second = pages.begin(text, now);
  EXPECT_FALSE(pages.displace_slow(now + std::chrono::seconds{1})) << "nobody is slow yet";
  now += std::chrono::seconds{3};
  EXPECT_TRUE(pages.displace_slow(now));
  EXPECT_TRUE(pages.read(second, 0).empty());
  EXPECT_FALSE(pages.read(first, 0).empty());
  EXPECT_FALSE(pages.full()) << "though whoever sends it has not seen that";
  EXPECT_FALSE(pages.displace_slow(now));
  pages.end(first);
  pages.end(second);
  store.release(text);
}

TEST_F(page_texts_test, of_readers_that_are_not_slow_stay) {
  const text_id text = text_of(2);
  const std::uint32_t first = pages.begin(text, now), second = pages.begin(text, now);
  const auto taken = 2 * chunk_store::chunk_bytes - 1;
  EXPECT_FALSE(rowe::service::is_slow_reader(taken * 100, std::chrono::seconds{3}));
  EXPECT_TRUE(rowe::service::is_slow_reader(taken, std::chrono::seconds{3}));
  EXPECT_FALSE(rowe::service::is_slow_reader(0, std::chrono::seconds{2})) << "it has just begun";
  pages.end(first);
  pages.end(second);
  store.release(text);
}

TEST_F(page_texts_test, give_up_what_only_a_page_keeps) {
  const text_id text = text_of(2);
  const std::uint32_t which = pages.begin(text, now);
  EXPECT_FALSE(pages.give_up()) << "it would free nothing";
  store.release(text);
  EXPECT_EQ(store.free(), 6U);
  EXPECT_TRUE(pages.give_up());
  EXPECT_EQ(store.free(), 8U);
  EXPECT_TRUE(pages.read(which, 0).empty());
  EXPECT_FALSE(pages.give_up());
  EXPECT_EQ(pages.in_use(), 1U) << "until whoever sends it has seen that";
  pages.end(which);
}

} // namespace
} // namespace page_texts_test
