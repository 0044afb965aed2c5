// SPDX-License-Identifier: Apache-2.0
// rowe::rt::notification under the explorer, with a kernel that compares and sleeps in one step, wakes who
// sleeps, and once a run returns early for no reason. A run in which the sleeper is left asleep has failed.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>

#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace notification_test {
namespace {

using notification = rt::notification<atomics, futex>;
using ring = rt::spsc_ring<std::uint32_t, atomics>;

// What it is for: one thread pushes, the other sleeps until there is something to pop.
struct pops_what_is_pushed {
  static constexpr std::uint32_t items = 2;

  std::array<ring::entry, 2> entries;
  ring queue{entries};
  ring::producer& in{*queue.take_producer()};
  ring::consumer& out{*queue.take_consumer()};
  notification arrived;

  std::array<actor, 2> actors() {
    return {{{"notifier",
              [this] {
                for (std::uint32_t i = 0; i != items; ++i) {
                  require(in.try_push(i), "there is a place for every item");
                  arrived.notify();
                }
              }},
             {"sleeper", [this] {
                for (std::uint32_t i = 0; i != items; ++i) {
                  std::optional<std::uint32_t> item;
                  const bool ready = arrived.wait_until(rt::never, [&] {
                    item = out.try_pop();
                    return item.has_value();
                  });
                  require(ready && *item == i, "each item wakes who waits for it");
                }
              }}}};
  }
};

// Several notifiers, whose words say no more than that they were stored. Only the notification orders them.
struct waits_for_both {
  atomics::variable<bool> one{false};
  atomics::variable<bool> other{false};
  notification arrived;

  void come(atomics::variable<bool>& word) {
    word.store(true, order::relaxed);
    arrived.notify();
  }
  std::array<actor, 3> actors() {
    return {{{"one", [this] { come(one); }},
             {"other", [this] { come(other); }},
             {"sleeper", [this] {
                const bool ready = arrived.wait_until(
                    rt::never, [this] { return one.load(order::relaxed) && other.load(order::relaxed); });
                require(ready, "without a deadline a wait ends only when it is over");
              }}}};
  }
};

// With a deadline, which may come at any moment; also when the notify does.
struct waits_in_time {
  atomics::variable<bool> come{false};
  notification arrived;
  bool late = false;

  std::array<actor, 2> actors() {
    return {{{"notifier",
              [this] {
                come.store(true, order::relaxed);
                arrived.notify();
              }},
             {"sleeper", [this] {
                const bool ready =
                    arrived.wait_until(rt::time_point{}, [this] { return come.load(order::relaxed); });
                if (ready) return;
                // The next wait begins anew and loses nothing of what came in between.
                require(arrived.wait_until(rt::never, [this] { return come.load(order::relaxed); }),
                        "a wait after a late one is ended by the notify");
              }}}};
  }
};

TEST(notification, loses_no_wake_up_and_misses_no_item) {
  expect_passes_in_every_interleaving<pops_what_is_pushed>();
}

TEST(notification, shows_what_every_notifier_stored_before_it_notified) {
  expect_passes_in_every_interleaving<waits_for_both>();
}

TEST(notification, loses_nothing_when_a_deadline_comes_at_the_same_time) {
  expect_passes_in_every_interleaving<waits_in_time>();
}

TEST(notification, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<pops_what_is_pushed>("pops_what_is_pushed"),
                             scenario<waits_for_both>("waits_for_both"),
                             scenario<waits_in_time>("waits_in_time")};
  // All changes are exchanges, so each passes on what those before it released.
  const std::array listed{
      stronger_than_needed{"notify", "notified", order::release,
                           "what it reads says only whether to wake; the kernel's own lock orders that"},
      stronger_than_needed{"wait_until", "idle, ", order::acquire, "it gives nothing of its own to anybody"},
      stronger_than_needed{"wait_until", "before", order::relaxed,
                           "what it replaces is acquired by the next exchange, which reads it from here"}};
  EXPECT_EQ((mutation_test{"rowe/rt/notification.hpp", scenarios, listed}.findings()), "");
}

} // namespace
} // namespace notification_test
} // namespace rowe::model
