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
// what passes here is right on every compiler's mapping.
//
// The one thing: an operation is executed after everything sequenced before it and after the store it reads,
// so no load feeds a store from which it gets its own value (load buffering, which C++ and ARM allow). A
// structure is not touched by that if every load that another thread can feed acquires and every store that
// feeds it releases: each step of such a circle would then be happens-before, which has none. rowe's
// structures are of that kind, as they stand. An order that mutation.hpp finds stronger than needed is so
// within this model only.
//
// tests/model/axiomatic_test.cpp compares the outcomes of random programs with the axioms of the standard.
//
// What it cannot do: compare-exchange, fences, waiting on an atomic (the policy has none), more than four
// actors, runs of more than 128 operations, and anything that depends on time.
#pragma once
#include <array>
#include <cassert>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/choices.hpp"
#include "model/fiber.hpp"
#include "model/memory.hpp"
#include "model/scenario.hpp"
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

  // For the policy below and the primitives beside it: the explorer whose run this is.
  static explorer& active() noexcept { return *active_; }
  static bool is_active() noexcept { return active_ != nullptr; }

  std::size_t make_word(std::uint64_t value) { return memory_.make_word(running_, value); }
  std::size_t make_plain(const site& where) { return memory_.make_plain(running_, where); }
  std::uint64_t load(std::size_t word, order asked, const site& where);
  void store(std::size_t word, std::uint64_t value, order asked, const site& where);
  std::uint64_t exchange(std::size_t word, std::uint64_t value, order asked, const site& where);
  void read_plain(std::size_t datum, const site& where);
  void write_plain(std::size_t datum, const site& where);

  // The schedule may change here.
  void point();
  // For models of kernel objects: between the two nobody else runs, and what is done orders memory as the
  // lock that the kernel holds meanwhile.
  void enter_kernel(const void* object);
  void leave_kernel(const void* object);
  // The running actor waits until somebody wakes the waiters of `object`; with `in_time_only` it may also
  // give up at any moment, and the answer is false. The wait has begun when nothing else can have run since
  // leave_kernel().
  bool wait_for(const void* object, bool in_time_only = false);
  void wake(const void* object);
  // True at most `early_returns_max` times a run: a wait is to end for no reason.
  bool returns_early();
  void note(const std::string& line);
  bool tracing() const noexcept { return tracing_; }

  // Ends the run as failed; what the caller has on its stack is forgotten. Returns only in set-up, where
  // there is no fiber to leave.
  void fail(const char* why) {
    record(why);
    leave();
  }

  void fail_assertion(const char* assertion, const char* file, unsigned line) {
    record("assertion: " + std::string{assertion} + " at " + text_of(site{file, "", line, 0}));
    leave();
  }

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
  void look_afterwards(std::function<void()> look);
  static void play();
  static void look();
  // The two halves of a failure, apart so that no string is alive on a stack that is left for good.
  void record(const std::string& why);
  void leave();
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
  fiber looker_;
  std::function<void()> look_;
  bool looking_ = false;
  std::size_t running_ = outside;
  std::size_t preemptions_ = 0;
  std::size_t steps_ = 0;
  std::size_t early_returns_ = 0;
  bool indivisible_ = false;
  bool just_picked_ = false;
  std::map<const void*, knowledge> locks_; // what each kernel object's lock hands on
  bool failed_ = false;
  bool tracing_ = false;
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
  if (!holds) explorer::active().fail(otherwise);
}

