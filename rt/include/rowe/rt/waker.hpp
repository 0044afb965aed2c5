// SPDX-License-Identifier: Apache-2.0
// The waker: how a thread that polls many places can sleep, and is woken by the threads that put something
// there. These, the producers, never wait, and enter the kernel only while it sleeps. Each producer has an
// epoch, which is a count of its own. The sleeper has one word, `sleeping`.
//
//   producer                                sleeper
//     (store what is given: release)          mark each epoch: read its count (acquire)
//     its epoch: one more (seq_cst)           (look at all places; work)
//     is `sleeping` set? (seq_cst)            sleeping := true (seq_cst)
//       yes: raise the signal                 is each epoch as marked? (seq_cst)
//                                               yes: wait for the signal
//                                             sleeping := false
//
// No wake-up is lost. The producer's two accesses and the sleeper's two are all seq_cst, so one of the two
// stores is first. If it is the producer's epoch, the sleeper finds it raised and does not wait. If it is
// `sleeping`, the producer finds it set. And the sleeper sees all that was given up to the epoch that it
// marked: the acquire brings what was stored before the epoch was raised.
//
// Why not notification.hpp: its notifier exchanges, in a word that all notifiers share; on ARMv8.0 that is a
// loop, and its length depends on the others. Here a producer writes only its own word, by plain stores, so
// wake() is wait-free: one store and one load, and where the sleeper sleeps one call of the kernel, which for
// an eventfd never waits. The signal must last until the next wait, as that of an eventfd does: the sleeper
// may still be on its way.
#pragma once
#include <cstdint>
#include <utility>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// The signal for std_atomics: an eventfd that somebody else owns and waits for. A model brings its own.
struct eventfd_signal {
  int descriptor = -1;

  // Ends a wait for it, or the next one: one write of eight bytes. Never waits, for it is full only after
  // 2^64 signals.
  void raise() const noexcept;
};

// What one producer and the sleeper share. Neither copied nor moved.
template <class Atomics = std_atomics>
class producer_epoch {
 public:
  producer_epoch() noexcept = default;
  producer_epoch(const producer_epoch&) = delete;
  producer_epoch& operator=(const producer_epoch&) = delete;

  // Says that there is something, after storing it. The producer; not without waker::wake() behind it.
  ROWE_RT void advance() noexcept {
    // seq_cst: with the load in waker::wake(), against the two of waker::sleep()
    shared_count_.store(++count_, std::memory_order_seq_cst);
  }

  // The sleeper: what was given up to here will be looked for after this.
  void mark() noexcept {
    marked_ = shared_count_.load(std::memory_order_acquire); // acquire: pairs with the store in advance()
  }
  // The sleeper, in waker::sleep(): nothing was given since.
  bool quiet() const noexcept { return shared_count_.load(std::memory_order_seq_cst) == marked_; }

 private:
  // The producer's line, and the sleeper's.
  alignas(line_bytes) typename Atomics::template variable<std::uint64_t> shared_count_{0};
  std::uint64_t count_ = 0;
  alignas(line_bytes) std::uint64_t marked_ = 0;
};

// The sleeper's word. Neither copied nor moved.
template <class Atomics = std_atomics, class Signal = eventfd_signal>
class waker {
 public:
  explicit waker(Signal signal) noexcept : signal_{std::move(signal)} {}
  waker(const waker&) = delete;
  waker& operator=(const waker&) = delete;

  // Says that something was given, and wakes the sleeper if it sleeps. Any thread, each by its own epoch.
  // Never waits, never allocates; enters the kernel once, or not at all when nobody sleeps.
  ROWE_RT void wake(producer_epoch<Atomics>& by) noexcept {
    by.advance();
    if (sleeping_.load(std::memory_order_seq_cst)) signal_.raise(); // seq_cst: as in advance()
  }

  // Waits by `wait()`, unless something came since the epochs were marked, which `quiet()` says: it asks each
  // of them. The sleeper.
  template <class Quiet, class Wait>
  void sleep(Quiet&& quiet, Wait&& wait) noexcept(noexcept(quiet()) && noexcept(wait())) {
    sleeping_.store(true, std::memory_order_seq_cst); // seq_cst: with quiet()'s loads, against wake()
    if (quiet()) wait();
    // relaxed: pairs with the load in wake(). Who still sees `true` raises the signal in vain; who sees this
    // is looked for before the next wait.
    sleeping_.store(false, std::memory_order_relaxed);
  }

 private:
  alignas(line_bytes) typename Atomics::template variable<bool> sleeping_{false};
  Signal signal_;
};

} // namespace rowe::rt
