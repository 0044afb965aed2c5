// SPDX-License-Identifier: Apache-2.0
// The explorer itself: that it finds what is broken, says what it found so that it can be run again, and
// never ends in silence before it has seen everything.
#include <gtest/gtest.h>

#include <array>
#include <cassert>
#include <optional>
#include <string>

#include "model/atomics.hpp"
#include "model/hand_over.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace explorer_test {
namespace {

using std::string;

bool contains(const string& text, const string& piece) { return text.find(piece) != string::npos; }

// A datum and the flag that says it is there.
template <order Store, order Load>
struct passes_a_datum {
  atomics::plain<int> datum;
  atomics::variable<bool> given;

  std::array<actor, 2> actors() {
    return {{{"giver",
              [this] {
                datum.store(7);
                given.store(true, Store);
              }},
             {"taker", [this] {
                if (given.load(Load)) require(datum.load() == 7, "the datum is there when the flag is");
              }}}};
  }
};

TEST(explorer, passes_a_datum_handed_over_by_release_and_acquire) {
  const report r = explore<passes_a_datum<order::release, order::acquire>>();
  EXPECT_TRUE(r.passed) << r.text();
}

TEST(explorer, reports_a_race_and_names_both_accesses) {
  const report r = explore<passes_a_datum<order::relaxed, order::acquire>>();
  ASSERT_FALSE(r.passed);
  EXPECT_TRUE(contains(r.failure, "race: taker (read at explorer_test.cpp:")) << r.failure;
  EXPECT_TRUE(contains(r.failure, "and giver (write at explorer_test.cpp:")) << r.failure;
}

TEST(explorer, reports_a_race_of_two_writes_that_no_flag_joins) {
  struct two_writes {
    atomics::plain<int> datum;
    std::array<actor, 2> actors() {
      return {{{"one", [this] { datum.store(1); }}, {"other", [this] { datum.store(2); }}}};
    }
  };
  const report r = explore<two_writes>();
  EXPECT_TRUE(contains(r.failure, "race: ")) << r.text();
}

TEST(explorer, reports_a_write_that_may_overtake_a_read_done_before_it) {
  // The reader stores that it has read; the writer's load is relaxed, so it may write too early.
  struct overtakes {
    atomics::plain<int> datum;
    atomics::variable<bool> read;
    std::array<actor, 2> actors() {
      return {{{"reader",
                [this] {
                  (void)datum.load();
                  read.store(true, order::release);
                }},
               {"writer", [this] {
                  if (read.load(order::relaxed)) datum.store(1);
                }}}};
    }
  };
  const report r = explore<overtakes>();
  EXPECT_TRUE(contains(r.failure, "race: writer")) << r.text();
}

TEST(explorer, reports_a_word_that_is_used_before_its_making_is_known) {
  struct makes_late {
    std::optional<atomics::variable<int>> word;
    std::array<actor, 2> actors() {
      return {{{"maker", [this] { word.emplace(1); }}, {"user", [this] {
                                                          if (word) (void)word->load(order::seq_cst);
                                                        }}}};
    }
  };
  const report r = explore<makes_late>();
  EXPECT_TRUE(contains(r.failure, "used before it is made")) << r.text();
}

#if defined(__GLIBC__) && !defined(NDEBUG)
TEST(explorer, reports_an_assertion_of_the_code_it_runs) {
  struct asserts {
    atomics::variable<int> word;
    std::array<actor, 2> actors() {
      return {{{"writer", [this] { word.store(1, order::relaxed); }},
               {"reader", [this] { assert(word.load(order::relaxed) == 0); }}}};
    }
  };
  const report r = explore<asserts>();
  EXPECT_TRUE(contains(r.failure, "assertion: word.load(order::relaxed) == 0 at explorer_test.cpp:"))
      << r.text();
}
#endif

TEST(explorer, replays_a_failure_from_its_choices_and_traces_it) {
  using broken = passes_a_datum<order::release, order::relaxed>;
  const report found = explore<broken>();
  ASSERT_FALSE(found.passed);
  options again;
  again.replay = found.row;
  const report replayed = explore<broken>(again);
  EXPECT_EQ(replayed.runs, 1u);
  EXPECT_EQ(replayed.failure, found.failure);
  EXPECT_EQ(replayed.trace, found.trace);
  EXPECT_TRUE(contains(found.trace, "giver: store word 0 release := 1 at explorer_test.cpp:")) << found.trace;
}

TEST(explorer, finds_at_random_what_it_finds_exhaustively_and_the_same_for_the_same_seed) {
  using broken = passes_a_datum<order::relaxed, order::relaxed>;
  options random;
  random.seed = 12345;
  random.runs_max = 1000;
  const report one = explore<broken>(random);
  const report other = explore<broken>(random);
  ASSERT_FALSE(one.passed);
  EXPECT_EQ(one.row, other.row);
  EXPECT_EQ(one.runs, other.runs);
  EXPECT_TRUE(contains(one.failure, "seed 12345")) << one.failure;
}

TEST(explorer, ends_random_exploration_after_the_runs_it_was_given) {
  options random;
  random.seed = 1;
  random.runs_max = 500;
  EXPECT_EQ((explore<passes_a_datum<order::release, order::acquire>>(random).runs), 500u);
}

// One thread asks and looks for the answer, once; the other looks for the question, once. They meet only if
// the first is interrupted between the two.
struct asks_and_answers {
  atomics::variable<bool> asked;
  atomics::variable<bool> answered;
  bool met = false;
  std::array<actor, 2> actors() {
    return {{{"asker",
              [this] {
                asked.store(true, order::release);
                met = answered.load(order::acquire);
              }},
             {"answerer", [this] {
                if (asked.load(order::acquire)) answered.store(true, order::release);
              }}}};
  }
  void afterwards() { require(!met, "they do not meet"); }
};

TEST(explorer, changes_threads_as_often_as_it_may_and_no_oftener) {
  options bounded;
  bounded.preemptions_max = 0;
  EXPECT_TRUE(explore<asks_and_answers>(bounded).passed);
  bounded.preemptions_max = 1;
  EXPECT_FALSE(explore<asks_and_answers>(bounded).passed);
}

TEST(explorer, fails_when_it_cannot_explore_everything) {
  options few;
  few.runs_max = 2;
  const report r = explore<passes_a_datum<order::release, order::acquire>>(few);
  EXPECT_TRUE(contains(r.failure, "too large to explore whole")) << r.text();
}

TEST(explorer, fails_when_an_actor_never_ends) {
  struct spins {
    atomics::variable<bool> flag;
    std::array<actor, 1> actors() {
      return {{{"spinner", [this] {
                  while (!flag.load(order::acquire)) {
                  }
                }}}};
    }
  };
  const report r = explore<spins>();
  EXPECT_TRUE(contains(r.failure, "does not end")) << r.text();
}

TEST(explorer, fails_when_a_scenario_depends_on_more_than_its_choices) {
  static int runs = 0;
  struct remembers {
    atomics::variable<int> word;
    std::array<actor, 2> actors() {
      return {{{"one",
                [this] {
                  if (++runs % 2 == 0) word.store(1, order::relaxed);
                  word.store(2, order::relaxed);
                }},
               {"other", [this] { word.store(3, order::relaxed); }}}};
    }
  };
  const report r = explore<remembers>();
  EXPECT_TRUE(contains(r.failure, "depends on something other than its choices")) << r.text();
}

TEST(explorer, refuses_orders_that_an_operation_cannot_have) {
  struct releases_a_load {
    atomics::variable<int> word;
    std::array<actor, 1> actors() {
      return {{{"one", [this] { (void)word.load(order::release); }}}};
    }
  };
  struct acquires_a_store {
    atomics::variable<int> word;
    std::array<actor, 1> actors() {
      return {{{"one", [this] { word.store(1, order::acq_rel); }}}};
    }
  };
  EXPECT_TRUE(contains(explore<releases_a_load>().failure, "no load can be release"));
  EXPECT_TRUE(contains(explore<acquires_a_store>().failure, "no store can be acq_rel"));
}

TEST(explorer, refuses_more_actors_than_it_has_room_for) {
  struct crowd {
    std::array<actor, threads_max> actors() { return {}; }
  };
  EXPECT_TRUE(contains(explore<crowd>().failure, "more actors"));
}

// How a sleeper is woken by two words: each side stores its own and then loads the other's.
template <order StoreData, order LoadAsleep, order StoreAsleep, order LoadData>
struct sleeps_and_wakes {
  atomics::variable<int> data;
  atomics::variable<bool> asleep;
  event_fd wakes;

