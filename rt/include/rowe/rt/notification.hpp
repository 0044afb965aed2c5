// SPDX-License-Identifier: Apache-2.0
// How an ordinary thread sleeps until another has something for it: lane.receive(), lane.invoke() and the
// like, never a loop. One word with three states; both sides change it only by exchanges, so all changes
// stand in one order and each side learns from its own exchange what the other did before:
//
//   sleeper                                 notifier
//     word := idle                            (store the data)
//     is it there? then done                  word := notified; was it asleep? then futex wake
//     word := asleep; was it notified?
//       yes: again   no: futex wait(asleep)
//
// No wake-up is lost: a notify before the sleeper's second exchange is what that exchange returns, and one
// after it finds `asleep` and wakes. (A wake before the wait has begun has changed the word, so the wait
// returns at once.) No data is missed: every change is an exchange, so they form one release sequence, and
// whoever reads a `notified` out of the word sees the data of every notifier before it. The usual form with
// two words, a flag and the data, each stored and then the other loaded, needs the data's store to be
// seq_cst; here a ring's release store is enough.
//
// notify() enters the kernel when, and only when, someone sleeps, and costs an exchange otherwise. So it is
// not ROWE_RT, and a real-time loop must not call it.
#pragma once
#include <cassert>
#include <cstdint>
#include <utility>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::rt {

// The kernel's half for std_atomics: a private futex. A model brings its own, with the same two functions.
struct futex {
  using word = std_atomics::variable<std::uint32_t>;

  // Sleeps while `word` is `expected`, until woken or until `deadline`. May return early for no reason. False
  // when the deadline has passed.
  static bool wait(word& word, std::uint32_t expected, time_point deadline) noexcept;

  // Wakes one sleeper, if there is one.
  static void wake(word& word) noexcept;
};

// Any number of threads notify, one waits. Neither copied nor moved.
template <class Atomics = std_atomics, class Kernel = futex>
class notification {
 public:
  notification() noexcept = default;
  notification(const notification&) = delete;
  notification& operator=(const notification&) = delete;

  // Says that what the sleeper waits for may have come; call it after storing that. Several in a row count as
  // one. Any thread. Never waits, never allocates; enters the kernel if someone sleeps.
  void notify() noexcept {
    if (word_.exchange(notified, std::memory_order_seq_cst) == asleep) Kernel::wake(word_);
  }

  // Sleeps until `ready()` is true, or `deadline` has come; `never` is for ever. Returns what `ready()` said
  // last, so a condition that comes true at the last moment is not missed. `ready` is called at least once,
  // and again after every notify; a change that nobody notifies may go unseen until the deadline. One thread.
  // Allocates nothing.
  template <class Ready>
  bool wait_until(time_point deadline, Ready&& ready) noexcept(noexcept(ready())) {
    for (bool in_time = true;;) {
      word_.exchange(idle, std::memory_order_seq_cst);
      if (ready()) return true;
      if (!in_time) return false;
      const std::uint32_t before = word_.exchange(asleep, std::memory_order_seq_cst);
      assert(before != asleep); // else two threads wait
      if (before == idle) in_time = Kernel::wait(word_, asleep, deadline);
    }
  }

 private:
  enum state : std::uint32_t { idle, notified, asleep };

  alignas(line_bytes) typename Atomics::template variable<std::uint32_t> word_{idle};
};

} // namespace rowe::rt
