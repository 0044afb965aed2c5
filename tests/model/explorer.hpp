// SPDX-License-Identifier: Apache-2.0
// The explorer: runs code written against the atomics policy (rowe/rt/atomics.hpp) under every interleaving
// within a bound, and every value that a weakly ordered machine may return, so that a missing release shows
// up on any host and not only on the one ARM board in a thousand hours. Tests only; everything runs on the
// calling thread.
//
// What is explored. A scenario's actors are fibers; before each operation on a shared word the schedule may
// change threads, at most `preemptions_max` times a run (default 3) where the running actor could go on;
// changes where it waits or ends are free. Each load chooses among the stores that coherence allows it, each
// store its place in the modification order. Accesses to plain data are no points of choice: their order
// against everything is decided by happens-before, or they race, and vector clocks report a race whichever
// came first.
//
// What the memory is. C++20's, exactly, but for one thing. Release and acquire with C++20's release sequences
// (a relaxed store of the same thread does not continue one, as it did in C++11: the weaker reading).
// Modification order is chosen, not the order of execution, so 2+2W is seen. Seq_cst is C++20's total order
// S, kept as a partial order: S agrees with "strongly happens before" and with coherence order between
// seq_cst operations of one word, and with nothing else. It is weaker than a global clock that every seq_cst
// operation reads and updates, and weaker than C++11 where seq_cst and weaker operations meet on a word; so
// what passes here is right on every compiler's mapping. The one thing: an operation is executed after
// everything sequenced before it and after the store it reads, so a relaxed load never feeds a store that
// feeds the load (load buffering, "out of thin air"). ARM may reorder a load with a later independent store;
// code that lets a *relaxed* load's thread store something from which that same load could learn is outside
// the model. rowe's structures never do: a relaxed load reads a word of which its own thread is the only
// writer. tests/model/axiomatic_test.cpp compares all outcomes of random programs with the axioms.
//
// What it cannot do: compare-exchange, fences, waiting on an atomic (the policy has none), more than four
// actors, runs of more than 256 operations, and anything that depends on time.
#pragma once
#include <array>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/choices.hpp"
#include "model/fiber.hpp"
#include "model/memory.hpp"
#include "model/site.hpp"

namespace rowe::model {

// One thread of a scenario. A scenario is a type whose constructor sets up, `actors()` returns an array of
// these, and `afterwards()`, if there is one, looks at the end when all actors have ended. It is made anew
// for each run. Actors keep nothing on their stacks that owns memory, and depend on nothing but shared words.
struct actor {
  const char* name;
  std::function<void()> act;
};

enum class operation : std::uint8_t { load, store, exchange };

// An atomic access in the source, with the order it asks for.
struct use {
  site where;
  operation what;
  order asks;
  friend bool operator==(const use&, const use&) noexcept = default;
};

// Replaces the order of one access by a weaker one.
struct weakening {
  use of;
  order to;
};

struct options {
  std::size_t preemptions_max = 3;
  // Exhaustively: exploring more runs than this is a failure, never a silent end. At random: so many runs.
  std::uint64_t runs_max = 4'000'000;
  std::optional<std::uint64_t> seed{};  // random rows of choices instead of all
  std::optional<choices::row> replay{}; // one run only: the choices a failure has printed
  std::optional<weakening> weaken{};
};

struct report {
  bool passed = true;
  std::uint64_t runs = 0;
  std::string failure;   // what was violated
  choices::row row;      // the choices that led there, for options::replay
  std::string trace;     // every operation of that run
  std::vector<use> uses; // every atomic access that was executed, in any run

  std::string text() const {
    if (passed) return "passed in " + std::to_string(runs) + " runs";
    return failure + "\nin run " + std::to_string(runs) + ", choices " + text_of(row) + "\n" + trace;
  }
};

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

  // For the policy below and the primitives beside it: the explorer whose run this is.
  static explorer& active() noexcept { return *active_; }

  std::size_t make_word(std::uint64_t value) { return memory_.make_word(running_, value); }
  std::size_t make_plain(const site& where) { return memory_.make_plain(running_, where); }
  std::uint64_t load(std::size_t word, order asked, const site& where);
  void store(std::size_t word, std::uint64_t value, order asked, const site& where);
  std::uint64_t exchange(std::size_t word, std::uint64_t value, order asked, const site& where);
  void read_plain(std::size_t datum, const site& where);
  void write_plain(std::size_t datum, const site& where);

  // The schedule may change here.
  void point();
  // The running actor waits until somebody wakes the waiters of `what`.
  void block_on(const void* what);
  void wake(const void* what);
  memory& words() noexcept { return memory_; }
  std::size_t running() const noexcept { return running_; }
  void note(const std::string& line);
  bool tracing() const noexcept { return tracing_; }

