// SPDX-License-Identifier: Apache-2.0
// Which actor runs. Each has a fiber, which runs until it reaches a point at which another may go on instead;
// the choices decide. Taking the turn from an actor that could go on is a preemption, of which a run has so
// many; where it waits or ends the turn is free.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "model/choices.hpp"
#include "model/fiber.hpp"
#include "model/scenario.hpp"

namespace rowe::model {

class schedule {
 public:
  static constexpr std::size_t outside =
      0; // the thread that sets up and looks afterwards; actors are 1 to actors()

  // `fail` is told what is wrong with the schedule itself, on the stack of the running fiber, and may leave()
  // it.
  schedule(choices& by, std::size_t preemptions_max, std::function<void(const char*)> fail)
      : choices_{by}, preemptions_max_{preemptions_max}, fail_{std::move(fail)} {}
  schedule(const schedule&) = delete;
  schedule& operator=(const schedule&) = delete;

  // A new run, without actors.
  void clear() noexcept {
    actors_ = preemptions_ = steps_ = 0;
    running_ = outside;
    indivisible_ = just_picked_ = false;
  }
  // False when there is no room for another.
  bool add(actor a);
  std::size_t actors() const noexcept { return actors_; }
  std::size_t running() const noexcept { return running_; }
  const char* name_of(std::size_t who) const noexcept {
    return who == outside ? "set-up" : threads_[who].plays.name;
  }

  // Returns when all actors have ended, or one has left.
  void run_actors();
  // Outside, but on a stack that can be left.
  void run_afterwards(std::function<void()> look);
  // Ends the run from wherever it is. Returns only in set-up, where there is no fiber to leave.
  void leave();

  // Before an operation: another actor may go on first.
  void point();
  // Between the two, points are none.
  void begin_indivisible() noexcept { indivisible_ = true; }
  void end_indivisible() noexcept { indivisible_ = false; }
  // The running actor waits until somebody wakes the waiters of `object`, and the answer is true; one that
  // may give up does so at any moment, and the answer is false.
  bool wait_for(const void* object, bool may_give_up);
  void wake(const void* object) noexcept;

 private:
  enum class state : std::uint8_t { ready, waiting, ended };
  struct thread {
    actor plays;
    state is = state::ended;
    const void* awaits = nullptr;
    fiber body;
  };

  static void play();
  static void look();
  void give_up_turn();
  void change_to(std::size_t next, bool for_good = false);

  static inline schedule* active_ = nullptr; // whose fibers run

  choices& choices_;
  std::size_t preemptions_max_;
  std::function<void(const char*)> fail_;
  std::array<thread, threads_max> threads_;
  std::size_t actors_ = 0;
  std::size_t running_ = outside;
  std::size_t preemptions_ = 0;
  std::size_t steps_ = 0;
  bool indivisible_ = false;
  bool just_picked_ = false;
  fiber looker_;
  std::function<void()> look_;
  bool looking_ = false;
};

inline bool schedule::add(actor a) {
  if (actors_ + 1 == threads_max) return false;
  thread& t = threads_[++actors_];
  t.plays = std::move(a);
  t.is = state::ready;
  t.awaits = nullptr;
  t.body.start_at(&schedule::play);
  return true;
}

inline void schedule::run_actors() {
  schedule* const outer = std::exchange(active_, this);
  if (actors_ != 0) give_up_turn();
  active_ = outer;
}

inline void schedule::play() {
  schedule& s = *active_;
  thread& self = s.threads_[s.running_];
  self.plays.act();
  self.is = state::ended;
  s.give_up_turn();
}

inline void schedule::run_afterwards(std::function<void()> look) {
  schedule* const outer = std::exchange(active_, this);
  look_ = std::move(look);
  looker_.start_at(&schedule::look);
  looking_ = true;
  fiber::change(threads_[outside].body, looker_);
  looking_ = false;
  active_ = outer;
}

inline void schedule::look() {
  active_->look_();
  fiber::change(active_->looker_, active_->threads_[outside].body, true);
}

inline void schedule::leave() {
  if (looking_) fiber::change(looker_, threads_[outside].body, true);
  if (running_ != outside) change_to(outside, true);
}

inline void schedule::point() {
  if (++steps_ > steps_max / (running_ == outside ? 1 : 2)) {
    fail_("more operations than a run may have: it does not end");
  }
  if (running_ == outside || indivisible_) return;
  if (std::exchange(just_picked_, false)) return; // whoever else could go now could have been picked instead
  std::array<std::size_t, threads_max> ready;
  std::size_t count = 0;
  ready[count++] = running_;
  for (std::size_t t = 1; preemptions_ != preemptions_max_ && t <= actors_; ++t) {
    if (t != running_ && threads_[t].is == state::ready) ready[count++] = t;
  }
  const std::size_t next = ready[choices_.pick(count)];
  if (next == running_) return;
  ++preemptions_;
  change_to(next);
  just_picked_ = false; // back again, and about to do what this point stands before
}

// The running actor cannot go on, or none runs yet: one that is ready does, or the run is over.
inline void schedule::give_up_turn() {
  std::array<std::size_t, threads_max> ready;
  std::size_t count = 0;
  bool somebody_waits = false;
  for (std::size_t t = 1; t <= actors_; ++t) {
    if (threads_[t].is == state::ready) ready[count++] = t;
    if (threads_[t].is == state::waiting) somebody_waits = true;
  }
  if (count != 0) {
    change_to(ready[choices_.pick(count)], running_ != outside && threads_[running_].is == state::ended);
  } else if (somebody_waits) {
    fail_("everybody left waits: a wake-up was lost");
  } else {
    change_to(outside, true);
  }
}

inline void schedule::change_to(std::size_t next, bool for_good) {
  if (next == running_) return; // it gave up a wait with a deadline, and nobody else was picked
  fiber& from = threads_[running_].body;
  running_ = next;
  just_picked_ = true;
  fiber::change(from, threads_[next].body, for_good);
}

inline bool schedule::wait_for(const void* object, bool may_give_up) {
  thread& self = threads_[running_];
  self.is = may_give_up ? state::ready : state::waiting; // one that may give up may go on whenever it likes
  self.awaits = object;
  give_up_turn();
  return std::exchange(self.awaits, nullptr) == nullptr;
}

inline void schedule::wake(const void* object) noexcept {
  for (std::size_t t = 1; t <= actors_; ++t) {
    if (threads_[t].awaits != object) continue;
    threads_[t].awaits = nullptr;
    threads_[t].is = state::ready;
  }
}

} // namespace rowe::model
