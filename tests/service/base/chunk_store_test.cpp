// SPDX-License-Identifier: Apache-2.0
#include "service/base/chunk_store.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <string_view>

namespace chunk_store_test {
namespace {

using rowe::service::chunk_store;
using rowe::service::text_id;

constexpr std::size_t chunk = chunk_store::chunk_bytes;

rowe::limits few() {
  return {.message_bytes_max = 1024, .long_message_bytes_max = 2 * chunk, .long_slots = 4};
}

struct chunk_store_test : testing::Test {
  rowe::limits bounds = few();
  rowe::rt::arena memory{chunk_store::footprint_bytes(bounds), rowe::rt::page_lock::none};
  std::unique_ptr<std::byte[]> pool{new std::byte[chunk_store::pool_bytes(bounds)]};
  chunk_store store{memory, {pool.get(), chunk_store::pool_bytes(bounds)}, bounds};

  text_id text_of(std::string_view content, std::size_t step = 1000) {
    const text_id made = store.begin(content.size());
    if (!made) return made;
    for (std::size_t at = 0; at < content.size(); at += step)
      store.append(made, std::as_bytes(std::span{content.substr(at, step)}));
    return made;
  }
  std::string all_of(text_id text, std::size_t step = 777) {
    std::string read;
    chunk_store::place place;
    while (read.size() < store.bytes(text)) {
      std::string piece(std::min(step, store.bytes(text) - read.size()), '\0');
      store.copy(text, read.size(), place, std::as_writable_bytes(std::span{piece}));
      read += piece;
    }
    return read;
  }
  void TearDown() override { EXPECT_TRUE(store.check()); }
};

std::string random_text(std::size_t bytes, unsigned seed) {
  std::mt19937 random{seed};
  std::string made(bytes, '\0');
  for (char& c : made) c = static_cast<char>('a' + random() % 26);
  return made;
}

TEST_F(chunk_store_test, keeps_a_text_as_it_was_added) {
  for (const std::size_t bytes : {std::size_t{1}, chunk - 1, chunk, chunk + 1, 2 * chunk}) {
    const std::string content = random_text(bytes, static_cast<unsigned>(bytes));
    const text_id text = text_of(content);
    EXPECT_EQ(all_of(text), content);
    store.release(text);
  }
  EXPECT_EQ(store.free(), 8U);
}

TEST_F(chunk_store_test, cuts_a_text_and_gives_back_the_chunks_that_it_needs_no_more) {
  const std::string content = random_text(4 * chunk, 1);
  for (const auto& [at, bytes] : {std::pair{std::size_t{0}, std::size_t{1}},
                                  {chunk - 1, 2},
                                  {chunk, chunk},
                                  {chunk + 5, 2 * chunk},
                                  {4 * chunk - 1, 1},
                                  {0, 4 * chunk}}) {
    const text_id text = text_of(content);
    store.cut(text, at, bytes);
    EXPECT_EQ(all_of(text), content.substr(at, bytes)) << at << " " << bytes;
    EXPECT_EQ(store.chunks_of(text), (at % chunk + bytes + chunk - 1) / chunk);
    EXPECT_EQ(store.free(), 8U - store.chunks_of(text));
    EXPECT_TRUE(store.check());
    store.release(text);
  }
}

TEST_F(chunk_store_test, loses_no_chunk_in_random_use) {
  std::mt19937 random{7};
  std::vector<std::pair<text_id, std::string>> held;
  for (int i = 0; i < 5000; ++i) {
    if (!held.empty() && random() % 2 == 0) {
      const std::size_t which = random() % held.size();
      EXPECT_EQ(all_of(held[which].first), held[which].second);
      store.release(held[which].first);
      held.erase(held.begin() + static_cast<std::ptrdiff_t>(which));
      continue;
    }
    std::string content = random_text(1 + random() % (3 * chunk), static_cast<unsigned>(random()));
    const text_id text = text_of(content, 1 + random() % 9000);
    if (!text) continue;
    if (random() % 2 == 0) {
      const std::size_t at = random() % content.size();
      const std::size_t bytes = 1 + random() % (content.size() - at);
      store.cut(text, at, bytes);
      content = content.substr(at, bytes);
    }
    held.emplace_back(text, std::move(content));
    ASSERT_TRUE(store.check());
  }
}

struct counting_opener final : rowe::service::pool_opener {
  bool open(std::size_t bytes) noexcept override {
    if (bytes > most) return false;
    opened = bytes;
    return true;
  }
  std::size_t most = SIZE_MAX;
  std::size_t opened = 0;
};

TEST(chunk_store_pool, is_opened_as_it_is_used_and_not_again) {
  rowe::limits bounds = few();
  bounds.long_message_bytes_max = 100 * chunk;
  rowe::rt::arena memory{chunk_store::footprint_bytes(bounds), rowe::rt::page_lock::none};
  const std::size_t all = chunk_store::pool_bytes(bounds);
  const std::unique_ptr<std::byte[]> pool{new std::byte[all]};
  counting_opener opener;
  chunk_store store{memory, {pool.get(), all}, bounds, &opener};
  // The place for a text in one piece is in front, so it is open where any chunk is.
  const std::size_t whole = chunk_store::whole_bytes(bounds);
  EXPECT_EQ(store.whole().data(), pool.get());
  EXPECT_EQ(store.whole().size(), whole);
  EXPECT_EQ(opener.opened, 0U);
  EXPECT_EQ(store.free(), 400U);
  const text_id first = store.begin(chunk);
  EXPECT_EQ(opener.opened, whole + 64 * chunk);
  const text_id second = store.begin(80 * chunk);
  EXPECT_EQ(opener.opened, whole + 128 * chunk);
  opener.most = whole + 130 * chunk;
  EXPECT_TRUE(store.check());
  EXPECT_FALSE(store.grow(first, 51 * chunk)); // the system has no more
  EXPECT_FALSE(store.begin(51 * chunk));
  EXPECT_TRUE(store.check());
  store.release(second);
  EXPECT_TRUE(store.grow(first, 100 * chunk)); // what was used before is open
  EXPECT_EQ(opener.opened, whole + 128 * chunk);
  store.release(first);
  EXPECT_TRUE(store.check());
}

} // namespace
} // namespace chunk_store_test
