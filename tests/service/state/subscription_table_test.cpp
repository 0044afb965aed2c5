// SPDX-License-Identifier: Apache-2.0
#include "service/state/subscription_table.hpp"

#include <gtest/gtest.h>

#include "wire/protocols/protocols.hpp"

namespace subscription_table_test {
namespace {

using rowe::service::subscription_table;
using rowe::service::topic_table;

struct subscription_table_test : testing::Test {
  rowe::limits bounds{.topics_max = 4, .subscriptions_max = 6};
  rowe::rt::arena memory{topic_table::footprint_bytes(bounds) + subscription_table::footprint_bytes(bounds),
                         rowe::rt::page_lock::none};
  topic_table topics{memory, bounds, rowe::wire::protocols_of(rowe::websocket_profile::standard).envelope};
  subscription_table table{memory, bounds, topics};
};

} // namespace
} // namespace subscription_table_test
