// SPDX-License-Identifier: Apache-2.0
// A thread of this process that stops the loops, and the service thread, under the explorer: the words are
// written first, so they come with the stop. The windows have a test of their own.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include "service/threads/local_stop.hpp"

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace local_stop_test {
namespace {

struct stops_once {
  service::local_stop<atomics> shared;
  std::uint32_t carried_out = 0;

  void cycle() {
    if (!shared.take()) return;
    service::local_stop_asked asked;
    shared.read_requests(asked);
    require(asked.stops == 1, "the words come with the stop");
    ++carried_out;
  }
  std::array<actor, 2> actors() {
    return {{{"thread",
              [this] {
                service::local_stop_asked asked;
                asked.stops = 1;
                shared.write_request(asked);
                shared.request();
              }},
             {"service", [this] {
                cycle();
                cycle();
              }}}};
  }
  void afterwards() {
    cycle();
    require(carried_out == 1, "a stop is carried out, and once");
  }
};

struct resets_what_it_stopped {
  service::local_stop<atomics> shared;
  std::uint32_t carried_out = 0;

  void cycle() {
    if (shared.take()) ++carried_out;
    service::local_stop_asked asked;
    shared.read_requests(asked);
    if (asked.resets == 0 || shared.taken() != asked.count_before_reset) return;
    require(carried_out == 1, "the stop is carried out before the reset that was asked for behind it");
  }
  std::array<actor, 2> actors() {
    return {{{"thread",
              [this] {
                service::local_stop_asked asked;
                shared.request();
                asked.resets = 1;
                asked.count_before_reset = shared.count();
                shared.write_request(asked);
              }},
             {"service", [this] {
                cycle();
                cycle();
              }}}};
  }
  void afterwards() { cycle(); }
};

TEST(local_stop, comes_once_and_with_its_words) { expect_passes_in_every_interleaving<stops_once>(); }
TEST(local_stop, comes_before_a_reset_that_was_asked_for_behind_it) {
  expect_passes_in_every_interleaving<resets_what_it_stopped>();
}

TEST(local_stop, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<stops_once>("stops_once"),
                             scenario<resets_what_it_stopped>("resets_what_it_stopped")};
  EXPECT_EQ((mutation_test{"service/threads/local_stop.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace local_stop_test
} // namespace rowe::model
