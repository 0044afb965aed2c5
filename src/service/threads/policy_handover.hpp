// SPDX-License-Identifier: Apache-2.0
// How the service thread gets new rights while it works: a thread that changes them offers a policy, and
// waits until the service thread has taken it. From then on nobody looks at the old one, so the thread that
// waited frees it: the service thread frees nothing. One word says both: it has the policy that is offered,
// or null, once it was taken.
//
//   offering thread                         service thread, once a cycle
//     offered := next  (release)              offered? (acquire: next is whole)
//     waits: is offered null? (acquire)       uses next; offered := null (release: done with the old one)
//     frees the old one                       wakes who waits
#pragma once
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/notification.hpp>

namespace rowe::access {
class policy;
}

namespace rowe::service {

template <class Policy = access::policy, class Atomics = rt::std_atomics, class Kernel = rt::futex>
class policy_handover {
 public:
  // `first` is used until another is taken. Both must live until the next one is taken, or the service thread
  // is gone.
  explicit policy_handover(const Policy& first) noexcept : in_use_{&first} {}

  // ---- One thread at a time, not the service thread.

  // The caller then wakes the service thread, and calls wait_taken() before it offers another one.
  void offer(const Policy& next) noexcept {
    offered_.store(&next, std::memory_order_release); // release: pairs with the acquire in take()
  }
  bool is_taken() const noexcept {
    return offered_.load(std::memory_order_acquire) == nullptr; // acquire: pairs with the release in take()
  }
  void wait_taken() noexcept {
    taken_.wait_until(rt::never, [this] { return is_taken(); });
  }

  // ---- The service thread. Never waits, never allocates; enters the kernel if a thread waits.

  // Whether there is a new policy: then it is in use from here on.
  bool take() noexcept {
    const Policy* const next = offered_.load(std::memory_order_acquire); // acquire: pairs with offer()
    if (next == nullptr) return false;
    in_use_ = next;
    offered_.store(nullptr, std::memory_order_release); // release: pairs with the acquire in is_taken()
    taken_.notify();
    return true;
  }
  const Policy& in_use() const noexcept { return *in_use_; }

 private:
  const Policy* in_use_; // the service thread's
  typename Atomics::template variable<const Policy*> offered_{nullptr};
  rt::notification<Atomics, Kernel> taken_;
};

} // namespace rowe::service