template <class Make>
report explorer::explore(Make make) {
  do {
    run(make);
    ++report_.runs;
    if (!failed_ && !options_.seed && report_.runs > options_.runs_max) {
      record("more than " + std::to_string(options_.runs_max) +
             " runs: the scenario is too large to explore whole");
    }
    if (choices_.diverged()) record("the scenario depends on something other than its choices");
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
  preemptions_ = steps_ = actor_count_ = early_returns_ = 0;
  indivisible_ = false;
  locks_.clear();
  tracing_ = options_.replay.has_value();
  {
    auto scenario = make();
    for (actor& a : scenario.actors()) {
      thread& t = threads_[++actor_count_];
      t.plays = std::move(a);
      t.is = state::ready;
      t.awaits = nullptr;
      t.body.start_at(&explorer::play);
    }
    run_actors();
    if constexpr (requires { scenario.afterwards(); }) {
      if (!failed_) look_afterwards([&scenario] { scenario.afterwards(); });
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

// On a stack of its own, so that what fails here ends here too.
inline void explorer::look_afterwards(std::function<void()> look) {
  look_ = std::move(look);
  looker_.start_at(&explorer::look);
  looking_ = true;
  fiber::change(threads_[outside].body, looker_);
  looking_ = false;
}

inline void explorer::look() {
  active_->look_();
  fiber::change(active_->looker_, active_->threads_[outside].body, true);
}

inline void explorer::play() {
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
  if (++steps_ > steps_max / (running_ == outside ? 1 : 2)) {
    fail("more operations than a run may have: it does not end");
  }
  if (running_ == outside || indivisible_) return;
  if (std::exchange(just_picked_, false)) return; // whoever else could go now could have been picked instead
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
  just_picked_ = false; // back again, and about to do what this point stands before
}

inline void explorer::change_to(std::size_t next, bool for_good) {
  if (next == running_) return; // it gave up a wait with a deadline, and nobody else was picked
  fiber& from = threads_[running_].body;
  running_ = next;
  just_picked_ = true;
  fiber::change(from, threads_[next].body, for_good);
}

inline void explorer::enter_kernel(const void* object) {
  point();
  memory_.acquire_from(running_, locks_[object]);
  indivisible_ = true;
}

inline void explorer::leave_kernel(const void* object) {
  indivisible_ = false;
  memory_.release_into(running_, locks_[object]);
}

inline bool explorer::wait_for(const void* object, bool in_time_only) {
  thread& self = threads_[running_];
  self.is = in_time_only ? state::ready : state::waiting; // one that may give up may go on whenever it likes
  self.awaits = object;
  give_up_turn();
  return std::exchange(self.awaits, nullptr) == nullptr;
}

inline void explorer::wake(const void* object) {
  for (thread& t : threads_) {
    if (t.awaits != object) continue;
    t.awaits = nullptr;
    t.is = state::ready;
  }
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

inline void explorer::leave() {
  fiber& home = threads_[outside].body;
  if (looking_) fiber::change(looker_, home, true);
  if (running_ != outside) change_to(outside, true);
}

inline void explorer::note(const std::string& line) {
  if (tracing_) report_.trace += "  " + actor_name(running_) + ": " + line + "\n";
}

// The order the access is to have in this exploration; remembers that it was executed.
inline order explorer::settle(const use& u) {
  if ((u.what == operation::load && (u.asks == order::release || u.asks == order::acq_rel)) ||
      (u.what == operation::store && acquires(u.asks) && u.asks != order::seq_cst)) {
    record(std::string{"no "} + name_of(u.what) + " can be " + name_of(u.asks) + ": " + text_of(u.where));
    leave();
  }
  std::vector<use>& uses = report_.uses;
  if (std::find(uses.begin(), uses.end(), u) == uses.end()) uses.push_back(u);
  return options_.weaken && options_.weaken->of == u ? options_.weaken->to : u.asks;
}

inline void explorer::require_known(std::size_t word, const site& where) {
  if (memory_.knows_word(running_, word)) return;
  record("a word is used before it is made: " + text_of(where));
  leave();
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
  record("race: " + actor_name(running_) + " (" + what + " at " + text_of(where) + ") and " +
         actor_name(earlier->when.thread) + " (" + (earlier->writes ? "write" : "read") + " at " +
         text_of(earlier->where) + ")");
  leave();
}

} // namespace rowe::model

#if defined(__GLIBC__) && !defined(NDEBUG)
// What a failed assert() calls: an assertion of the code explored ends the run as any failure does, with its
// schedule.
extern "C" [[gnu::weak]] void __assert_fail(const char* assertion, const char* file, unsigned line,
                                            const char* function) noexcept {
  if (rowe::model::explorer::is_active())
    rowe::model::explorer::active().fail_assertion(assertion, file, line);
  std::fprintf(stderr, "%s:%u: %s: assertion `%s' failed\n", file, line, function, assertion);
  std::abort();
}
#endif
