// SPDX-License-Identifier: Apache-2.0
#include "service/core/memory_plan.hpp"

#include <gtest/gtest.h>

#include "core_harness.hpp"
#include "service/base/service_limits.hpp"

namespace memory_plan_test {
namespace {

TEST(memory_plan, stays_below_what_ordinary_users_may_lock_on_debian) {
  const auto plan = rowe::service::plan_memory(rowe::limits{});
  constexpr std::size_t for_handles = std::size_t{1} << 20; // those that come first
  EXPECT_LT(plan.arena() + for_handles, std::size_t{8} * 1024 * 1024);
}

// A structure that grows, or is forgotten, shows here. Whoever means it writes the new number.
TEST(memory_plan, of_the_defaults_is_what_it_was_within_a_percent) {
  constexpr double bytes = 15'616'000;
  EXPECT_NEAR(static_cast<double>(rowe::limits{}.footprint_bytes()), bytes, 0.01 * bytes);
}

// What these are for each is measured by tests/counts/tls_memory_test.cpp.
TEST(memory_plan, has_the_heap_of_tls_for_each_connection_and_each_handshake) {
  const rowe::limits less;
  rowe::limits more = less;
  more.connections_max += 10;
  more.handshakes_max += 10;
  const auto of_tls = [](const rowe::limits& one) {
    return one.footprint_bytes(rowe::transport_security::tls) - one.footprint_bytes();
  };
  EXPECT_EQ(of_tls(more) - of_tls(less),
            10 * (rowe::service::tls_connection_bytes + rowe::service::tls_place_bytes +
                  rowe::service::tls_handshake_bytes));
  EXPECT_GT(of_tls(less), 40 * rowe::service::tls_connection_bytes + 32 * rowe::service::tls_handshake_bytes);
}

TEST(memory_plan, is_the_sum_of_what_is_carved) {
  for (const rowe::limits& bounds : {rowe::limits{}, harness::small_options().limits}) {
    rowe::endpoint_options options;
    options.limits = bounds;
    harness::core_harness built{options};
    const auto plan = rowe::service::plan_memory(bounds);
    EXPECT_EQ(built.memory.bytes_used(), plan.arena());
  }
}

} // namespace
} // namespace memory_plan_test
