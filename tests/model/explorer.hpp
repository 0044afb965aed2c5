// SPDX-License-Identifier: Apache-2.0
// The explorer: runs code written against the atomics policy (rowe/rt/atomics.hpp) under every interleaving
// within a bound, and every value that a weakly ordered machine may return, so that a missing release shows
// up on any host and not only on the one ARM board in a thousand hours. Tests only; everything runs on the
// calling thread.
//
// What is explored. A scenario's actors are fibers; before each operation on a shared word the schedule may
// change threads, at most `preemptions_max` times a run (default 3) where the running actor could go on;
// changes where it waits or ends are free. Each load chooses among the stores that coherence allows it, each
// store its place in the modification order. Accesses to plain data are no points of choice: they are ordered
// by happens-before against everything that conflicts with them, or they race, and vector clocks report a
// race whichever came first. A failing run prints its choices and every operation; options::replay runs the
// same choices again.
//
// What the memory is. C++20's, exactly, but for one thing. Release sequences are C++20's (a relaxed store of
// the same thread does not continue one, as it did in C++11: the weaker reading). Modification order is
// chosen and not the order of execution, so 2+2W is seen. Seq_cst is C++20's total order S, kept as a partial
// order: S agrees with "strongly happens before", with the coherence order between seq_cst operations of one
// word, and with nothing else. That is weaker than a global clock which every seq_cst operation reads and
// advances, and weaker than C++11 where seq_cst and weaker operations meet on a word. It is stronger than
// C++11 in one place, which all compilers keep (IRIW by seq_cst loads of words stored by release); nothing of
// rowe leans on it, since its words that need S are seq_cst throughout.
//
// The one thing: an operation is executed after everything sequenced before it and after the store it reads,
// so no load feeds a store from which it gets its own value (load buffering, which C++ and ARM allow). A
// structure is not touched by that if every load that another thread can feed acquires and every store that
// feeds it releases: each step of such a circle would then be happens-before, which has none. rowe's
// structures are of that kind, as they stand. An order that mutation.hpp finds stronger than needed is so
// within this model only.
//
// axiomatic_test.cpp compares the outcomes of random programs with the axioms of the standard, mutation.hpp
// weakens every order of a structure in turn.
//
// What it cannot do: compare-exchange, fences, waiting on an atomic (the policy has none), more than four
// actors, runs of more than 128 operations, and anything that depends on time.
#pragma once
#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "model/choices.hpp"
#include "model/memory.hpp"
#include "model/scenario.hpp"
#include "model/schedule.hpp"
#include "model/site.hpp"

namespace rowe::model {

class explorer {
 public:
  explicit explorer(const options& o)
      : options_{o},
        choices_{o.replay ? choices{*o.replay}
                 : o.seed ? choices{*o.seed}
                          : choices{}} {}
  explorer(const explorer&) = delete;
  explorer& operator=(const explorer&) = delete;

  // Runs what `make()` returns until every row of choices is taken, one fails, or runs_max is reached.
  template <class Make>
  report explore(Make make);

  // What follows is for the policy and the kernel objects of atomics.hpp: the explorer whose run this is, or
  // nullptr.
  static explorer* active() noexcept { return active_; }

  std::size_t make_word(std::uint64_t value) { return memory_.make_word(schedule_.running(), value); }
  std::size_t make_plain(const site& where) { return memory_.make_plain(schedule_.running(), where); }
  std::uint64_t load(std::size_t word, order asked, const site& where);
  void store(std::size_t word, std::uint64_t value, order asked, const site& where);
  // Writes `value`, or adds it to what is there.
  std::uint64_t exchange(std::size_t word, std::uint64_t value, order asked, const site& where,
                         bool adds = false);
  void read_plain(std::size_t datum, const site& where);
  void write_plain(std::size_t datum, const site& where);

  // Between the two nobody else runs, and what is done orders memory as the lock that the kernel holds
  // meanwhile.
  void enter_kernel(const void* object);
  void leave_kernel(const void* object);
  // As in schedule.hpp. A wait directly after leave_kernel() begins before anybody else runs.
  bool wait_for(const void* object, bool may_give_up = false) {
    return schedule_.wait_for(object, may_give_up);
  }
  void wake(const void* object) { schedule_.wake(object); }
  // True at most `early_returns_max` times a run: a wait is to end for no reason.
  bool returns_early();
  // A line of the trace.
  void note(const std::string& line);

