// SPDX-License-Identifier: Apache-2.0
// rowe::rt::wake_bell under the explorer, in the setting of idle::wake: two handles with a lane and a rope
// each, a service thread that looks at both lanes and sleeps, an eventfd that keeps a ring. A run in which
// the service thread is left asleep with something in a lane has failed.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/wake_bell.hpp>
#include <rowe/rt/window.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace wake_bell_test {
namespace {

struct ring_of {
  bell* heard;
  void ring() const { heard->ring(); }
};
using wake_bell = rt::wake_bell<atomics, ring_of>;
using rope = rt::bell_rope<atomics>;
using ring = rt::spsc_ring<std::uint32_t, atomics>;

struct service {
  bell eventfd;
  wake_bell wakes{ring_of{&eventfd}};
};

// A lane that keeps all.
struct lane {
  std::array<ring::entry, 2> entries;
  ring queue{entries};
  ring::producer& in{*queue.take_producer()};
  ring::consumer& out{*queue.take_consumer()};
  rope pulls;
  std::uint32_t taken = 0;

  void hand_over(std::uint32_t value, service& to) {
    require(in.try_push(value), "there is a place for every value");
    to.wakes.ring(pulls);
  }
  // As core::take_from().
  void take() {
    pulls.mark();
    while (const auto value = out.try_pop()) require(*value == taken++, "values come in order, each once");
  }
};

// service_loop::run() with idle::wake, until `until()`: cycles, and sleeps for ever between them, so that
// nothing but a ring can help whoever did not look.
template <class Take, class Quiet, class Until>
void serve(service& s, Take take, Quiet quiet, Until until) {
  for (;;) {
    take();
    if (until()) return;
    s.wakes.sleep(quiet, [&] { s.eventfd.wait(); });
  }
}

struct one_handle {
  static constexpr std::uint32_t values = 2;
  service s;
  lane handed;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                for (std::uint32_t i = 0; i != values; ++i) handed.hand_over(i, s);
              }},
             {"service", [this] {
                serve(
                    s, [this] { handed.take(); }, [this] { return handed.pulls.quiet(); },
                    [this] { return handed.taken == values; });
              }}}};
  }
};

struct two_handles {
  service s;
  std::array<lane, 2> lanes;

  std::array<actor, 3> actors() {
    return {{{"one", [this] { lanes[0].hand_over(0, s); }},
             {"other", [this] { lanes[1].hand_over(0, s); }},
             {"service", [this] {
                serve(
                    s,
                    [this] {
                      for (lane& one : lanes) one.take();
                    },
                    [this] { return lanes[0].pulls.quiet() && lanes[1].pulls.quiet(); },
                    [this] { return lanes[0].taken + lanes[1].taken == 2; });
              }}}};
  }
};

// A lane that keeps the newest: no ring has an order to lend, only the rope brings the window's words.
struct newest_value {
  service s;
  rt::window_core<atomics> cell;
  rt::window_core<atomics>::writer& in{*cell.take_writer()};
  rt::window_core<atomics>::reader& out{*cell.take_reader()};
  rope pulls;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                in.end_write(in.begin_write());
                s.wakes.ring(pulls);
              }},
             {"service", [this] {
                bool found = false;
                serve(
                    s,
                    [&] {
                      pulls.mark();
                      found = out.begin_read().state == rt::freshness::fresh;
                    },
                    [this] { return pulls.quiet(); }, [&] { return found; });
              }}}};
  }
};

// The weakest thing that can be handed over: a word that says nothing of its own. Only the rope orders it.
struct bare_word {
  service s;
  atomics::variable<bool> given{false};
  rope pulls;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                given.store(true, order::relaxed);
                s.wakes.ring(pulls);
              }},
             {"service", [this] {
                bool found = false;
                serve(
                    s,
                    [&] {
                      pulls.mark();
                      found = given.load(order::relaxed);
                    },
                    [this] { return pulls.quiet(); }, [&] { return found; });
              }}}};
  }
};

// Who hands over while the service thread is awake, and has nothing to look for yet, enters no kernel.
struct awake {
  service s;
  lane handed;
  bool slept = false;

  std::array<actor, 2> actors() {
    return {{{"handle", [this] { handed.hand_over(0, s); }}, {"service", [this] { handed.take(); }}}};
  }
  void afterwards() {
    s.wakes.sleep([this] { return handed.pulls.quiet(); },
                  [this] {
                    slept = true;
                    require(handed.taken == 1, "it sleeps only when all was taken that was there");
                  });
    if (!slept) handed.take();
    require(handed.taken == 1, "what came late keeps it awake");
  }
};

TEST(wake_bell, loses_no_wake_up_of_one_handle) { expect_passes<one_handle>(); }

TEST(wake_bell, loses_no_wake_up_of_two_handles) { expect_passes<two_handles>(); }

TEST(wake_bell, brings_the_newest_value) { expect_passes_in_every_interleaving<newest_value>(); }

TEST(wake_bell, brings_what_has_no_order_of_its_own) { expect_passes_in_every_interleaving<bare_word>(); }

TEST(wake_bell, keeps_awake_who_has_not_looked) { expect_passes_in_every_interleaving<awake>(); }

TEST(wake_bell, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<one_handle>("one_handle"), scenario<bare_word>("bare_word"),
                             scenario<newest_value>("newest_value"), scenario<awake>("awake")};
  EXPECT_EQ((mutation_test{"rowe/rt/wake_bell.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace wake_bell_test
} // namespace rowe::model
