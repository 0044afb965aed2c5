// SPDX-License-Identifier: Apache-2.0
// The front door's verdict under the explorer: an asker that waits, with deadlines that may come at any
// moment, and a settler that comes once for each request. The slot's text is plain, so the explorer reports
// at once if the slot ever has two holders.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "service/verdict.hpp"

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace verdict_test {
namespace {

using service::slot_holder;
using verdict = service::verdict<atomics, futex>;
using ring = rt::spsc_ring<std::uint32_t, atomics>;

constexpr rt::time_point soon{}; // may come at any moment

// A slot of the front door, the ring through which the settler gets it, and the ring by which the settler
// gives it back if the asker has left.
struct one_slot {
  std::array<ring::entry, 2> requests;
  std::array<ring::entry, 2> returns;
  ring out{requests};
  ring home{returns};
  ring::producer& out_end{*out.take_producer()};
  ring::consumer& in_end{*out.take_consumer()};
  ring::producer& return_end{*home.take_producer()};
  ring::consumer& home_end{*home.take_consumer()};
  verdict word;
  atomics::plain<std::uint32_t> text; // the request's, then the reply's
  atomics::plain<std::uint32_t>
      header;                  // the settler leaves it alone, so the asker may read it before it waits
  std::uint32_t came_home = 0; // to the asker with its verdict, or by the settler
  std::uint32_t asked = 0;

  static constexpr std::uint32_t answer = 100;

  void ask(bool waits) {
    text.store(++asked);
    header.store(asked);
    word.arm(waits);
    require(out_end.try_push(asked), "there is a place for the request");
  }
  // What the asker finds when it is told that the verdict is there; the slot is its own again.
  void read() {
    require(text.load() == asked + answer, "the verdict comes with its outcome");
    use_for_something_else();
    ++came_home;
  }
  void use_for_something_else() {
    text.store(0);
    header.store(0);
  }
  bool wait(rt::time_point deadline) {
    require(header.load() == asked, "the header stays as it was");
    if (word.wait_until(deadline) != slot_holder::asker) return false;
    read();
    return true;
  }
  // The settler's whole part: nothing is waited for.
  void settle_one() {
    const auto request = in_end.try_pop();
    if (!request) return;
    require(text.load() == *request, "the settler reads what is asked");
    text.store(*request + answer);
    if (word.settle() == slot_holder::asker) return;
    use_for_something_else();
    require(return_end.try_push(*request), "there is a place for every slot");
  }
  void bring_home() {
    while (home_end.try_pop()) {
      require(text.load() == 0, "who gives the slot back had it alone");
      ++came_home;
    }
  }
  void afterwards() {
    settle_one();
    bring_home();
    require(came_home == asked, "every slot comes home, once for each request");
  }
};

// The settler is told by an own bell, so that a wait without a deadline must end.
struct waits_for_ever : one_slot {
  bell asked_for;
  std::array<actor, 2> actors() {
    return {{{"asker",
              [this] {
                ask(true);
                asked_for.ring();
                require(wait(rt::never), "without a deadline a wait ends only with the verdict");
              }},
             {"settler", [this] {
                asked_for.wait();
                settle_one();
              }}}};
  }
};

struct runs_out_of_time : one_slot {
  std::array<actor, 2> actors() {
    return {{{"asker",
              [this] {
                ask(true);
                (void)wait(soon);
              }},
             {"settler", [this] { settle_one(); }}}};
  }
};

struct leaves_without_waiting : one_slot {
  std::array<actor, 2> actors() {
    return {{{"asker",
              [this] {
                ask(true);
                require(header.load() == asked, "the header stays as it was");
                if (word.abandon() == slot_holder::asker) read();
              }},
             {"settler", [this] { settle_one(); }}}};
  }
};

struct asks_without_waiting : one_slot {
  std::array<actor, 2> actors() {
    return {{{"asker",
              [this] {
                ask(false);
                bring_home();
              }},
             {"settler", [this] { settle_one(); }}}};
  }
};

// The slot is used again at once, whoever brought it home: a wake of the first use may come in the second.
struct asks_again : one_slot {
  bell once;
  bell again;
  std::array<actor, 2> actors() {
    return {{{"asker",
              [this] {
                ask(true);
                once.ring();
                if (!wait(soon)) bring_home();
                if (came_home == 0) return again.ring(); // still on its way
                ask(true);
                again.ring();
                require(wait(rt::never), "the second wait is not confused by the first");
              }},
             {"settler", [this] {
                once.wait();
                settle_one();
                again.wait();
                settle_one();
              }}}};
  }
};

TEST(verdict, wakes_whoever_waits_for_it) { expect_passes_in_every_interleaving<waits_for_ever>(); }

TEST(verdict, leaves_the_slot_to_exactly_one_side_when_time_runs_out) {
  expect_passes_in_every_interleaving<runs_out_of_time>();
}

TEST(verdict, leaves_the_slot_to_exactly_one_side_when_the_asker_leaves_at_once) {
  expect_passes_in_every_interleaving<leaves_without_waiting>();
}

TEST(verdict, leaves_the_slot_to_the_settler_when_nobody_waits) {
  expect_passes_in_every_interleaving<asks_without_waiting>();
}

TEST(verdict, is_not_confused_when_its_slot_is_used_again) { expect_passes<asks_again>(); }

TEST(verdict, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{
      scenario<waits_for_ever>("waits_for_ever"), scenario<runs_out_of_time>("runs_out_of_time"),
      scenario<leaves_without_waiting>("leaves_without_waiting"),
      scenario<asks_without_waiting>("asks_without_waiting"), scenario<asks_again>("asks_again")};
  EXPECT_EQ((mutation_test{"service/verdict.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace verdict_test
} // namespace rowe::model
