// SPDX-License-Identifier: Apache-2.0
// Slots for encoded messages on their way out. A message is encoded once into one slot, however many peers
// get it. Each peer's queue holds the slot's number and generation. Only the service thread uses slots, so
// plain integers count references.
//
// There are two sizes, because most messages are small and a few are not. A message is encoded into a small
// slot; if it does not fit, it is encoded again into a large one. Each slot has headroom for a frame header,
// and one node on the wheel. An expired slot is freed even while it is queued; the queues then find a newer
// generation in its place. When a socket has taken the first bytes of a slot, the slot stays until the socket
// has all of it.
//
// One slot of each size class is reserved for the stop, in addition to those that the limits name.
#pragma once
#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/indexed_pool.hpp"
#include "wire/websocket.hpp"

namespace rowe::service {

struct slot_ref {
  slot_id index{};
  std::uint32_t generation = 0;
  friend bool operator==(const slot_ref&, const slot_ref&) = default;
};

enum class slot_class : std::uint8_t { small, large };
enum class slot_use : std::uint8_t { ordinary, stop };

class slot_pool {
 public:
  static constexpr std::size_t headroom_bytes = wire::frame_headroom_bytes;
  static constexpr std::uint32_t kept_for_stop = 1; // of each class

  // Slots are numbered from 0, small ones first.
  static std::uint32_t first_large(const limits& bounds) noexcept {
    return bounds.small_slots + kept_for_stop;
  }
  static std::size_t count(const limits& bounds) noexcept {
    return std::size_t{bounds.small_slots} + bounds.large_slots + 2 * kept_for_stop;
  }

  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  static std::size_t large_bytes(const limits& bounds) noexcept; // of a large slot
  slot_pool(rt::arena& memory, const limits& bounds) noexcept;

  std::uint32_t count() const noexcept { return slots_.size(); }
  auto ids() const noexcept { return slots_.ids(); }

  // Takes a free slot of at least `bytes`, with one reference; nothing: all slots of that size are taken.
  std::optional<slot_id> take(std::size_t bytes, slot_use what = slot_use::ordinary) noexcept {
    free_slots& free = free_[static_cast<std::size_t>(class_for(bytes))];
    if (bytes > large_bytes_ || free.free() <= left_by(what)) return std::nullopt;
    const slot_id index = free.take();
    slot& taken = slots_[index];
    taken.references = 1;
    taken.tracked = taken.pinned = taken.needed = false;
    taken.bytes = taken.body_at = taken.body_bytes = 0;
    taken.expires = rt::never;
    return index;
  }
  // The class of the smallest slot for so many bytes.
  slot_class class_for(std::size_t bytes) const noexcept {
    return bytes <= small_bytes_ ? slot_class::small : slot_class::large;
  }
  slot_class class_of(slot_id index) const noexcept {
    return small(index) ? slot_class::small : slot_class::large;
  }
  // How many slots of a class are for ordinary use, and how many of those are free.
  std::uint32_t count(slot_class of) const noexcept {
    return of == slot_class::small ? small_count_ - kept_for_stop : count() - small_count_ - kept_for_stop;
  }
  std::uint32_t free_for_all(slot_class of) const noexcept {
    return std::max(free_[static_cast<std::size_t>(of)].free(), kept_for_stop) - kept_for_stop;
  }
  std::size_t bytes_of(slot_class of) const noexcept {
    return of == slot_class::small ? small_bytes_ : large_bytes_;
  }
  std::size_t small_bytes() const noexcept { return small_bytes_; }
  std::size_t large_bytes() const noexcept { return large_bytes_; }

  // The capacity of a slot, to encode into. finish() says how much of it is used; mark_body() says where the
  // body of a topic's message lies.
  std::span<char> buffer(slot_id index) noexcept {
    return {base(index), small(index) ? small_bytes_ : large_bytes_};
  }
  void finish(slot_id index, std::size_t bytes, rt::time_point expires, bool binary = false) noexcept {
    assert(bytes <= buffer(index).size());
    slots_[index].binary = binary;
    slots_[index].bytes = static_cast<std::uint32_t>(bytes);
    slots_[index].expires = expires;
  }
  void mark_body(slot_id index, std::size_t at, std::size_t bytes, rt::time_point published) noexcept {
    assert(at + bytes <= slots_[index].bytes);
    slots_[index].published = published;
    slots_[index].body_at = static_cast<std::uint32_t>(at);
    slots_[index].body_bytes = static_cast<std::uint32_t>(bytes);
  }

