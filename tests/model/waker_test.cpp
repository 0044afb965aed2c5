// SPDX-License-Identifier: Apache-2.0
// rowe::rt::waker under the explorer, in the setting of idle::wake: two handles with a queue pair and
// a producer epoch each, a service thread that looks at both queues and sleeps, an eventfd that keeps a
// signal. A run in which the service thread is left asleep with something in a queue has failed.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/waker.hpp>
#include <rowe/rt/window.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace waker_test {
namespace {

struct signal_of {
  event_fd* wakes;
  void raise() const { wakes->signal(); }
};
using waker = rt::waker<atomics, signal_of>;
using epoch = rt::producer_epoch<atomics>;
using ring = rt::spsc_ring<std::uint32_t, atomics>;

struct service {
  event_fd eventfd;
  waker wakes{signal_of{&eventfd}};
};

// A queue pair that keeps all values.
struct queue_pair {
  std::array<ring::entry, 2> entries;
  ring queue{entries};
  ring::producer& in{*queue.take_producer()};
  ring::consumer& out{*queue.take_consumer()};
  epoch advances;
  std::uint32_t taken = 0;

  void hand_over(std::uint32_t value, service& to) {
    require(in.try_push(value), "there is a place for every value");
    to.wakes.wake(advances);
  }
  // As handle_submissions::take().
  void take() {
    advances.mark();
    while (const auto value = out.try_pop()) require(*value == taken++, "values come in order, each once");
  }
};

// service_loop::run() with idle::wake, until `until()`: cycles, and sleeps for ever between them, so that
// only a signal helps when the service thread did not look.
template <class Take, class Quiet, class Until>
void serve(service& s, Take take, Quiet quiet, Until until) {
  for (;;) {
    take();
    if (until()) return;
    s.wakes.sleep(quiet, [&] { s.eventfd.wait(); });
  }
}

// What the service thread has to find is there or not: it looks until it finds it.
template <class Found>
void serve_until(service& s, epoch& advances, Found found) {
  bool is_there = false;
  serve(
      s,
      [&] {
        advances.mark();
        is_there = found();
      },
      [&] { return advances.quiet(); }, [&] { return is_there; });
}

struct one_handle {
  static constexpr std::uint32_t values = 2;
  service s;
  queue_pair handed;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                for (std::uint32_t i = 0; i != values; ++i) handed.hand_over(i, s);
              }},
             {"service", [this] {
                serve(
                    s, [this] { handed.take(); }, [this] { return handed.advances.quiet(); },
                    [this] { return handed.taken == values; });
              }}}};
  }
};

struct two_handles {
  service s;
  std::array<queue_pair, 2> pairs;

  std::array<actor, 3> actors() {
    return {{{"one", [this] { pairs[0].hand_over(0, s); }},
             {"other", [this] { pairs[1].hand_over(0, s); }},
             {"service", [this] {
                serve(
                    s,
                    [this] {
                      for (queue_pair& one : pairs) one.take();
                    },
                    [this] { return pairs[0].advances.quiet() && pairs[1].advances.quiet(); },
                    [this] { return pairs[0].taken + pairs[1].taken == 2; });
              }}}};
  }
};

// A window that keeps the newest: there is no ring, so only the epoch orders the window's words.
struct newest_value {
  service s;
  rt::window_core<atomics> cell;
  rt::window_core<atomics>::writer& in{*cell.take_writer()};
  rt::window_core<atomics>::reader& out{*cell.take_reader()};
  epoch advances;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                in.end_write(in.begin_write());
                s.wakes.wake(advances);
              }},
             {"service", [this] {
                serve_until(s, advances, [this] { return out.begin_read().state == rt::freshness::fresh; });
              }}}};
  }
};

// The weakest thing that can be handed over: a word that says nothing of its own. Only the epoch orders it.
struct bare_word {
  service s;
  atomics::variable<bool> given{false};
  epoch advances;

  std::array<actor, 2> actors() {
    return {
        {{"handle",
          [this] {
            given.store(true, order::relaxed);
            s.wakes.wake(advances);
          }},
         {"service", [this] { serve_until(s, advances, [this] { return given.load(order::relaxed); }); }}}};
  }
};

// A handle that hands over while the service thread is awake does not enter the kernel.
struct awake {
  service s;
  queue_pair handed;
  bool slept = false;

  std::array<actor, 2> actors() {
    return {{{"handle", [this] { handed.hand_over(0, s); }}, {"service", [this] { handed.take(); }}}};
  }
  void afterwards() {
    s.wakes.sleep([this] { return handed.advances.quiet(); },
                  [this] {
                    slept = true;
                    require(handed.taken == 1, "it sleeps only when all was taken that was there");
                  });
    if (!slept) handed.take();
    require(handed.taken == 1, "what came late keeps it awake");
  }
};

TEST(waker, loses_no_wake_up_of_one_handle) { expect_passes<one_handle>(); }

TEST(waker, loses_no_wake_up_of_two_handles) { expect_passes<two_handles>(); }

TEST(waker, brings_the_newest_value) { expect_passes_in_every_interleaving<newest_value>(); }

TEST(waker, brings_what_has_no_order_of_its_own) { expect_passes_in_every_interleaving<bare_word>(); }

TEST(waker, keeps_awake_who_has_not_looked) { expect_passes_in_every_interleaving<awake>(); }

TEST(waker, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<one_handle>("one_handle"), scenario<bare_word>("bare_word"),
                             scenario<newest_value>("newest_value"), scenario<awake>("awake")};
  EXPECT_EQ((mutation_test{"rowe/rt/waker.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace waker_test
} // namespace rowe::model
