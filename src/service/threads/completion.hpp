// SPDX-License-Identifier: Apache-2.0
// How a thread learns what became of its submission, and who releases the slot that both sides know. The
// submitter waits with a deadline; the service thread comes once and never waits. They share one word. Both
// sides change the word only by exchanges. If time-out and completion meet, exactly one side finds the
// other's mark:
//
//   submitter                                service thread
//     word := asleep; was it completed? done   (write the outcome)
//     sleep while it is asleep                 word := completed
//     completed? done                            it was abandoned? then the slot is the service thread's
//     out of time: word := abandoned             it was asleep? then wake
//       was it completed? done, after all          and the slot is the submitter's
//       else the slot is the service thread's
//
// A wake-up may come late: the submitter has seen the outcome and released the slot, and another thread has
// submitted by the same slot. That thread is woken early, looks at the word, and sleeps again.
#pragma once
#include <cassert>
#include <cstdint>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>

namespace rowe::service {

// Who holds the slot after one side has done its part.
enum class slot_holder : std::uint8_t { submitter, service };

// Neither copied nor moved.
template <class Atomics = rt::std_atomics, class Kernel = rt::futex>
class completion {
 public:
  completion() noexcept = default;
  completion(const completion&) = delete;
  completion& operator=(const completion&) = delete;

  // Begins anew, before the slot is handed to the service thread, whose acquire of the slot orders this. If
  // nobody will wait, the word says that the submitter has left.
  void arm(bool somebody_waits) noexcept {
    // relaxed: the push of the slot releases this as well; the service thread's exchange comes after it
    word_.store(somebody_waits ? pending : abandoned, std::memory_order_relaxed);
  }

  // The submitter, once for each arm(true): sleeps until the completion is there or `deadline` has come.
  // `submitter`: it is there and the slot is the caller's. `service`: out of time, and the slot must not be
  // touched again.
  slot_holder wait_until(rt::time_point deadline) noexcept {
    // acquire: pairs with the release in complete(), so that the outcome is seen
    if (word_.exchange(asleep, std::memory_order_acquire) == completed) return slot_holder::submitter;
    while (Kernel::wait(word_, asleep, deadline)) {
      // acquire: pairs with the release in complete()
      if (word_.load(std::memory_order_acquire) == completed) return slot_holder::submitter;
    }
    return abandon();
  }

  // The submitter, instead of waiting or after its deadline: leaves, unless the completion is there.
  slot_holder abandon() noexcept {
    // acq_rel: acquire pairs with the release in complete(), so that the outcome is seen; release pairs with
    // the acquire there, so that whoever has the slot next comes after all that the submitter did with it
    return word_.exchange(abandoned, std::memory_order_acq_rel) == completed ? slot_holder::submitter
                                                                             : slot_holder::service;
  }

  // The service thread, once for each arm(), after writing the outcome: never waits; enters the kernel if the
  // submitter sleeps. `service`: nobody will come for the outcome, the slot is the caller's.
  slot_holder complete() noexcept {
    // acq_rel: release pairs with the acquires of the submitter; acquire pairs with the release in abandon()
    const std::uint32_t before = word_.exchange(completed, std::memory_order_acq_rel);
    assert(before != completed); // else it came twice
    if (before == asleep) Kernel::wake(word_);
    return before == abandoned ? slot_holder::service : slot_holder::submitter;
  }

 private:
  enum state : std::uint32_t { abandoned, pending, asleep, completed };

  alignas(rt::line_bytes) typename Atomics::template variable<std::uint32_t> word_{abandoned};
};

} // namespace rowe::service
