// SPDX-License-Identifier: Apache-2.0
#include "service/memory_plan.hpp"

#include <gtest/gtest.h>

#include "core_harness.hpp"

namespace memory_plan_test {
namespace {

TEST(memory_plan, stays_below_what_ordinary_users_may_lock_on_debian) {
  EXPECT_LT(rowe::limits{}.footprint_bytes(), std::size_t{8} * 1024 * 1024);
}

// A structure that grows, or is forgotten, shows here. Whoever means it writes the new number.
TEST(memory_plan, of_the_defaults_is_what_it_was_within_a_percent) {
  constexpr double bytes = 7'818'880;
  EXPECT_NEAR(static_cast<double>(rowe::limits{}.footprint_bytes()), bytes, 0.01 * bytes);
}

TEST(memory_plan, is_the_sum_of_what_is_carved) {
  for (const rowe::limits& bounds : {rowe::limits{}, harness::small_options().limits}) {
    rowe::endpoint_options options;
    options.limits = bounds;
    harness::core_harness built{options};
    const auto plan = rowe::service::plan_memory(bounds);
    EXPECT_EQ(built.memory.bytes_used() + plan.pair_memory, plan.arena());
  }
}

} // namespace
} // namespace memory_plan_test