  // Ends the run as failed; what the caller has on its stack is forgotten. Returns only in set-up.
  void fail(const char* why) {
    record(why);
    schedule_.leave();
  }
  void fail_assertion(const char* assertion, const char* file, unsigned line) {
    record("assertion: " + std::string{assertion} + " at " + text_of(site{file, "", line, 0}));
    schedule_.leave();
  }

 private:
  template <class Make>
  void run(Make& make);
  void run_actors();
  // The first half of a failure; the second is schedule::leave(). Apart, so that no string is alive on a
  // stack that is left for good.
  void record(const std::string& why);
  order decide(const use& u);
  void require_known(std::size_t word, const site& where);
  void race(const access* earlier, const char* what, const site& where);

  static inline explorer* active_ = nullptr;

  options options_;
  choices choices_;
  memory memory_{choices_};
  schedule schedule_{choices_, options_.preemptions_max, [this](const char* why) { fail(why); }};
  std::map<const void*, knowledge> locks_; // what each kernel object's lock hands on
  std::size_t early_returns_ = 0;
  bool failed_ = false;
  report report_;
};

// Explores Scenario with these options.
template <class Scenario>
report explore(const options& o = {}) {
  return explorer{o}.explore([] { return Scenario(); });
}
template <class Make>
report explore(const options& o, Make make) {
  return explorer{o}.explore(std::move(make));
}

// What must hold, in an actor or afterwards; `otherwise` is the sentence that a failure prints.
inline void require(bool holds, const char* otherwise) {
  if (!holds) explorer::active()->fail(otherwise);
}

template <class Make>
report explorer::explore(Make make) {
  do {
    run(make);
    ++report_.runs;
    if (!options_.seed && report_.runs > options_.runs_max) {
      record("more than " + std::to_string(options_.runs_max) +
             " runs: the scenario is too large to explore whole");
    }
    if (choices_.diverged()) record("the scenario depends on something other than its choices");
    if (failed_) break;
    if (options_.seed && report_.runs >= options_.runs_max) break;
  } while (choices_.next_run());
  if (!failed_) return report_;
  report_.row = choices_.taken();
  if (options_.replay) return report_;

  // The same run once more, writing down what happens.
  options again = options_;
  again.seed.reset();
  again.replay = report_.row;
  report_.trace = explorer{again}.explore(make).trace;
  if (options_.seed) report_.failure += " (seed " + std::to_string(*options_.seed) + ")";
  return report_;
}

template <class Make>
void explorer::run(Make& make) {
  explorer* const outer = std::exchange(active_, this);
  schedule_.clear();
  memory_.clear();
  locks_.clear();
  early_returns_ = 0;
  {
    auto scenario = make();
    for (actor& a : scenario.actors()) {
      if (!schedule_.add(std::move(a))) record("more actors than the explorer has room for");
    }
    if (!failed_) run_actors();
    if constexpr (requires { scenario.afterwards(); }) {
      if (!failed_) schedule_.run_afterwards([&scenario] { scenario.afterwards(); });
    }
  }
  active_ = outer;
}

inline void explorer::run_actors() {
  for (std::size_t t = 1; t <= schedule_.actors(); ++t) memory_.fork(schedule::outside, t);
  schedule_.run_actors();
  if (failed_) return;
  for (std::size_t t = 1; t <= schedule_.actors(); ++t) memory_.join(schedule::outside, t);
}

inline void explorer::enter_kernel(const void* object) {
  schedule_.point();
  memory_.acquire_from(schedule_.running(), locks_[object]);
  schedule_.begin_indivisible();
}

inline void explorer::leave_kernel(const void* object) {
  schedule_.end_indivisible();
  memory_.release_into(schedule_.running(), locks_[object]);
}

inline bool explorer::returns_early() {
  if (early_returns_ == options_.early_returns_max || choices_.pick(2) == 0) return false;
  ++early_returns_;
  return true;
}

inline void explorer::record(const std::string& why) {
  if (failed_) return;
  failed_ = true;
  report_.passed = false;
  report_.failure = why;
  note(why);
}

inline void explorer::note(const std::string& line) {
  if (options_.replay)
    report_.trace += std::string{"  "} + schedule_.name_of(schedule_.running()) + ": " + line + "\n";
}

// The order the access is to have in this exploration; remembers that it was executed.
inline order explorer::decide(const use& u) {
  if ((u.what == operation::load && (u.asks == order::release || u.asks == order::acq_rel)) ||
      (u.what == operation::store && acquires(u.asks) && u.asks != order::seq_cst)) {
    record(std::string{"no "} + name_of(u.what) + " can be " + name_of(u.asks) + ": " + text_of(u.where));
    schedule_.leave();
  }
  std::vector<use>& uses = report_.uses;
  if (std::find(uses.begin(), uses.end(), u) == uses.end()) uses.push_back(u);
  return options_.weaken && options_.weaken->of == u ? options_.weaken->to : u.asks;
}

inline void explorer::require_known(std::size_t word, const site& where) {
  if (memory_.knows_word(schedule_.running(), word)) return;
  record("a word is used before it is made: " + text_of(where));
  schedule_.leave();
}

inline std::uint64_t explorer::load(std::size_t word, order asked, const site& where) {
  const order o = decide({where, operation::load, asked});
  schedule_.point();
  require_known(word, where);
  const std::uint64_t value = memory_.load(schedule_.running(), word, o);
  if (options_.replay) {
    const std::size_t newer = memory_.newer_stores();
    note("load word " + std::to_string(word) + " " + name_of(o) + " = " + std::to_string(value) +
         (newer != 0 ? ", older than " + std::to_string(newer) + " stores" : "") + " at " + text_of(where));
  }
  return value;
}

inline void explorer::store(std::size_t word, std::uint64_t value, order asked, const site& where) {
  const order o = decide({where, operation::store, asked});
  schedule_.point();
  require_known(word, where);
  memory_.store(schedule_.running(), word, value, o);
  if (options_.replay) {
    const std::size_t newer = memory_.newer_stores();
    note("store word " + std::to_string(word) + " " + name_of(o) + " := " + std::to_string(value) +
         (newer != 0 ? ", behind " + std::to_string(newer) + " stores" : "") + " at " + text_of(where));
  }
}

inline std::uint64_t explorer::exchange(std::size_t word, std::uint64_t value, order asked, const site& where,
                                        bool adds) {
  const order o = decide({where, operation::exchange, asked});
  schedule_.point();
  require_known(word, where);
  const std::uint64_t before = memory_.exchange(schedule_.running(), word, value, o, adds);
  if (options_.replay) {
    note("exchange word " + std::to_string(word) + " " + name_of(o) + (adds ? " += " : " := ") +
         std::to_string(value) + ", was " + std::to_string(before) + " at " + text_of(where));
  }
  return before;
}

inline void explorer::read_plain(std::size_t datum, const site& where) {
  if (options_.replay) note("read datum " + std::to_string(datum) + " at " + text_of(where));
  race(memory_.read_plain(schedule_.running(), datum, where), "read", where);
}

inline void explorer::write_plain(std::size_t datum, const site& where) {
  if (options_.replay) note("write datum " + std::to_string(datum) + " at " + text_of(where));
  race(memory_.write_plain(schedule_.running(), datum, where), "write", where);
}

inline void explorer::race(const access* earlier, const char* what, const site& where) {
  if (earlier == nullptr) return;
  record(std::string{"race: "} + schedule_.name_of(schedule_.running()) + " (" + what + " at " +
         text_of(where) + ") and " + schedule_.name_of(earlier->when.thread) + " (" +
         (earlier->writes ? "write" : "read") + " at " + text_of(earlier->where) + ")");
  schedule_.leave();
}

} // namespace rowe::model

#if defined(__GLIBC__) && !defined(NDEBUG)
// What a failed assert() calls: an assertion of the code explored ends the run as any failure does, with its
// schedule.
extern "C" [[gnu::weak]] void __assert_fail(const char* assertion, const char* file, unsigned line,
                                            const char* function) noexcept {
  if (rowe::model::explorer* const active = rowe::model::explorer::active()) {
    active->fail_assertion(assertion, file, line);
  }
  std::fprintf(stderr, "%s:%u: %s: assertion `%s' failed\n", file, line, function, assertion);
  std::abort();
}
#endif
