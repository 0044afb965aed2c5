// SPDX-License-Identifier: Apache-2.0
// The stop's shared words under the explorer: loops that look and acknowledge, as stop_latch::engaged() and
// acknowledge() do, against a service thread that renews, stops and resets by the rules of
// service/threads/stop_rules.cpp, which are mirrored here in the few lines that touch the words. Time is what
// each actor says it is: a loop's own cycles, and a permit that ends between two of them.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/detail/stop_permit.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace stop_permit_test {
namespace {

using detail::latch_number;
using permit_word = detail::permit_word<atomics>;
using latch_words = detail::latch_words<atomics>;

// The n-th unit of a permit's time; loops look at these.
constexpr rt::time_point at(std::int64_t n) {
  return rt::time_point{rt::duration{n << detail::permit::unit_shift}};
}
constexpr rt::time_point far = at(1000);

// A loop: each cycle looks, and brakes or moves. `braked` is what it commanded before it acknowledged; the
// service thread may read it once it has seen the acknowledgment.
struct loop {
  latch_words words;
  detail::latch_memory own;
  atomics::plain<latch_number> braked;
  std::int64_t time = 0;
  std::int64_t time_tripped = 0;

  loop() { words.reset(); }

  // True when it must not move.
  bool cycle(const permit_word& granted) {
    ++time;
    const latch_number before = own.tripped;
    const bool stopped = detail::latch_engaged(granted, words, own, at(time));
    if (own.tripped != before) time_tripped = time;
    if (stopped && own.acknowledged != own.tripped) {
      braked.store(own.tripped);
      detail::latch_acknowledge(words, own, at(time));
    }
    return stopped;
  }
};

// stop_rules and stop_service::update(), as far as the words go.
struct service {
  permit_word granted;
  latch_number number = 1;
  bool running = false;

  void renew(rt::time_point until) { granted.grant(number, until); } // stop_rules::update()
  void stop() {                                                      // stop_rules::stop()
    running = false;
    granted.withdraw(number);
  }
  void stop_by_another() { // stop_rules::request(), while stopped
    number = detail::next_latch_number(number);
    granted.withdraw(number);
  }
  // stop_rules::loops_ready()
  bool acknowledged(const loop& l) const {
    const auto answer = l.words.acknowledged(far);
    if (answer.number != number) return false;
    require(l.braked.load() == number, "a loop that has acknowledged has commanded its brake");
    require(answer.at <= far && answer.at >= at(1), "and says when");
    return true;
  }
  void reset() { // stop_rules::reset(), when the loops are ready
    number = detail::next_latch_number(number);
    running = true;
    granted.grant(number, far);
  }
};

// A stop, and a reset as soon as the loop has acknowledged. `let_go` was written by whoever asked for the
// reset; a loop that moves again sees it.
struct stops_and_resets {
  service s;
  loop l;
  atomics::plain<bool> let_go;
  bool was_reset = false;

  stops_and_resets() { s.renew(far); }
  std::array<actor, 2> actors() {
    return {{{"loop",
              [this] {
                for (int i = 0; i != 3; ++i) {
                  if (l.cycle(s.granted) || l.own.acknowledged == 0) continue;
                  require(let_go.load(), "a loop that moves again sees what came before the reset");
                }
              }},
             {"service", [this] {
                s.stop();
                for (int i = 0; i != 2 && !was_reset; ++i) {
                  if (!s.acknowledged(l)) continue;
                  let_go.store(true);
                  s.reset();
                  was_reset = true;
                }
              }}}};
  }
  void afterwards() {
    require(!was_reset || l.own.acknowledged == 1, "no reset before the loop has met the stop");
    require(was_reset || l.cycle(s.granted), "a stop that was not reset is met at the next look");
    require(!was_reset || !l.cycle(s.granted), "after a reset the loop moves");
  }
};

// A permit that ends between two looks and is renewed a moment too late: a loop that has found it over stays
// where it is until a reset, and the service thread stops all for it.
struct renews_late {
  service s;
  loop l;
  bool stopped = false;

