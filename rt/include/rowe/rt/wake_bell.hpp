// SPDX-License-Identifier: Apache-2.0
// The waker: how a thread that polls many places can sleep, and is woken by the threads that put something
// there. These, the ringers, never wait, and enter the kernel only while it sleeps. Each ringer has a rope,
// which is a count of its own (its epoch). The sleeper has one word, `sleeping`.
//
//   ringer                                  sleeper
//     (store what is given: release)          mark each rope: note its count (acquire)
//     its count: one more (seq_cst)           (look at all places; work)
//     is `sleeping` set? (seq_cst)            sleeping := true (seq_cst)
//       yes: ring the bell                    is each count still as noted? (seq_cst)
//                                               yes: wait for the bell
//                                             sleeping := false
//
// No wake-up is lost. The ringer's two accesses and the sleeper's two are all seq_cst, so one of the two
// stores is first. If it is the ringer's count, the sleeper finds it raised and does not wait. If it is
// `sleeping`, the ringer finds it set. And the sleeper sees all that was given up to the count that it noted:
// the acquire brings what was stored before the count was raised.
//
// Why not notification.hpp: its notifier exchanges, in a word that all notifiers share; on ARMv8.0 that is a
// loop, and its length depends on the others. Here a ringer writes only its own word, by plain stores, so
// ring() is wait-free: one store and one load, and where the sleeper sleeps one call of the kernel, which for
// an eventfd never waits. The bell must keep a ring for the next wait, as an eventfd does: the sleeper may
// still be on its way.
#pragma once
#include <cstdint>
#include <utility>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// The bell for std_atomics: an eventfd that somebody else owns and waits for. A model brings its own.
struct eventfd_bell {
  int descriptor = -1;

  // Ends a wait for it, or the next one: one write of eight bytes. Never waits, for it is full only after
  // 2^64 rings.
  void ring() const noexcept;
};

// What one ringer and the sleeper share. Neither copied nor moved.
template <class Atomics = std_atomics>
class bell_rope {
 public:
  bell_rope() noexcept = default;
  bell_rope(const bell_rope&) = delete;
  bell_rope& operator=(const bell_rope&) = delete;

  // Says that there is something, after storing it. The ringer; not without wake_bell::ring() behind it.
  ROWE_RT void pull() noexcept {
    // seq_cst: with the load in wake_bell::ring(), against the two of wake_bell::sleep()
    pulled_.store(++pulls_, std::memory_order_seq_cst);
  }

  // The sleeper: what was given up to here will be looked for after this.
  void mark() noexcept {
    marked_ = pulled_.load(std::memory_order_acquire); // acquire: pairs with the store in pull()
  }
  // The sleeper, in wake_bell::sleep(): nothing was given since.
  bool quiet() const noexcept { return pulled_.load(std::memory_order_seq_cst) == marked_; }

 private:
  // The ringer's line, and the sleeper's.
  alignas(line_bytes) typename Atomics::template variable<std::uint64_t> pulled_{0};
  std::uint64_t pulls_ = 0;
  alignas(line_bytes) std::uint64_t marked_ = 0;
};

// The sleeper's word. Neither copied nor moved.
template <class Atomics = std_atomics, class Bell = eventfd_bell>
class wake_bell {
 public:
  explicit wake_bell(Bell bell) noexcept : bell_{std::move(bell)} {}
  wake_bell(const wake_bell&) = delete;
  wake_bell& operator=(const wake_bell&) = delete;

  // Says that something was given, and wakes the sleeper if it sleeps. Any thread, each by its own rope.
  // Never waits, never allocates; enters the kernel once, or not at all when nobody sleeps.
  ROWE_RT void ring(bell_rope<Atomics>& by) noexcept {
    by.pull();
    if (sleeping_.load(std::memory_order_seq_cst)) bell_.ring(); // seq_cst: as in pull()
  }

  // Waits by `wait()`, unless something came since the ropes were marked, which `quiet()` says: it asks each
  // of them. The sleeper.
  template <class Quiet, class Wait>
  void sleep(Quiet&& quiet, Wait&& wait) noexcept(noexcept(quiet()) && noexcept(wait())) {
    sleeping_.store(true, std::memory_order_seq_cst); // seq_cst: with quiet()'s loads, against ring()
    if (quiet()) wait();
    // relaxed: pairs with the load in ring(). Who still sees `true` rings once in vain; who sees this is
    // looked for before the next wait.
    sleeping_.store(false, std::memory_order_relaxed);
  }

 private:
  alignas(line_bytes) typename Atomics::template variable<bool> sleeping_{false};
  Bell bell_;
};

} // namespace rowe::rt
