// SPDX-License-Identifier: Apache-2.0
#include "service/requests/fitting_names.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace fitting_names_test {
namespace {

using rowe::service::fitting_names;

struct row {
  std::size_t bytes;
  bool own = false;
};

// Which of the rows are written, by their numbers.
std::vector<std::size_t> written(std::size_t room, std::size_t places, const std::vector<row>& rows) {
  fitting_names fits{room, places};
  for (const row& one : rows) fits.add(one.bytes, one.own);
  std::vector<std::size_t> found;
  for (const bool first : {true, false}) { // names, and types
    std::vector<std::size_t> walk;
    fits.begin();
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (fits.take(rows[i].bytes, rows[i].own)) walk.push_back(i);
    EXPECT_EQ(fits.left_out(), rows.size() - walk.size());
    if (!first) {
      EXPECT_EQ(walk, found);
    }
    found = walk;
  }
  return found;
}

using numbers = std::vector<std::size_t>;

TEST(fitting_names, are_those_that_take_no_more_than_their_share_whatever_others_take) {
  EXPECT_EQ(written(100, 4, {{80}, {80}, {25}, {25}}), (numbers{2, 3}));
  EXPECT_EQ(written(100, 4, {{50}, {80}, {25}, {25}}), (numbers{0, 2, 3}));
}

TEST(fitting_names, are_long_ones_of_this_process_before_those_of_peers) {
  EXPECT_EQ(written(100, 10, {{60}, {60, true}, {30}}), (numbers{1, 2}));
  EXPECT_EQ(written(100, 10, {{60, true}, {60, true}, {40}}), (numbers{0}));
}

TEST(fitting_names, are_none_where_there_is_no_room) {
  EXPECT_EQ(written(0, 4, {{1}, {1, true}}), numbers{});
}

} // namespace
} // namespace fitting_names_test
