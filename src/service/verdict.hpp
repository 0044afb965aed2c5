// SPDX-License-Identifier: Apache-2.0
// How one thread learns what became of what it asked, and who gives the slot back that both sides know: the
// asker waits with a deadline, the settler comes once and never waits. One word; both sides change it only by
// exchanges, so of the two that meet in time-out and settlement exactly one finds the other's mark:
//
//   asker                                    settler
//     word := asleep; was it settled? done     (write the outcome)
//     sleep while it is asleep                 word := settled
//     settled? done                              it was abandoned? then the slot is the settler's
//     out of time: word := abandoned             it was asleep? then wake
//       was it settled? done, after all          and the slot is the asker's
//       else the slot is the settler's
//
// The settler may still be on its way to wake when the asker has seen the outcome, given the slot back, and
// another asks by it; that one is then woken early, looks, and sleeps on.
#pragma once
#include <cassert>
#include <cstdint>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>

namespace rowe::service {

// Who holds the slot after one side has done its part.
enum class slot_holder : std::uint8_t { asker, settler };

// Neither copied nor moved.
template <class Atomics = rt::std_atomics, class Kernel = rt::futex>
class verdict {
 public:
  verdict() noexcept = default;
  verdict(const verdict&) = delete;
  verdict& operator=(const verdict&) = delete;

  // Begins anew, before the slot is handed to the settler, whose acquire of it orders this. When nobody will
  // wait, it is as if the asker had left already.
  void arm(bool somebody_waits) noexcept {
    // relaxed: what hands over the slot releases this as well; the settler's exchange comes after that
    word_.store(somebody_waits ? pending : abandoned, std::memory_order_relaxed);
  }

  // The asker, once for each arm(true): sleeps until the verdict is there or `deadline` has come. `asker`: it
  // is there and the slot is the caller's. `settler`: out of time, and the slot must not be touched again.
  slot_holder wait_until(rt::time_point deadline) noexcept {
    // acquire: pairs with the release in settle(), so that the outcome is seen
    if (word_.exchange(asleep, std::memory_order_acquire) == settled) return slot_holder::asker;
    while (Kernel::wait(word_, asleep, deadline)) {
      // acquire: pairs with the release in settle()
      if (word_.load(std::memory_order_acquire) == settled) return slot_holder::asker;
    }
    return abandon();
  }

  // The asker, instead of waiting or when tired of it: leaves, unless the verdict is there.
  slot_holder abandon() noexcept {
    // acq_rel: acquire pairs with the release in settle(), so that the outcome is seen; release pairs with
    // the acquire there, so that whoever has the slot next comes after all that the asker did with it
    return word_.exchange(abandoned, std::memory_order_acq_rel) == settled ? slot_holder::asker
                                                                           : slot_holder::settler;
  }

  // The settler, once for each arm(), after writing the outcome: never waits; enters the kernel if the asker
  // sleeps. `settler`: nobody will come for the outcome, the slot is the caller's.
  slot_holder settle() noexcept {
    // acq_rel: release pairs with the acquires of the asker; acquire pairs with the release in abandon()
    const std::uint32_t before = word_.exchange(settled, std::memory_order_acq_rel);
    assert(before != settled); // else it came twice
    if (before == asleep) Kernel::wake(word_);
    return before == abandoned ? slot_holder::settler : slot_holder::asker;
  }

 private:
  enum state : std::uint32_t { abandoned, pending, asleep, settled };

  alignas(rt::line_bytes) typename Atomics::template variable<std::uint32_t> word_{abandoned};
};

} // namespace rowe::service
