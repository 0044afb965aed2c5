// SPDX-License-Identifier: Apache-2.0
// Slots for encoded messages on their way out. A message is encoded once into one slot, however many peers
// get it. Each peer's queue holds the slot's number and generation. Only the service thread uses slots, so
// plain integers count references.
//
// There are two sizes, because most messages are small and a few are not. A message is encoded into a small
// slot; if it does not fit, it is encoded again into a large one. Of a long message the slot has only the
// envelope; its body is a text in chunks (chunk_store.hpp), which the slot refers to. Each slot has headroom
// for a frame header, and one node on the wheel. An expired slot is freed even while it is queued; the queues
// then find a newer generation in its place. When a socket has taken the first bytes of a slot, the slot
// stays until the socket has all of it.
//
// One slot of each of the two sizes is reserved for the stop, in addition to those that the limits name.
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

#include "service/base/chunk_store.hpp"
#include "service/base/indexed_pool.hpp"
#include "wire/codec/time_to_live.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {

struct slot_ref {
  slot_id index{};
  std::uint32_t generation = 0;
  friend bool operator==(const slot_ref&, const slot_ref&) = default;
};

// When a message expires, and whether peers get the rest of its time to live.
struct message_lifetime {
  rt::time_point expires = rt::never;
  bool carries_ttl = false;

  message_lifetime() noexcept = default; // for ever
  explicit message_lifetime(rt::time_point when) noexcept : expires{when} {}
  // Of a message whose time to live is over then. It expires a unit earlier, so that no frame says 0.
  static message_lifetime with_ttl(rt::time_point over) noexcept {
    message_lifetime made{over == rt::never ? over : over - wire::ttl_unit};
    made.carries_ttl = over != rt::never;
    return made;
  }
  // The same for a topic's message. One that expires now is sent now or never, and then it is as it was.
  static message_lifetime of_topic(rt::time_point over, rt::time_point now) noexcept {
    return over == now ? message_lifetime{now} : with_ttl(over);
  }
  // When the time to live is over.
  rt::time_point ttl_over() const noexcept { return carries_ttl ? expires + wire::ttl_unit : expires; }
};

enum class slot_class : std::uint8_t { small, large, chunked };
inline constexpr std::size_t slot_classes = 3;
inline constexpr std::size_t index_of(slot_class of) noexcept { return static_cast<std::size_t>(of); }
// One of something for each class.
template <class T>
using by_class = std::array<T, slot_classes>;
enum class slot_use : std::uint8_t { ordinary, stop };
// The part that announces again what was in a message that the peer lost.
enum class announcer : std::uint8_t { none, listings, connection_graph, parameters };
inline constexpr std::size_t announcers = 4;

class slot_pool {
 public:
  static constexpr std::size_t headroom_bytes = wire::frame_headroom_bytes;
  static constexpr std::uint32_t reserved_for_stop = 1; // of each class, but of chunked ones

  // Slots are numbered from 0, small ones first, and chunked ones last.
  static std::uint32_t first_large(const limits& bounds) noexcept {
    return bounds.small_slots + reserved_for_stop;
  }
  static std::uint32_t first_chunked(const limits& bounds) noexcept {
    return first_large(bounds) + bounds.large_slots + reserved_for_stop;
  }
  static std::size_t count(const limits& bounds) noexcept {
    return std::size_t{first_chunked(bounds)} + (chunk_store::in_use(bounds) ? bounds.long_slots : 0);
  }

  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  static std::size_t large_bytes(const limits& bounds) noexcept; // of a large slot
  // `texts`: what chunked slots refer to.
  slot_pool(rt::arena& memory, chunk_store& texts, const limits& bounds) noexcept;

  std::uint32_t count() const noexcept { return slots_.size(); }
  auto ids() const noexcept { return slots_.ids(); }