  renews_late() { s.renew(at(2)); } // over at the second look
  std::array<actor, 2> actors() {
    return {{{"loop",
              [this] {
                bool met = false;
                for (int i = 0; i != 3; ++i) {
                  const bool stands = l.cycle(s.granted);
                  require(stands || !met, "who has once found the permit over does not move by a renewal");
                  met = stands;
                }
              }},
             {"service", [this] {
                s.renew(far);
                for (int i = 0; i != 2 && !stopped; ++i) {
                  if (l.words.tripped() != s.number) continue; // stop_rules::find_trouble()
                  require(l.words.checked_in() >= at(2), "when it last looked is known with the trip");
                  s.stop();
                  stopped = true;
                }
              }}}};
  }
  void afterwards() {
    if (l.own.tripped == 0) return require(!l.cycle(s.granted), "renewed in time, it goes on");
    require(l.time_tripped >= 2, "nobody is stopped before the permit is over");
    require(l.words.tripped() == s.number, "the service thread finds the trip");
    require(l.cycle(s.granted), "and the loop stands");
  }
};

// The service thread dies: nothing is ever stored again.
struct service_dies {
  service s;
  loop l;
  std::array<actor, 2> actors() {
    return {{{"loop",
              [this] {
                for (int i = 0; i != 4; ++i)
                  require(l.cycle(s.granted) || l.time < 3, "nobody moves after the last permit is over");
              }},
             {"service", [this] {
                s.renew(at(2));
                s.renew(at(3));
              }}}};
  }
};

// Two loops, one of them slow: no reset before both have answered, and none of them moves between.
struct two_loops {
  service s;
  std::array<loop, 2> loops;
  bool was_reset = false;

  two_loops() { s.renew(far); }
  void look(loop& l, int times) {
    for (int i = 0; i != times; ++i) (void)l.cycle(s.granted);
  }
  std::array<actor, 3> actors() {
    return {{{"quick", [this] { look(loops[0], 2); }},
             {"slow", [this] { look(loops[1], 1); }},
             {"service", [this] {
                s.stop();
                for (int i = 0; i != 2 && !was_reset; ++i) {
                  if (!s.acknowledged(loops[0]) || !s.acknowledged(loops[1])) continue;
                  s.reset();
                  was_reset = true;
                }
              }}}};
  }
  void afterwards() {
    for (loop& l : loops) {
      require(!was_reset || l.own.acknowledged == 1, "every loop has met the stop before the reset");
      require(l.cycle(s.granted) != was_reset, "and moves only by it");
    }
  }
};

// A second source stops while the first stop is being acknowledged: the number goes up, so what the loop
// answered to the first is not taken for an answer to the second.
struct second_source {
  service s;
  loop l;
  bool was_reset = false;

  second_source() { s.renew(far); }
  std::array<actor, 2> actors() {
    return {{{"loop",
              [this] {
                for (int i = 0; i != 3; ++i)
                  require(l.cycle(s.granted) || l.own.tripped != 1, "no move between the two stops");
              }},
             {"service", [this] {
                s.stop();
                (void)s.acknowledged(l);
                s.stop_by_another();
                if (!s.acknowledged(l)) return;
                s.reset();
                was_reset = true;
              }}}};
  }
  void afterwards() {
    require(!was_reset || l.own.acknowledged == 2, "the answer to the second stop is what the reset needs");
    require(l.cycle(s.granted) != was_reset, "and the loop moves only by the reset");
  }
};

TEST(stop_permit, is_never_missed_and_a_reset_waits_for_the_loop) {
  expect_passes_in_every_interleaving<stops_and_resets>();
}

TEST(stop_permit, holds_a_loop_that_found_it_over_though_it_is_renewed_a_moment_later) {
  expect_passes_in_every_interleaving<renews_late>();
}

TEST(stop_permit, ends_by_itself_when_the_service_thread_dies) {
  expect_passes_in_every_interleaving<service_dies>();
}

TEST(stop_permit, is_given_again_only_when_every_loop_has_answered) { expect_passes<two_loops>(); }

TEST(stop_permit, needs_an_answer_to_the_newest_stop) {
  expect_passes_in_every_interleaving<second_source>();
}

TEST(stop_permit, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<stops_and_resets>("stops_and_resets"),
                             scenario<renews_late>("renews_late"), scenario<service_dies>("service_dies"),
                             scenario<second_source>("second_source")};
  EXPECT_EQ((mutation_test{"rowe/detail/stop_permit.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace stop_permit_test
} // namespace rowe::model