  // Ends the run as failed. Returns only in set-up and afterwards, where there is no fiber to leave.
  void fail(const std::string& why);

 private:
  static constexpr std::size_t outside = 0; // the thread that sets up and looks afterwards

  enum class state : std::uint8_t { ready, waiting, ended };
  struct thread {
    actor plays;
    state is = state::ended;
    const void* awaits = nullptr;
    fiber body;
  };

  template <class Make>
  void run(Make& make);
  void run_actors();
  static void enter();
  void give_up_turn();
  void change_to(std::size_t next, bool for_good = false);
  order settle(const use& u);
  void require_known(std::size_t word, const site& where);
  void race(const access* earlier, const char* what, const site& where);
  std::string actor_name(std::size_t t) const { return t == outside ? "set-up" : threads_[t].plays.name; }

  static inline explorer* active_ = nullptr;

  options options_;
  choices choices_;
  memory memory_{choices_};
  std::array<thread, threads_max> threads_;
  std::size_t actor_count_ = 0;
  std::size_t running_ = outside;
  std::size_t preemptions_ = 0;
  std::size_t steps_ = 0;
  bool failed_ = false;
  bool tracing_ = false;
  report report_;
};

// Explores Scenario with these options.
template <class Scenario>
report explore(const options& o = {}) {
  return explorer{o}.explore([] { return Scenario{}; });
}
template <class Make>
report explore(const options& o, Make make) {
  return explorer{o}.explore(std::move(make));
}

// What must hold, in an actor or afterwards; `otherwise` is the sentence that a failure prints.
inline void require(bool holds, const char* otherwise) {
  if (!holds) explorer::active().fail(otherwise);
}

// ---- what follows is how
// -------------------------------------------------------------------------------------

inline const char* name_of(order o) noexcept {
  switch (o) {
  case order::relaxed: return "relaxed";
  case order::acquire: return "acquire";
  case order::release: return "release";
  case order::acq_rel: return "acq_rel";
  case order::seq_cst: return "seq_cst";
  default: return "consume";
  }
}

inline const char* name_of(operation o) noexcept {
  return o == operation::load ? "load" : o == operation::store ? "store" : "exchange";
}

template <class Make>
report explorer::explore(Make make) {
  do {
    run(make);
    ++report_.runs;
    if (!failed_ && !options_.seed && report_.runs > options_.runs_max) {
      fail("more than " + std::to_string(options_.runs_max) +
           " runs: the scenario is too large to explore whole");
    }
    if (choices_.diverged()) fail("the scenario depends on something other than its choices");
    if (failed_) {
      report_.row = choices_.taken();
      if (tracing_ || options_.replay) return report_;
      break;
    }
    if (options_.seed && report_.runs >= options_.runs_max) return report_;
  } while (choices_.next_run());
  if (!failed_) return report_;

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
  memory_.clear();
  running_ = outside;
  preemptions_ = steps_ = actor_count_ = 0;
  tracing_ = options_.replay.has_value();
  {
    auto scenario = make();
    for (actor& a : scenario.actors()) {
      thread& t = threads_[++actor_count_];
      t.plays = std::move(a);
      t.is = state::ready;
      t.body.start_at(&explorer::enter);
    }
    run_actors();
    if constexpr (requires { scenario.afterwards(); }) {
      if (!failed_) scenario.afterwards();
    }
  }
  active_ = outer;
}

inline void explorer::run_actors() {
  for (std::size_t t = 1; t <= actor_count_; ++t) memory_.fork(outside, t);
  if (actor_count_ != 0) give_up_turn();
  if (failed_) return;
  for (std::size_t t = 1; t <= actor_count_; ++t) memory_.join(outside, t);
}

inline void explorer::enter() {
  explorer& e = *active_;
  thread& self = e.threads_[e.running_];
  self.plays.act();
  self.is = state::ended;
  e.give_up_turn();
}

// The running actor cannot go on, or none runs yet: one that is ready does, or the run is over.
inline void explorer::give_up_turn() {
  std::array<std::size_t, threads_max> ready;
  std::size_t count = 0;
  bool somebody_waits = false;
  for (std::size_t t = 1; t <= actor_count_; ++t) {
    if (threads_[t].is == state::ready) ready[count++] = t;
    if (threads_[t].is == state::waiting) somebody_waits = true;
  }
  if (count != 0) {
    change_to(ready[choices_.pick(count)], threads_[running_].is == state::ended && running_ != outside);
  } else if (somebody_waits) {
    fail("everybody left waits: a wake-up was lost");
  } else {
    change_to(outside, true);
  }
}

