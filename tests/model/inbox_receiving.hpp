// SPDX-License-Identifier: Apache-2.0
// A receiver at the shared inbox, deliveries, and closing, as far as threads meet there: what
// service/threads/shared_inbox.cpp does with the words they share, statement by statement, for one receiver.
// With one receiver its fetch_add and compare-exchange are exchanges; promela/shared_inbox.pml has several.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include <rowe/rt/clock.hpp>

#include "model/atomics.hpp"

namespace rowe::model {

struct modelled_inbox {
  static constexpr std::uint32_t places_count = 2;
  std::array<atomics::variable<std::uint32_t>, places_count> places;
  std::array<atomics::plain<std::uint32_t>, places_count> texts; // of the slots
  atomics::variable<std::uint64_t> inbox_head{0};
  atomics::variable<std::uint64_t> inbox_tail{0};
  atomics::variable<std::uint32_t> sleepers{0};
  atomics::variable<bool> closed{false};
  futex::word wake_count{0};

  // wake_receiver()
  void wake_receiver(std::uint32_t count) {
    if (sleepers.load(std::memory_order_seq_cst) == 0) return;
    wake_count.exchange(count, std::memory_order_release);
    futex::wake(wake_count);
  }
  // deliver(): the service thread's, of the `tail`th message.
  void deliver(std::uint64_t tail) {
    const auto slot = static_cast<std::uint32_t>(tail % places_count);
    texts[slot].store(slot + 100);
    places[tail % places_count].store(slot, std::memory_order_relaxed);
    inbox_tail.store(tail + 1, std::memory_order_seq_cst);
    wake_receiver(static_cast<std::uint32_t>(2 * (tail + 1)));
  }
  // close(): any thread's.
  void close() {
    closed.store(true, std::memory_order_seq_cst);
    wake_receiver(1);
  }
  // pop()
  std::optional<std::uint32_t> pop() {
    const std::uint64_t head = inbox_head.load(std::memory_order_acquire);
    if (head == inbox_tail.load(std::memory_order_seq_cst)) return std::nullopt;
    const std::uint32_t entry = places[head % places_count].load(std::memory_order_relaxed);
    inbox_head.exchange(head + 1, std::memory_order_acq_rel);
    return entry;
  }
  // receive(): nothing when it is closed.
  std::optional<std::uint32_t> receive() {
    if (const auto slot = pop()) return slot;
    sleepers.exchange(1, std::memory_order_seq_cst);
    bool over = false;
    std::optional<std::uint32_t> found;
    for (;;) {
      const std::uint32_t seen = wake_count.load(std::memory_order_acquire);
      over = closed.load(std::memory_order_seq_cst);
      found = pop();
      if (found || over) break;
      futex::wait(wake_count, seen, rt::never);
    }
    sleepers.exchange(0, std::memory_order_seq_cst);
    if (over) futex::wake(wake_count);
    return found;
  }
};

} // namespace rowe::model
