// SPDX-License-Identifier: Apache-2.0
#include "service/base/indexed_pool.hpp"

#include <gtest/gtest.h>

#include <array>
#include <set>

namespace indexed_pool_test {
namespace {

using number = rowe::service::id<struct row_tag>;

struct row {
  number next;
  int value = 0;
};
using table = rowe::service::rows<number, row>;
using pool = rowe::service::indexed_pool<number, row, &row::next>;

constexpr auto any = [](const row&) { return true; };

struct indexed_pool : testing::Test {
  std::array<row, 5> memory{};
  table all{memory};
};

TEST_F(indexed_pool, gives_the_lowest_rows_first) {
  pool free{all};
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(free.take(), number{i});
  EXPECT_TRUE(free.empty());
  EXPECT_EQ(free.take(), number{});
}

TEST_F(indexed_pool, then_gives_the_row_that_was_given_back_last) {
  pool free{all};
  for (int i = 0; i < 4; ++i) (void)free.take();
  free.give_back(number{1});
  free.give_back(number{3});
  EXPECT_EQ(free.take(), number{3});
  EXPECT_EQ(free.take(), number{1});
  EXPECT_EQ(free.take(), number{4});
}

TEST_F(indexed_pool, counts_what_is_free_and_what_is_in_use) {
  pool free{all};
  (void)free.take();
  const number second = free.take();
  EXPECT_EQ(free.free(), 3U);
  EXPECT_EQ(free.in_use(), 2U);
  free.give_back(second);
  EXPECT_EQ(free.in_use(), 1U);
}

TEST_F(indexed_pool, keeps_to_its_range) {
  pool low{all, 0, 2};
  pool high{all, 2, 5};
  std::set<std::uint32_t> from_high;
  while (const number one = high.take()) from_high.insert(one.value);
  EXPECT_EQ(from_high, (std::set<std::uint32_t>{2, 3, 4}));
  EXPECT_EQ(low.free(), 2U);
  EXPECT_TRUE(low.check(any));
  EXPECT_TRUE(high.check(any));
}

TEST_F(indexed_pool, leaves_a_row_as_it_was_but_for_its_link) {
  pool free{all};
  const number one = free.take();
  all[one].value = 7;
  free.give_back(one);
  EXPECT_EQ(all[free.take()].value, 7);
}

TEST_F(indexed_pool, of_no_rows_is_empty) {
  pool free{all, 3, 3};
  EXPECT_TRUE(free.empty());
  EXPECT_EQ(free.take(), number{});
  EXPECT_TRUE(free.check(any));
}

TEST_F(indexed_pool, sees_a_link_that_was_overwritten) {
  pool free{all};
  const number one = free.take();
  EXPECT_TRUE(free.check(any));
  all[number{1}].next = number{1}; // a ring
  EXPECT_FALSE(free.check(any));
  all[number{1}].next = number{}; // cut off
  EXPECT_FALSE(free.check(any));
  all[number{1}].next = one; // one that is in use
  EXPECT_FALSE(free.check([&](const row& of) { return &of != &all[one]; }));
}

TEST(rows, walk_the_numbers_of_all_rows) {
  std::array<row, 3> memory{};
  const table all{memory};
  std::uint32_t expected = 0;
  for (const number one : all.ids()) {
    EXPECT_EQ(one, number{expected++});
    EXPECT_EQ(&all[one], &memory[one.value]);
  }
  EXPECT_EQ(expected, all.size());
  EXPECT_TRUE(all.contains(number{2}));
  EXPECT_FALSE(all.contains(number{3}));
  EXPECT_FALSE(all.contains(number{}));
}

TEST(id, of_nothing_is_none) {
  EXPECT_FALSE(number{});
  EXPECT_TRUE(number{0});
  EXPECT_EQ(number{}.value, number::none);
}

} // namespace
} // namespace indexed_pool_test
