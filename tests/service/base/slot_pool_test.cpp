// SPDX-License-Identifier: Apache-2.0
#include "service/base/slot_pool.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace slot_pool_test {
namespace {

using rowe::service::slot_class;
using rowe::service::slot_pool;
using rowe::service::slot_ref;

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

} // namespace
} // namespace slot_pool_test
