// SPDX-License-Identifier: Apache-2.0
// Encoded messages on their way out. A message is encoded once into one slot, however many peers get it; each
// peer's queue holds the slot's number and generation. Service thread only, so slots are counted with plain
// integers.
//
// Two sizes, because most messages are small and a few are not: a message is encoded into a small slot and,
// if it does not fit, again into a large one. Each slot has room in front for a frame header and one node on
// the wheel; when its time is over it is freed whoever still has it queued, and those find a newer generation
// in its place. A slot that a socket has been given the first bytes of is held until the last one is out.
//
// One slot of each size class, beyond those that the limits name, is kept for the stop.
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

namespace rowe::service {

inline constexpr std::uint32_t no_index = UINT32_MAX;

struct slot_ref {
  std::uint32_t index = no_index;
  std::uint32_t generation = 0;
  friend bool operator==(const slot_ref&, const slot_ref&) = default;
};

enum class slot_class : std::uint8_t { small, large };
enum class slot_use : std::uint8_t { ordinary, stop };

class wire_slots {
 public:
  static constexpr std::size_t headroom_bytes = 16; // the longest frame header is 14
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
  wire_slots(rt::arena& memory, const limits& bounds) noexcept;

  std::uint32_t count() const noexcept { return slots_.size(); }

  // A free slot of at least `bytes`, with one reference; nothing when all of that size are taken.
  std::optional<std::uint32_t> take(std::size_t bytes, slot_use what = slot_use::ordinary) noexcept {
    free_slots& free = free_[static_cast<std::size_t>(class_for(bytes))];
    if (bytes > large_bytes_ || free.free() <= left_by(what)) return std::nullopt;
    const std::uint32_t index = free.take().value;
    slot& taken = slots_[slot_id{index}];
    taken.references = 1;
    taken.tracked = taken.kept = false;
    taken.bytes = taken.body_at = taken.body_bytes = 0;
    taken.expires = rt::never;
    return index;
  }
  // The class of the smallest slot for so many bytes.
  slot_class class_for(std::size_t bytes) const noexcept {
    return bytes <= small_bytes_ ? slot_class::small : slot_class::large;
  }
  slot_class class_of(std::uint32_t index) const noexcept {
    return small(index) ? slot_class::small : slot_class::large;
  }
  // How many of a class there are for ordinary use, and how many of those are free.
  std::uint32_t count(slot_class of) const noexcept {
    return of == slot_class::small ? small_count_ - kept_for_stop : count() - small_count_ - kept_for_stop;
  }
  std::uint32_t free_for_all(slot_class of) const noexcept {
    return std::max(free_[static_cast<std::size_t>(of)].free(), kept_for_stop) - kept_for_stop;
  }
  // Whether there is one for so many bytes, a large one if need be.
  bool has_free(std::size_t bytes) const noexcept {
    return (bytes <= small_bytes_ && free_for_all(slot_class::small) != 0) ||
           free_for_all(slot_class::large) != 0;
  }
  std::size_t bytes_of(slot_class of) const noexcept {
    return of == slot_class::small ? small_bytes_ : large_bytes_;
  }
  std::size_t small_bytes() const noexcept { return small_bytes_; }
  std::size_t large_bytes() const noexcept { return large_bytes_; }

  // The whole room of a slot, to encode into; finish() says what of it was used, and mark_body() where in it
  // the body of a topic's message lies.
  std::span<char> room(std::uint32_t index) noexcept {
    return {base(index), small(index) ? small_bytes_ : large_bytes_};
  }
  void finish(std::uint32_t index, std::size_t bytes, rt::time_point expires) noexcept {
    assert(bytes <= room(index).size());
    slots_[slot_id{index}].bytes = static_cast<std::uint32_t>(bytes);
    slots_[slot_id{index}].expires = expires;
  }
  void mark_body(std::uint32_t index, std::size_t at, std::size_t bytes) noexcept {
    assert(at + bytes <= slots_[slot_id{index}].bytes);
    slots_[slot_id{index}].body_at = static_cast<std::uint32_t>(at);
    slots_[slot_id{index}].body_bytes = static_cast<std::uint32_t>(bytes);
  }

  slot_ref ref(std::uint32_t index) const noexcept { return {index, slots_[slot_id{index}].generation}; }
  // False once the slot was freed, whether used again or not.
  bool alive(slot_ref ref) const noexcept { return slots_[slot_id{ref.index}].generation == ref.generation; }
  rt::time_point expires(std::uint32_t index) const noexcept { return slots_[slot_id{index}].expires; }
  std::span<char> text(std::uint32_t index) noexcept { return {base(index), slots_[slot_id{index}].bytes}; }
  std::span<const char> body(std::uint32_t index) const noexcept {
    return {base(index) + slots_[slot_id{index}].body_at, slots_[slot_id{index}].body_bytes};
  }

