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