  // Takes a free slot of one of the two sizes, with one reference. None: all of them are taken.
  slot_id take(slot_class of, slot_use what = slot_use::ordinary) noexcept {
    free_slots& free = free_[index_of(of)];
    return free.free() <= left_by(what) ? slot_id{} : begin_use(free.take());
  }
  // Takes a slot for a message whose body is this text, to which it holds a reference. None: all are taken.
  slot_id take_chunked(text_id body) noexcept {
    free_slots& free = free_[index_of(slot_class::chunked)];
    if (free.empty()) return {};
    const slot_id index = begin_use(free.take());
    slots_[index].chunks = body;
    chunks_.retain(body);
    return index;
  }
  // The class of the smallest slot for so many bytes.
  slot_class class_for(std::size_t bytes) const noexcept {
    return bytes <= bytes_of(slot_class::small) ? slot_class::small : slot_class::large;
  }
  slot_class class_of(slot_id index) const noexcept {
    return static_cast<slot_class>((small(index) ? 0U : 1U) + (chunked(index) ? 1U : 0U));
  }
  bool chunked(slot_id index) const noexcept { return index.value >= first_chunked_; }
  // How many slots of a class are for ordinary use, and how many of those are free.
  std::uint32_t count(slot_class of) const noexcept {
    return free_[index_of(of)].size() - kept_[index_of(of)];
  }
  std::uint32_t free_for_all(slot_class of) const noexcept {
    const std::uint32_t kept = kept_[index_of(of)];
    return std::max(free_[index_of(of)].free(), kept) - kept;
  }
  std::size_t bytes_of(slot_class of) const noexcept { return bytes_[index_of(of)]; }
  std::size_t large_bytes() const noexcept { return bytes_of(slot_class::large); }

  // The capacity of a slot, to encode into. finish() says how much of it is used; mark_body() says where the
  // body of a topic's message lies.
  std::span<char> buffer(slot_id index) noexcept { return buffer(index, class_of(index)); }
  std::span<char> buffer(slot_id index, slot_class of) noexcept { return {base(index), bytes_of(of)}; }
  void finish(slot_id index, std::size_t bytes, const message_lifetime& lifetime,
              bool binary = false) noexcept {
    assert(bytes <= buffer(index).size());
    slots_[index].binary = binary;
    slots_[index].bytes = static_cast<std::uint32_t>(bytes);
    slots_[index].lifetime = lifetime;
  }
  void mark_body(slot_id index, std::size_t at, std::size_t bytes, rt::time_point published) noexcept {
    assert(at + bytes <= slots_[index].bytes);
    slots_[index].published = published;
    slots_[index].body_at = static_cast<std::uint32_t>(at);
    slots_[index].body_bytes = static_cast<std::uint32_t>(bytes);
  }
  // Of a chunked slot: the body goes between the bytes of its text before `at` and those from there on.
  void mark_chunks(slot_id index, std::size_t at, rt::time_point published) noexcept {
    assert(chunked(index) && at <= slots_[index].bytes);
    slots_[index].published = published;
    slots_[index].body_at = static_cast<std::uint32_t>(at);
  }
  text_id chunks(slot_id index) const noexcept { return slots_[index].chunks; }
  std::size_t chunks_at(slot_id index) const noexcept { return slots_[index].body_at; }
  // Of the whole message, without its frames' headers.
  std::size_t message_bytes(slot_id index) const noexcept {
    return slots_[index].bytes + (chunked(index) ? chunks_.bytes(slots_[index].chunks) : 0);
  }

  // The message is one that its codec writes whole (wire::codec): it has no body that others could get.
  void mark_whole(slot_id index, rt::time_point published) noexcept {
    slots_[index].published = published;
    slots_[index].body_at = whole_mark;
  }
  bool whole(slot_id index) const noexcept { return slots_[index].body_at == whole_mark; }

