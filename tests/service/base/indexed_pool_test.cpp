// SPDX-License-Identifier: Apache-2.0
#include "service/base/indexed_pool.hpp"

#include <gtest/gtest.h>

#include <array>

namespace indexed_pool_test {
namespace {

using number = rowe::service::id<struct row_tag>;

struct row {
  number next;
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

} // namespace
} // namespace indexed_pool_test