inline void explorer::point() {
  if (++steps_ > steps_max / 2) {
    // Half of what memory can hold: the other half is afterwards', whose failures cannot leave it.
    if (running_ != outside || steps_ > steps_max)
      fail("more operations than a run may have: it does not end");
  }
  if (running_ == outside) return;
  std::array<std::size_t, threads_max> ready;
  std::size_t count = 0;
  ready[count++] = running_;
  for (std::size_t t = 1; preemptions_ != options_.preemptions_max && t <= actor_count_; ++t) {
    if (t != running_ && threads_[t].is == state::ready) ready[count++] = t;
  }
  const std::size_t next = ready[choices_.pick(count)];
  if (next == running_) return;
  ++preemptions_;
  change_to(next);
}

inline void explorer::change_to(std::size_t next, bool for_good) {
  fiber& from = threads_[running_].body;
  running_ = next;
  fiber::change(from, threads_[next].body, for_good);
}

inline void explorer::block_on(const void* what) {
  threads_[running_].is = state::waiting;
  threads_[running_].awaits = what;
  give_up_turn();
}

inline void explorer::wake(const void* what) {
  for (thread& t : threads_) {
    if (t.is == state::waiting && t.awaits == what) t.is = state::ready;
  }
}

inline void explorer::fail(const std::string& why) {
  if (!failed_) {
    failed_ = true;
    report_.passed = false;
    report_.failure = why;
    note(why);
  }
  if (running_ != outside) change_to(outside, true);
}

inline void explorer::note(const std::string& line) {
  if (tracing_) report_.trace += "  " + actor_name(running_) + ": " + line + "\n";
}

// The order the access is to have in this exploration; remembers that it was executed.
inline order explorer::settle(const use& u) {
  if ((u.what == operation::load && (u.asks == order::release || u.asks == order::acq_rel)) ||
      (u.what == operation::store && acquires(u.asks) && u.asks != order::seq_cst)) {
    fail(std::string{"no "} + name_of(u.what) + " can be " + name_of(u.asks) + ": " + text_of(u.where));
  }
  std::vector<use>& uses = report_.uses;
  if (std::find(uses.begin(), uses.end(), u) == uses.end()) uses.push_back(u);
  return options_.weaken && options_.weaken->of == u ? options_.weaken->to : u.asks;
}

inline void explorer::require_known(std::size_t word, const site& where) {
  if (!memory_.knows_word(running_, word)) fail("a word is used before it is made: " + text_of(where));
}

inline std::uint64_t explorer::load(std::size_t word, order asked, const site& where) {
  const order o = settle({where, operation::load, asked});
  point();
  require_known(word, where);
  const std::uint64_t value = memory_.load(running_, word, o);
  if (tracing_) {
    const std::size_t newer = memory_.newer_stores();
    note("load word " + std::to_string(word) + " " + name_of(o) + " = " + std::to_string(value) +
         (newer != 0 ? ", older than " + std::to_string(newer) + " stores" : "") + " at " + text_of(where));
  }
  return value;
}

inline void explorer::store(std::size_t word, std::uint64_t value, order asked, const site& where) {
  const order o = settle({where, operation::store, asked});
  point();
  require_known(word, where);
  memory_.store(running_, word, value, o);
  if (tracing_) {
    const std::size_t newer = memory_.newer_stores();
    note("store word " + std::to_string(word) + " " + name_of(o) + " := " + std::to_string(value) +
         (newer != 0 ? ", behind " + std::to_string(newer) + " stores" : "") + " at " + text_of(where));
  }
}

inline std::uint64_t explorer::exchange(std::size_t word, std::uint64_t value, order asked,
                                        const site& where) {
  const order o = settle({where, operation::exchange, asked});
  point();
  require_known(word, where);
  const std::uint64_t before = memory_.exchange(running_, word, value, o);
  if (tracing_) {
    note("exchange word " + std::to_string(word) + " " + name_of(o) + " := " + std::to_string(value) +
         ", was " + std::to_string(before) + " at " + text_of(where));
  }
  return before;
}

inline void explorer::read_plain(std::size_t datum, const site& where) {
  if (tracing_) note("read datum " + std::to_string(datum) + " at " + text_of(where));
  race(memory_.read_plain(running_, datum, where), "read", where);
}

inline void explorer::write_plain(std::size_t datum, const site& where) {
  if (tracing_) note("write datum " + std::to_string(datum) + " at " + text_of(where));
  race(memory_.write_plain(running_, datum, where), "write", where);
}

inline void explorer::race(const access* earlier, const char* what, const site& where) {
  if (earlier == nullptr) return;
  fail("race: " + actor_name(running_) + " (" + what + " at " + text_of(where) + ") and " +
       actor_name(earlier->when.thread) + " (" + (earlier->writes ? "write" : "read") + " at " +
       text_of(earlier->where) + ")");
}

} // namespace rowe::model
