// SPDX-License-Identifier: Apache-2.0
// A handle that sleeps until there is room in its queue, and the service thread, which releases slots without
// a look at whether somebody waits for them: detail::wait_room() and handle_submissions::notify_room(), as
// far as the two meet. A run in which the handle is left asleep has failed.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/rt/notification.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"
#include "model/source_text.hpp"

namespace rowe::model {
namespace room_test {
namespace {

using notification = rt::notification<atomics, futex>;

// The service thread does a cycle or two by itself, and one whenever it is woken.
template <int GivesIn>
struct room_comes {
  atomics::variable<std::uint32_t> room_asked{0};
  atomics::variable<std::uint32_t> free_slots{0};
  atomics::variable<std::uint32_t> woken{0};
  notification arrival;
  notification service;
  std::uint32_t told = 0;
  bool released_slots = false;

  void cycle(bool gives) {
    if (gives) {
      free_slots.store(1, order::release);
      released_slots = true;
    }
    const std::uint32_t asked = room_asked.load(order::acquire);
    const bool look = asked != told || released_slots;
    told = asked;
    released_slots = false;
    if (asked != 0 && look) arrival.notify();
  }
  std::array<actor, 2> actors() {
    return {{{"service",
              [this] {
                cycle(GivesIn == 0);
                service.wait_until(rt::never, [this] { return woken.load(order::acquire) != 0; });
                cycle(GivesIn == 1);
                cycle(GivesIn == 2);
              }},
             {"handle", [this] {
                room_asked.store(1, order::release);
                woken.store(1, order::release);
                service.notify();
                require(
                    arrival.wait_until(rt::never, [this] { return free_slots.load(order::acquire) != 0; }),
                    "without a deadline a wait ends only when there is room");
                room_asked.store(0, order::release);
              }}}};
  }
};

TEST(room, wakes_who_waits_for_it_whenever_it_comes) {
  expect_passes<room_comes<0>>();
  expect_passes<room_comes<1>>();
  expect_passes<room_comes<2>>();
}

TEST(room, has_the_accesses_that_the_sources_have) {
  const std::string handle = "include/rowe/detail/waiting.hpp";
  const std::string service = "src/service/handles/handle_submissions.cpp";
  const source_access expected[] = {
      {handle, "on.room_asked.store(on.user.room_waits,std::memory_order_release);handle.wake_service();", 1},
      {handle, "on.room_asked.store(0,std::memory_order_release);", 1},
      {handle, "room_asked.", 2},
      {service, "asked=state_.pairs[i].room_asked.load(std::memory_order_acquire);", 1},
      {service, "queues.room_asked.load(std::memory_order_acquire)!=0;", 1}, // whether to notify
      {service, "room_asked.", 2},
  };
  expect_in_sources(expected);
}

} // namespace
} // namespace room_test
} // namespace rowe::model
