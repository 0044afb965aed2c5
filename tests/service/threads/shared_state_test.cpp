// SPDX-License-Identifier: Apache-2.0
#include "service/threads/shared_state.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>

#include "rt/watchdog.hpp"

namespace rowe::service {
namespace shared_state_test {
namespace {

class showing : public ::testing::Test {
 protected:
  rt::arena memory_{1 << 20, rt::page_lock::none};
  shared_state shared_{memory_, limits{.connections_max = 3}};
};

TEST_F(showing, shows_who_is_connected) {
  EXPECT_TRUE(shared_.connections().empty());
  shared_.set_connection(2, 7, "127.0.0.1:50000");
  shared_.set_connection(0, 1, "[2001:db8::1]:80");
  const auto peers = shared_.connections();
  ASSERT_EQ(peers.size(), 2U);
  EXPECT_EQ(peers[0].id, (rowe::connection{0, 1}));
  EXPECT_EQ(peers[0].address, "[2001:db8::1]:80");
  EXPECT_EQ(peers[1].id, (rowe::connection{2, 7}));
  EXPECT_EQ(peers[1].address, "127.0.0.1:50000");
  shared_.set_connection(0, 0, {});
  EXPECT_EQ(shared_.connections().size(), 1U);
  EXPECT_EQ(shared_.generations()[0].load(std::memory_order_acquire), 0U); // pairs with set_connection()
}

TEST_F(showing, shows_who_has_an_identity_until_it_is_gone) {
  const std::string longest(64, 'n');
  shared_.set_connection(2, 7, "127.0.0.1:50000", longest);
  shared_.set_connection(0, 1, "127.0.0.1:50001");
  EXPECT_EQ(shared_.connections().at(1).identity, longest);
  EXPECT_EQ(shared_.connections().at(1).address, "127.0.0.1:50000");
  EXPECT_EQ(shared_.connections().at(0).identity, "");
  EXPECT_EQ(shared_.identity_of({2, 7}).view(), longest);
  EXPECT_EQ(shared_.identity_of({2, 6}).view(), "");
  EXPECT_EQ(shared_.identity_of({0, 1}).view(), "");
  EXPECT_EQ(shared_.identity_of({99, 1}).view(), "");
  shared_.set_connection(2, 0, {});
  EXPECT_EQ(shared_.identity_of({2, 7}).view(), "");
}

TEST_F(showing, cuts_an_address_that_is_too_long) {
  shared_.set_connection(1, 1, std::string(200, 'x'));
  EXPECT_EQ(shared_.connections().at(0).address, std::string(63, 'x'));
}

// A place is used again and again while others look: nobody sees half an address, or one with the generation
// of another.
TEST_F(showing, never_shows_an_address_that_is_not_its_generations) {
  const tests::watchdog guard{"looking at connections"};
  constexpr std::uint32_t uses = 100'000;
  std::atomic<bool> done{false};
  const auto address_of = [](std::uint32_t generation) {
    return std::string(60, static_cast<char>('a' + generation % 26));
  };
  std::thread reader{[&] {
    std::uint64_t seen = 0;
    while (!done.load() || seen == 0) {
      for (const peer& one : shared_.connections()) {
        ASSERT_EQ(one.address, address_of(one.id.generation));
        ++seen;
      }
    }
  }};
  for (std::uint32_t generation = 1; generation <= uses; ++generation) {
    shared_.set_connection(1, 0, {});
    shared_.set_connection(1, generation, address_of(generation));
  }
  done.store(true);
  reader.join();
}

} // namespace
} // namespace shared_state_test
} // namespace rowe::service
