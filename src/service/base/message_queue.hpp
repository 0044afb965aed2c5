// SPDX-License-Identifier: Apache-2.0
// Bounded queues of encoded messages, one for each subscription, and some for each peer. All entries come
// from one pool. So memory is bounded once, and an empty queue costs nothing. The pool counts what each owner
// has queued, by the size class of the slots. So it finds the owner that holds most when a pool is used up.
// Service thread only.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/index_list.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/base/slot_pool.hpp"

namespace rowe::service {

// Who owns queue entries: each connection owns two kinds. Direct messages are not evicted, because their
// senders are promised an outcome; other messages are.
enum class queued_as : std::uint8_t { evictable, direct_message };

struct queue_entry {
  slot_ref slot;
  entry_id next{};
};

struct queue {
  std::uint32_t owner = 0; // queue_entries::owner_of()
  index_queue<entry_id, queue_entry, &queue_entry::next> entries;
  std::uint32_t count = 0;
  std::uint64_t popped = 0; // since it exists

  bool empty() const noexcept { return entries.empty(); }
};

class queue_entries {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<queue_entry>(bounds.queued_max) +
           rt::arena::bytes_for<held>(owner_count(bounds));
  }

  queue_entries(rt::arena& memory, const limits& bounds) noexcept
      : entries_{memory.carve<queue_entry>(bounds.queued_max)},
        free_{entries_},
        held_{memory.carve<held>(owner_count(bounds))},
        first_large_{slot_pool::first_large(bounds)},
        first_chunked_{slot_pool::first_chunked(bounds)} {}

  static std::uint32_t owner_of(peer_index peer, queued_as what) noexcept {
    return 2 * peer.value + static_cast<std::uint32_t>(what);
  }

  // False when the pool is exhausted.
  bool push(queue& to, slot_ref slot) noexcept {
    const entry_id taken = free_.take();
    if (!taken) return false;
    entries_[taken].slot = slot;
    to.entries.push_back(entries_, taken);
    ++to.count;
    ++held_[to.owner].of[class_of(slot)];
    return true;
  }

  slot_ref front(const queue& of) const noexcept { return entries_[of.entries.head].slot; }
  slot_ref pop(queue& from) noexcept { return taken(from, from.entries.pop_front(entries_)); }

  // The entry behind another one of the queue; behind none it is the front.
  slot_ref behind(const queue& of, entry_id before) const noexcept {
    return before ? entries_[entries_[before].next].slot : front(of);
  }
  slot_ref take_behind(queue& from, entry_id before) noexcept {
    const entry_id which = before ? entries_[before].next : from.entries.head;
    from.entries.erase_behind(entries_, before);
    return taken(from, which);
  }

  // For a walk over a queue, which begins at its front.
  slot_ref at(entry_id which) const noexcept { return entries_[which].slot; }
  entry_id after(entry_id which) const noexcept { return entries_[which].next; }

  // How many entries of one size class the queues of a connection hold. Some of their slots may have expired.
  std::uint32_t held_by(peer_index peer, queued_as what, slot_class of) const noexcept {
    return held_[owner_of(peer, what)].of[index_of(of)];
  }
  // Whether the front of a queue is the only evictable entry of the class that its connection holds.
  bool is_all(const queue& of, slot_class size) const noexcept {
    if (of.empty() || ROWE_MUTANT(only_reply)) return false;
    return class_of(front(of)) == index_of(size) && held_[of.owner].of[index_of(size)] == 1;
  }
  // Which connection loses an entry: the one found last, while it holds more than `share` entries that may be
  // evicted; else the one that holds most. Among equals it is the last one for which `rather(peer_index)` is
  // true, or else the first. That search looks at every connection. Counts entries of one size class, or of
  // all. None: nobody holds any.
  template <class Rather>
  peer_index longest(std::optional<slot_class> of, std::uint32_t share, Rather&& rather) noexcept {
    if (longest_ && evictable(longest_, of) > std::max(share, 1U)) return longest_;
    peer_index found{};
    std::uint32_t most = 1;
    for (peer_index i{0}; i.value < held_.size() / 2; ++i.value) {
      const std::uint32_t count = evictable(i, of);
      if (count < most || (count == most && found && !rather(i))) continue;
      most = count;
      found = i;
    }
    if (found) longest_ = found;
    return found;
  }
  // The connection has ended. Whoever gets its place next was not found.
  void forget(peer_index peer) noexcept {
    if (longest_ == peer) longest_ = {};
  }
  // Looks at every connection.
  bool any_evictable() const noexcept {
    for (peer_index i{0}; i.value < held_.size() / 2; ++i.value) {
      if (evictable(i, std::nullopt) != 0) return true;
    }
    return false;
  }

  bool full() const noexcept { return free_.empty(); }
  std::uint32_t in_use() const noexcept { return free_.in_use(); }
  std::uint64_t popped() const noexcept { return popped_; } // of all queues, so far

 private:
  struct held {
    by_class<std::uint32_t> of{};
  };
  // An entry was taken out of its queue.
  slot_ref taken(queue& from, entry_id which) noexcept {
    const slot_ref slot = entries_[which].slot;
    --from.count;
    ++from.popped;
    ++popped_;
    --held_[from.owner].of[class_of(slot)];
    free_.give_back(which);
    return slot;
  }
  static std::size_t owner_count(const limits& bounds) noexcept {
    return 2 * std::size_t{bounds.connections_max};
  }
  std::uint32_t evictable(peer_index peer, std::optional<slot_class> of) const noexcept {
    const auto& here = held_[owner_of(peer, queued_as::evictable)].of;
    return of ? here[index_of(*of)] : here[0] + here[1] + here[2];
  }
  std::size_t class_of(slot_ref slot) const noexcept {
    return (slot.index.value >= first_large_ ? 1U : 0U) + (slot.index.value >= first_chunked_ ? 1U : 0U);
  }

  rows<entry_id, queue_entry> entries_;
  indexed_pool<entry_id, queue_entry, &queue_entry::next> free_;
  std::span<held> held_;
  const std::uint32_t first_large_;
  const std::uint32_t first_chunked_;
  peer_index longest_{}; // the peer that was found last
  std::uint64_t popped_ = 0;
};

} // namespace rowe::service