  void retain(std::uint32_t index) noexcept { ++slots_[slot_id{index}].references; }
  std::uint32_t references(std::uint32_t index) const noexcept { return slots_[slot_id{index}].references; }
  // Somebody wants to know what becomes of the message. With `keeps` one of the references is that
  // somebody's, which is no delivery: expire() does not count it.
  void track(std::uint32_t index, bool keeps) noexcept {
    slots_[slot_id{index}].tracked = true;
    slots_[slot_id{index}].kept = keeps;
  }
  void untrack(std::uint32_t index) noexcept {
    slots_[slot_id{index}].tracked = slots_[slot_id{index}].kept = false;
  }
  // Gives the reference back that is no delivery. Never the last one.
  void unkeep(std::uint32_t index) noexcept {
    assert(slots_[slot_id{index}].references > 1);
    slots_[slot_id{index}].kept = false;
    --slots_[slot_id{index}].references;
  }
  bool tracked(std::uint32_t index) const noexcept { return slots_[slot_id{index}].tracked; }
  bool kept(std::uint32_t index) const noexcept { return slots_[slot_id{index}].kept; }
  // True when that was the last reference, and the slot is free again.
  bool release(std::uint32_t index) noexcept {
    assert(slots_[slot_id{index}].references > 0);
    if (--slots_[slot_id{index}].references != 0) return false;
    free(index);
    return true;
  }

  // A socket has the first bytes: expire() must not free the slot under it.
  void begin(std::uint32_t index) noexcept {
    if (slots_[slot_id{index}].begun++ == 0) ++begun_[static_cast<std::size_t>(class_of(index))];
  }
  void end(std::uint32_t index) noexcept {
    if (--slots_[slot_id{index}].begun == 0) --begun_[static_cast<std::size_t>(class_of(index))];
  }
  std::uint32_t begun(std::uint32_t index) const noexcept { return slots_[slot_id{index}].begun; }
  std::uint32_t count_begun(slot_class of) const noexcept { return begun_[static_cast<std::size_t>(of)]; }
  // Whether sockets may have one more slot of the class.
  bool may_begin(slot_class of) const noexcept {
    const auto which = static_cast<std::size_t>(of);
    return begun_[which] < begun_max_[which];
  }

  // Frees a slot before its references are released: they go stale. Returns how many deliveries there were;
  // nothing, and no change, when a socket is in the middle of it.
  std::optional<std::uint32_t> expire(std::uint32_t index) noexcept;

  std::uint32_t in_use() const noexcept { return free_[0].in_use() + free_[1].in_use(); }
  std::uint64_t freed() const noexcept { return freed_; } // so far
  // True when the free lists and the counts agree. For tests and assertions.
  bool check() const noexcept;

 private:
  struct slot {
    std::uint32_t generation = 1;
    std::uint32_t references = 0;
    std::uint32_t begun = 0;
    bool tracked = false;
    bool kept = false;
    slot_id next_free{};
    std::uint32_t bytes = 0;
    std::uint32_t body_at = 0;
    std::uint32_t body_bytes = 0;
    rt::time_point expires = rt::never;
  };

  using free_slots = indexed_pool<slot_id, slot, &slot::next_free>;

  static std::uint32_t left_by(slot_use what) noexcept { return what == slot_use::stop ? 0 : kept_for_stop; }
  bool small(std::uint32_t index) const noexcept { return index < small_count_; }
  char* base(std::uint32_t index) const noexcept {
    const std::size_t at = small(index)
                               ? index * small_stride_
                               : small_count_ * small_stride_ + (index - small_count_) * large_stride_;
    return reinterpret_cast<char*>(memory_.data() + at + headroom_bytes);
  }
  void free(std::uint32_t index) noexcept {
    slot& freed = slots_[slot_id{index}];
    assert(freed.begun == 0);
    freed.references = 0;
    if (++freed.generation == 0) freed.generation = 1;
    free_[static_cast<std::size_t>(class_of(index))].give_back(slot_id{index});
    ++freed_;
  }

  rows<slot_id, slot> slots_;
  std::span<std::byte> memory_;
  std::size_t small_bytes_;
  std::size_t large_bytes_;
  std::size_t small_stride_;
  std::size_t large_stride_;
  std::uint32_t small_count_;
  std::array<free_slots, 2> free_;       // by class
  std::array<std::uint32_t, 2> begun_{}; // slots, by class; and how many there may be
  std::array<std::uint32_t, 2> begun_max_{};
  std::uint64_t freed_ = 0;
};

} // namespace rowe::service
