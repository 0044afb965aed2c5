// SPDX-License-Identifier: Apache-2.0
#include "service/state/timers.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace timers_test {
namespace {

using namespace std::chrono_literals;
using rowe::service::timer;
using rowe::service::timers;

struct timers_test : testing::Test {
  rowe::limits bounds;
  rowe::rt::arena memory{timers::footprint_bytes(bounds), rowe::rt::page_lock::none};
  rowe::rt::time_point start{1s};
  timers all{memory, bounds, start};

  std::vector<std::pair<timer, std::uint32_t>> due(rowe::rt::duration after) {
    std::vector<std::pair<timer, std::uint32_t>> found;
    while (const auto one = all.take_due(start + after)) found.emplace_back(one->what, one->index);
    EXPECT_TRUE(all.check());
    return found;
  }
};

} // namespace
} // namespace timers_test
