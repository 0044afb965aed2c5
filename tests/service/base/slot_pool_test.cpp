// SPDX-License-Identifier: Apache-2.0
#include "service/base/slot_pool.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace slot_pool_test {
namespace {

using rowe::service::slot_class;
using rowe::service::slot_pool;

struct slot_pool_test : testing::Test {
  rowe::limits bounds{.message_bytes_max = 4096,
                      .long_message_bytes_max = 0,
                      .small_slots = 3,
                      .small_slot_bytes = 256,
                      .large_slots = 1};
  rowe::rt::arena memory{slot_pool::footprint_bytes(bounds), rowe::rt::page_lock::none};
  rowe::service::chunk_store texts{memory, {}, bounds};
  slot_pool slots{memory, texts, bounds};
};

TEST_F(slot_pool_test, loses_and_doubles_no_slot_in_random_use) {
  constexpr std::uint64_t seed = 20;
  SCOPED_TRACE(seed);
  std::mt19937_64 random{seed};
  std::vector<rowe::service::slot_id> held;
  for (int i = 0; i < 20'000; ++i) {
    if (random() % 2 == 0) {
      if (const auto slot = slots.take(random() % 4 != 0 ? slot_class::small : slot_class::large)) {
        ASSERT_EQ(std::count(held.begin(), held.end(), slot), 0);
        held.push_back(slot);
      }
    } else if (!held.empty()) {
      const std::size_t which = random() % held.size();
      if (random() % 2 == 0) {
        ASSERT_TRUE(slots.release(held[which]));
      } else {
        ASSERT_EQ(slots.expire(held[which]), 1U);
      }
      held.erase(held.begin() + static_cast<std::ptrdiff_t>(which));
    }
    ASSERT_EQ(slots.in_use(), held.size());
    ASSERT_TRUE(slots.check());
  }
}

} // namespace
} // namespace slot_pool_test
