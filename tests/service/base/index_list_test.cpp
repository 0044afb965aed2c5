// SPDX-License-Identifier: Apache-2.0
#include "service/base/index_list.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <random>
#include <vector>

#include "service/base/index_ring.hpp"

namespace index_list_test {
namespace {

using number = rowe::service::id<struct row_tag>;
using numbers = std::vector<std::uint32_t>;

struct row {
  number next;
  number previous;
};
using table = rowe::service::rows<number, row>;
using queue = rowe::service::index_queue<number, row, &row::next>;
using list = rowe::service::index_list<number, row, &row::next, &row::previous>;

constexpr std::uint32_t many = 6;

struct index_list : testing::Test {
  template <class List>
  numbers in_order(const List& of) const {
    numbers found;
    for (number i = of.head; i; i = all[i].next) found.push_back(i.value);
    return found;
  }
  bool right(const list& of) const {
    return of.check(all, [](const row&) { return true; });
  }

  std::array<row, many> memory{};
  table all{memory};
};
using index_queue = index_list;

TEST_F(index_queue, gives_rows_in_the_order_in_which_they_came) {
  queue waiting;
  EXPECT_TRUE(waiting.empty());
  for (const std::uint32_t i : {3U, 1U, 4U}) waiting.push_back(all, number{i});
  EXPECT_EQ(in_order(waiting), (numbers{3, 1, 4}));
  EXPECT_EQ(waiting.pop_front(all), number{3});
  EXPECT_EQ(waiting.pop_front(all), number{1});
  EXPECT_EQ(waiting.pop_front(all), number{4});
  EXPECT_TRUE(waiting.empty());
}

TEST_F(index_queue, takes_a_row_out_wherever_it_stands) {
  queue waiting;
  for (std::uint32_t i = 0; i < 4; ++i) waiting.push_back(all, number{i});
  EXPECT_TRUE(waiting.erase(all, number{2})); // in the middle
  EXPECT_TRUE(waiting.erase(all, number{0})); // in front
  EXPECT_TRUE(waiting.erase(all, number{3})); // behind
  EXPECT_EQ(in_order(waiting), numbers{1});
  EXPECT_FALSE(waiting.erase(all, number{3}));
  waiting.push_back(all, number{5});
  EXPECT_EQ(in_order(waiting), (numbers{1, 5}));
}

TEST_F(index_queue, is_walked_while_rows_are_taken_out) {
  queue waiting;
  for (std::uint32_t i = 0; i < many; ++i) waiting.push_back(all, number{i});
  number before{};
  for (number i = waiting.head; i;) {
    const number next = all[i].next;
    if (i.value % 2 == 0) {
      waiting.erase_behind(all, before);
    } else {
      before = i;
    }
    i = next;
  }
  EXPECT_EQ(in_order(waiting), (numbers{1, 3, 5}));
  EXPECT_EQ(waiting.tail, number{5});
}

TEST_F(index_list, puts_rows_in_front_and_behind) {
  list of;
  of.push_back(all, number{0});
  of.push_front(all, number{1});
  of.push_back(all, number{2});
  EXPECT_EQ(in_order(of), (numbers{1, 0, 2}));
  EXPECT_EQ(of.count, 3U);
  EXPECT_TRUE(right(of));
}

TEST_F(index_list, does_what_a_deque_does) {
  std::mt19937 roll{1};
  list of;
  std::deque<std::uint32_t> model;
  for (int i = 0; i < 2000; ++i) {
    const auto which = static_cast<std::uint32_t>(roll() % many);
    const auto found = std::find(model.begin(), model.end(), which);
    if (found != model.end()) {
      of.erase(all, number{which});
      model.erase(found);
    } else if (roll() % 2 == 0) {
      of.push_front(all, number{which});
      model.push_front(which);
    } else {
      of.push_back(all, number{which});
      model.push_back(which);
    }
    ASSERT_EQ(in_order(of), numbers(model.begin(), model.end())) << i;
    ASSERT_TRUE(right(of)) << i;
  }
}

TEST_F(index_list, sees_links_that_do_not_agree) {
  list of;
  for (std::uint32_t i = 0; i < 3; ++i) of.push_back(all, number{i});
  all[number{1}].previous = number{2};
  EXPECT_FALSE(right(of));
  all[number{1}].previous = number{0};
  EXPECT_TRUE(right(of));
  of.count = 2;
  EXPECT_FALSE(right(of));
  of.count = 3;
  EXPECT_FALSE(of.check(all, [&](const row& one) { return &one != &all[number{1}]; }));
}

TEST(index_ring, gives_everybody_a_turn_before_anybody_has_a_second_one) {
  std::array<number, 3> places;
  rowe::service::index_ring<number> ring{places};
  for (std::uint32_t i = 0; i < 3; ++i) ring.push(number{i});
  numbers turns;
  for (int i = 0; i < 7; ++i) {
    const number next = ring.pop();
    turns.push_back(next.value);
    ring.push(next);
  }
  EXPECT_EQ(turns, (numbers{0, 1, 2, 0, 1, 2, 0}));
  EXPECT_EQ(ring.count(), 3U);
  while (!ring.empty()) (void)ring.pop();
  EXPECT_EQ(ring.count(), 0U);
}

} // namespace
} // namespace index_list_test
