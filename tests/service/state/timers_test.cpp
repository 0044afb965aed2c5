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

TEST_F(timers_test, tells_whose_time_has_come_of_the_first_and_the_last_row_of_each_kind) {
  using rowe::service::call_index, rowe::service::peer_index, rowe::service::slot_id,
      rowe::service::subscription_id;
  const auto slots = static_cast<std::uint32_t>(rowe::service::slot_pool::count(bounds));
  all.arm(slot_id{0}, start + 1ms);
  all.arm(slot_id{slots - 1}, start + 2ms);
  all.arm(subscription_id{0}, start + 3ms);
  all.arm(subscription_id{bounds.subscriptions_max - 1}, start + 4ms);
  all.arm(peer_index{0}, start + 5ms);
  all.arm(peer_index{bounds.connections_max - 1}, start + 6ms);
  all.arm(call_index{0}, start + 7ms);
  all.arm(call_index{bounds.calls_max - 1}, start + 8ms);
  all.arm(timer::statistics, start + 9ms);
  all.arm(timer::reconnect, start + 10ms);
  all.arm(timer::partial_frames, start + 11ms);
  const std::vector<std::pair<timer, std::uint32_t>> wanted{
      {timer::slot, 0},          {timer::slot, slots - 1},
      {timer::subscription, 0},  {timer::subscription, bounds.subscriptions_max - 1},
      {timer::peer, 0},          {timer::peer, bounds.connections_max - 1},
      {timer::call, 0},          {timer::call, bounds.calls_max - 1},
      {timer::statistics, 0},    {timer::reconnect, 0},
      {timer::partial_frames, 0}};
  EXPECT_EQ(due(1s), wanted);
}

} // namespace
} // namespace timers_test