  slot_ref ref(slot_id index) const noexcept { return {index, slots_[index].generation}; }
  // False once the slot was freed, even if it is in use again.
  bool alive(slot_ref ref) const noexcept { return slots_[ref.index].generation == ref.generation; }
  rt::time_point expires(slot_id index) const noexcept { return slots_[index].lifetime.expires; }
  const message_lifetime& lifetime(slot_id index) const noexcept { return slots_[index].lifetime; }
  // Whether the message is sent in a binary frame, and when the value in its body was published.
  bool binary(slot_id index) const noexcept { return slots_[index].binary; }
  rt::time_point published(slot_id index) const noexcept { return slots_[index].published; }
  // What the message says must reach its peer. Whoever evicts it records that, and this part announces it
  // again.
  void set_announcer(slot_id index, announcer by) noexcept { slots_[index].by = by; }
  announcer announcer_of(slot_id index) const noexcept { return slots_[index].by; }
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
    if (slots_[index].partial++ == 0) ++partial_[index_of(class_of(index))];
  }
  void end(slot_id index) noexcept {
    if (--slots_[index].partial == 0) --partial_[index_of(class_of(index))];
  }
  std::uint32_t partial(slot_id index) const noexcept { return slots_[index].partial; }
  std::uint32_t count_partial(slot_class of) const noexcept { return partial_[index_of(of)]; }
  // Whether so many more slots of the class may be partly written.
  bool may_begin(slot_class of, std::uint32_t slots = 1) const noexcept {
    const std::size_t which = index_of(of);
    return partial_[which] + slots <= partial_max_[which];
  }

  // Frees a slot before its references are released; they become stale. Returns how many deliveries there
  // were. Returns nothing, and changes nothing, while the slot is partly written.
  std::optional<std::uint32_t> expire(slot_id index) noexcept;

  std::uint32_t in_use() const noexcept { return free_[0].in_use() + free_[1].in_use() + free_[2].in_use(); }
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
    announcer by = announcer::none;
    slot_id next_free{};
    std::uint32_t bytes = 0;
    std::uint32_t body_at = 0;
    std::uint32_t body_bytes = 0;
    message_lifetime lifetime;
    rt::time_point published{};
    text_id chunks{};       // of a chunked slot: its body
    std::uint32_t line = 0; // of the memory, where its headroom begins
  };

  static constexpr std::uint32_t whole_mark = UINT32_MAX;

  using free_slots = indexed_pool<slot_id, slot, &slot::next_free>;

  static std::uint32_t left_by(slot_use what) noexcept {
    return what == slot_use::stop ? 0 : reserved_for_stop;
  }
  bool small(slot_id index) const noexcept { return index.value < small_count_; }
  char* base(slot_id index) const noexcept {
    return reinterpret_cast<char*>(memory_.data()) + slots_[index].line * rt::line_bytes + headroom_bytes;
  }
  slot_id begin_use(slot_id index) noexcept {
    slot& taken = slots_[index];
    taken.references = 1;
    taken.tracked = taken.pinned = false;
    taken.by = announcer::none;
    taken.bytes = taken.body_at = taken.body_bytes = 0;
    taken.lifetime = {};
    return index;
  }
  void free(slot_id index) noexcept {
    slot& freed = slots_[index];
    assert(freed.partial == 0);
    freed.references = 0;
    if (++freed.generation == 0) freed.generation = 1;
    ++freed_;
    if (freed.chunks) [[unlikely]]
      return give_back_chunked(index);
    free_[small(index) ? 0 : 1].give_back(index);
  }
  void give_back_chunked(slot_id index) noexcept;

  rows<slot_id, slot> slots_;
  std::span<std::byte> memory_;
  chunk_store& chunks_;
  by_class<std::size_t> bytes_; // a chunked one has an envelope
  by_class<std::uint32_t> kept_{reserved_for_stop, reserved_for_stop, 0};
  std::uint32_t small_count_;
  std::uint32_t first_chunked_;
  by_class<free_slots> free_;
  by_class<std::uint32_t> partial_{}; // partly written slots, and their limit
  by_class<std::uint32_t> partial_max_{};
  std::uint64_t freed_ = 0;
};

} // namespace rowe::service