  slot_ref ref(slot_id index) const noexcept { return {index, slots_[index].generation}; }
  // False once the slot was freed, even if it is in use again.
  bool alive(slot_ref ref) const noexcept { return slots_[ref.index].generation == ref.generation; }
  rt::time_point expires(slot_id index) const noexcept { return slots_[index].expires; }
  // Whether the message is sent in a binary frame, and when the value in its body was published.
  bool binary(slot_id index) const noexcept { return slots_[index].binary; }
  rt::time_point published(slot_id index) const noexcept { return slots_[index].published; }
  // The peer must not miss this message. Whoever evicts it closes the peer.
  void need(slot_id index) noexcept { slots_[index].needed = true; }
  bool needed(slot_id index) const noexcept { return slots_[index].needed; }
  std::span<char> text(slot_id index) noexcept { return {base(index), slots_[index].bytes}; }
  std::span<const char> body(slot_id index) const noexcept {
    return {base(index) + slots_[index].body_at, slots_[index].body_bytes};
  }

  void retain(slot_id index) noexcept { ++slots_[index].references; }
  std::uint32_t references(slot_id index) const noexcept { return slots_[index].references; }
  // The outcome of the message is tracked. With `pins`, the tracker has one of the references. That one is
  // no delivery, and expire() does not count it.
  void track(slot_id index, bool pins) noexcept {
    slots_[index].tracked = true;
    slots_[index].pinned = pins;
  }
  void untrack(slot_id index) noexcept { slots_[index].tracked = slots_[index].pinned = false; }
  // Releases the reference that is no delivery. It must not be the last one.
  void unpin(slot_id index) noexcept {
    assert(slots_[index].references > 1);
    slots_[index].pinned = false;
    --slots_[index].references;
  }
  bool tracked(slot_id index) const noexcept { return slots_[index].tracked; }
  bool pinned(slot_id index) const noexcept { return slots_[index].pinned; }
  // True when that was the last reference, and the slot is free again.
  bool release(slot_id index) noexcept {
    assert(slots_[index].references > 0);
    if (--slots_[index].references != 0) return false;
    free(index);
    return true;
  }

  // A socket has taken the first bytes: expire() must not free the slot before end().
  void begin(slot_id index) noexcept {
    if (slots_[index].partial++ == 0) ++partial_[static_cast<std::size_t>(class_of(index))];
  }
  void end(slot_id index) noexcept {
    if (--slots_[index].partial == 0) --partial_[static_cast<std::size_t>(class_of(index))];
  }
  std::uint32_t partial(slot_id index) const noexcept { return slots_[index].partial; }
  std::uint32_t count_partial(slot_class of) const noexcept { return partial_[static_cast<std::size_t>(of)]; }
  // Whether so many more slots of the class may be partly written.
  bool may_begin(slot_class of, std::uint32_t slots = 1) const noexcept {
    const auto which = static_cast<std::size_t>(of);
    return partial_[which] + slots <= partial_max_[which];
  }

  // Frees a slot before its references are released; they become stale. Returns how many deliveries there
  // were. Returns nothing, and changes nothing, while the slot is partly written.
  std::optional<std::uint32_t> expire(slot_id index) noexcept;

  std::uint32_t in_use() const noexcept { return free_[0].in_use() + free_[1].in_use(); }
  std::uint64_t freed() const noexcept { return freed_; } // so far
  // True when the free lists and the counts agree. For tests and assertions.
  bool check() const noexcept;

 private:
  struct slot {
    std::uint32_t generation = 1;
    std::uint32_t references = 0;
    std::uint32_t partial = 0;
    bool tracked = false;
    bool pinned = false;
    bool binary = false;
    bool needed = false;
    slot_id next_free{};
    std::uint32_t bytes = 0;
    std::uint32_t body_at = 0;
    std::uint32_t body_bytes = 0;
    rt::time_point expires = rt::never;
    rt::time_point published{};
  };

  using free_slots = indexed_pool<slot_id, slot, &slot::next_free>;

  static std::uint32_t left_by(slot_use what) noexcept { return what == slot_use::stop ? 0 : kept_for_stop; }
  bool small(slot_id index) const noexcept { return index.value < small_count_; }
  char* base(slot_id index) const noexcept {
    const std::size_t at = small(index)
                               ? index.value * small_stride_
                               : small_count_ * small_stride_ + (index.value - small_count_) * large_stride_;
    return reinterpret_cast<char*>(memory_.data() + at + headroom_bytes);
  }
  void free(slot_id index) noexcept {
    slot& freed = slots_[index];
    assert(freed.partial == 0);
    freed.references = 0;
    if (++freed.generation == 0) freed.generation = 1;
    free_[static_cast<std::size_t>(class_of(index))].give_back(index);
    ++freed_;
  }

  rows<slot_id, slot> slots_;
  std::span<std::byte> memory_;
  std::size_t small_bytes_;
  std::size_t large_bytes_;
  std::size_t small_stride_;
  std::size_t large_stride_;
  std::uint32_t small_count_;
  std::array<free_slots, 2> free_;         // by class
  std::array<std::uint32_t, 2> partial_{}; // partly written slots, by class; and their limit
  std::array<std::uint32_t, 2> partial_max_{};
  std::uint64_t freed_ = 0;
};

} // namespace rowe::service
