// SPDX-License-Identifier: Apache-2.0
// How a queue pair changes hands, and whether its publisher reaches anybody: two words of a pair that set-up,
// the handle's thread and the service thread share. Only these two classes touch them.
//
//   phase      whose the pair is                       the way on
//   free       set-up's, to build in                   offer()                       -> offered
//   offered    the service thread's, to answer         accept(), refuse()            -> active, refused
//   active     the handle's and the service thread's   close(), by the handle        -> closing
//   refused    set-up's, with the answer               wait_answer()                 -> free
//   closing    the service thread's, to empty          release(), hold()             -> free, held
//   held       of views that outlive their handle      release(), once all are gone  -> free
//
// Each change is a release store by the side that has the pair, and every look is an acquire. So a thread
// that finds a phase sees all that earlier owners of the pair have written. The service thread notifies after
// its own changes, because set-up sleeps until those. After other changes the caller must wake the service
// thread.
#pragma once
#include <cassert>
#include <cstdint>

#include <rowe/result.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>

namespace rowe::detail {

enum class pair_phase : std::uint32_t { free, offered, active, refused, closing, held };

// `arrival` is the pair's own notification. Neither copied nor moved.
template <class Atomics = rt::std_atomics, class Kernel = rt::futex>
class pair_lifecycle {
  using notification = rt::notification<Atomics, Kernel>;

 public:
  // Any thread.
  pair_phase look() const noexcept {
    return phase_.load(std::memory_order_acquire); // acquire: pairs with each release below
  }
  bool is_free() const noexcept { return look() == pair_phase::free; }
  // Whether both sides have left the pair. Only views may still look at its slots.
  bool is_detached() const noexcept {
    const pair_phase now = look();
    return now == pair_phase::free || now == pair_phase::held;
  }

  // Set-up, one thread at a time.
  void offer() noexcept {
    // release: pairs with the service thread's look(), which then reads what was built
    phase_.store(pair_phase::offered, std::memory_order_release);
  }
  // Sleeps until the service thread has answered. If it refused, returns its error, and the pair is free
  // again.
  status wait_answer(notification& arrival) noexcept {
    pair_phase answered = pair_phase::offered;
    arrival.wait_until(rt::never, [&] {
      answered = look();
      return answered != pair_phase::offered;
    });
    if (answered == pair_phase::active) return {};
    const error why = refusal();
    // release: pairs with is_free() of whoever is next to set up; their mutex orders it as well
    phase_.store(pair_phase::free, std::memory_order_release);
    return why;
  }
  // Sleeps until the service thread has emptied a pair that is closing. False if `deadline` comes first. In
  // any other phase it returns at once, because a handle that exists may itself sleep on `arrival`.
  bool wait_while_closing(notification& arrival, rt::time_point deadline) const noexcept {
    const auto is_over = [&] { return look() != pair_phase::closing; };
    return is_over() || arrival.wait_until(deadline, is_over);
  }
  // Why the pair was refused. Only for a refused pair.
  error refusal() const noexcept { return refusal_.load(); }

  // The handle, once, when it will not touch the pair any more.
  void close() noexcept {
    // release: pairs with the service thread's look(), which then takes what was published
    phase_.store(pair_phase::closing, std::memory_order_release);
  }

  // The service thread.
  void accept(notification& arrival) noexcept {
    phase_.store(pair_phase::active, std::memory_order_release); // release: pairs with wait_answer()
    arrival.notify();
  }
  void refuse(const error& why, notification& arrival) noexcept {
    refusal_.store(why);
    phase_.store(pair_phase::refused, std::memory_order_release); // release: pairs with wait_answer()
    arrival.notify();
  }
  // The pair is emptied, but views or requests are left. So its memory stays as it is.
  void hold(notification& arrival) noexcept {
    // release: pairs with wait_while_closing(); weaker would do, as whoever finds it held leaves it alone
    phase_.store(pair_phase::held, std::memory_order_release);
    arrival.notify();
  }
  // The pair is emptied, and nobody looks at its memory.
  void release(notification& arrival) noexcept {
    // release: pairs with is_free(), after which set-up builds where this thread has read
    phase_.store(pair_phase::free, std::memory_order_release);
    arrival.notify();
  }

 private:
  typename Atomics::template variable<pair_phase> phase_{pair_phase::free};
  typename Atomics::template plain<error> refusal_{errc::misuse};
};

// Whether publishing reaches anybody. `crowded`, of lanes: messages to everyone are refused, because such
// messages have half of the slots that the lane may park.
enum class audience : std::uint32_t { nobody, somebody, closed, crowded };

template <class Atomics = rt::std_atomics>
class audience_word {
 public:
  // For the handle's thread, and for the service thread, which wrote it.
  ROWE_RT audience advice() const noexcept {
    // relaxed: pairs with set(); no other read relies on it, and the service thread counts what comes after
    // the last listener left
    return word_.load(std::memory_order_relaxed);
  }
  // For the handle's thread. After it has found `closed`, nothing more arrives than is there.
  ROWE_RT audience look() const noexcept {
    return word_.load(std::memory_order_acquire); // acquire: pairs with the release in close()
  }
  ROWE_RT bool closed() const noexcept { return look() == audience::closed; }

  // For the service thread. A thread that sees a later accept(), hold() or release() also sees this.
  void set(audience now) noexcept {
    assert(now != audience::closed);
    word_.store(now, std::memory_order_relaxed); // relaxed: pairs with advice(), and is no more than that
  }
  // For the thread that has joined the service thread. It must then notify the handle's thread.
  void close() noexcept {
    // release: pairs with the acquire in look(); the service thread's last deliveries come before
    word_.store(audience::closed, std::memory_order_release);
  }

 private:
  typename Atomics::template variable<audience> word_{audience::nobody};
};

} // namespace rowe::detail