  std::array<actor, 2> actors() {
    return {{{"publisher",
              [this] {
                data.store(1, StoreData);
                if (asleep.load(LoadAsleep)) wakes.signal();
              }},
             {"sleeper", [this] {
                if (data.load(order::acquire) != 0) return;
                asleep.store(true, StoreAsleep);
                if (data.load(LoadData) == 0) wakes.wait();
                require(data.load(order::acquire) == 1, "who is woken finds the data");
              }}}};
  }
};

TEST(explorer, finds_the_lost_wake_up_unless_all_four_accesses_are_seq_cst) {
  constexpr order sc = order::seq_cst;
  const report right = explore<sleeps_and_wakes<sc, sc, sc, sc>>();
  EXPECT_TRUE(right.passed) << right.text();
  for (const report& r : {explore<sleeps_and_wakes<order::release, sc, sc, sc>>(),
                          explore<sleeps_and_wakes<sc, order::acquire, sc, sc>>(),
                          explore<sleeps_and_wakes<sc, sc, order::release, sc>>(),
                          explore<sleeps_and_wakes<sc, sc, sc, order::acquire>>()}) {
    EXPECT_TRUE(contains(r.failure, "a wake-up was lost")) << r.text();
  }
}

TEST(explorer, ends_a_wait_in_the_kernel_early_when_late_and_when_woken) {
  struct waits {
    bool& woken;
    bool& late;
    futex::word word{0};
    std::array<actor, 2> actors() {
      return {{{"sleeper",
                [this] {
                  const bool in_time = futex::wait(word, 0, rt::time_point{});
                  (in_time ? woken : late) = true;
                }},
               {"waker", [this] {
                  word.store(1, order::release);
                  futex::wake(word);
                }}}};
    }
  };
  bool woken = false;
  bool late = false;
  const report r = explore(options{}, [&] { return waits{woken, late}; });
  EXPECT_TRUE(r.passed) << r.text();
  EXPECT_TRUE(woken);
  EXPECT_TRUE(late);
}

struct hands_over {
  hand_over<atomics> box;
  std::array<actor, 2> actors() {
    return {{{"giver", [this] { box.give(7); }}, {"taker", [this] {
                                                    const int taken = box.take();
                                                    require(taken == 0 || taken == 7, "all of it or nothing");
                                                  }}}};
  }
};

TEST(mutation_test, finds_an_order_that_is_stronger_than_needed_and_an_access_without_a_scenario) {
  const std::array scenarios{scenario<hands_over>("hands_over")};
  const string findings = mutation_test{"model/hand_over.hpp", scenarios, {}}.findings();
  EXPECT_TRUE(contains(findings, "store seq_cst -> release")) << findings;
  EXPECT_TRUE(contains(findings, "no scenario reaches model/hand_over.hpp:")) << findings;
  EXPECT_FALSE(contains(findings, "acquire")) << findings; // its weakening is caught
}

TEST(mutation_test, accepts_a_listed_order_but_not_one_that_is_listed_without_need) {
  const std::array scenarios{scenario<hands_over>("hands_over")};
  const std::array listed{stronger_than_needed{"give", "given_.store", order::release, "release suffices"},
                          stronger_than_needed{"take", "given_.load", order::relaxed, "not so"}};
  const string findings = mutation_test{"model/hand_over.hpp", scenarios, listed}.findings();
  EXPECT_FALSE(contains(findings, "seq_cst")) << findings;
  EXPECT_TRUE(contains(findings, "listed without need: take")) << findings;
}

} // namespace
} // namespace explorer_test
} // namespace rowe::model
