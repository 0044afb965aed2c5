// SPDX-License-Identifier: Apache-2.0
// A thread that changes the rights, and the service thread, under the explorer. A policy is written before it
// is offered, and overwritten, as memory that is freed may be, once the next one was taken.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>

#include "service/threads/policy_handover.hpp"

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace policy_handover_test {
namespace {

struct rights {
  atomics::plain<std::uint32_t> version;
};
using handover = service::policy_handover<rights, atomics, futex>;

template <std::uint32_t changes>
struct takes_each_whole {
  static constexpr std::uint32_t freed = 99;

  std::array<rights, changes + 1> policies;
  handover shared{policies[0]};
  event_fd wakes;
  std::uint32_t seen = 0;

  void cycle() {
    const bool renewed = shared.take();
    const std::uint32_t now = shared.in_use().version.load();
    require(now != freed, "what is in use was not freed");
    require(now == seen + (renewed ? 1 : 0), "each policy is taken once, whole, in order");
    seen = now;
  }
  std::array<actor, 2> actors() {
    return {{{"thread",
              [this] {
                for (std::uint32_t i = 1; i <= changes; ++i) {
                  policies[i].version.store(i);
                  shared.offer(policies[i]);
                  wakes.signal();
                  shared.wait_taken();
                  policies[i - 1].version.store(freed);
                }
              }},
             {"service", [this] {
                for (cycle(); seen != changes; cycle()) wakes.wait();
              }}}};
  }
  void afterwards() { require(!shared.take(), "nothing is offered that was taken"); }
};

TEST(policy_handover, hands_over_each_whole_and_frees_none_that_is_in_use) {
  expect_passes_in_every_interleaving<takes_each_whole<1>>();
  expect_passes<takes_each_whole<2>>();
}

TEST(policy_handover, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<takes_each_whole<2>>("takes_each_whole")};
  EXPECT_EQ((mutation_test{"service/threads/policy_handover.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace policy_handover_test
} // namespace rowe::model
