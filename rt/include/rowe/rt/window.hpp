// SPDX-License-Identifier: Apache-2.0
// The newest value from one thread to one other: a write never finds it full, a read never finds it torn. It
// is for state of which only the latest value matters. Simpson's four-slot mechanism (Four-slot fully
// asynchronous communication mechanism, IEE Proceedings E, 1990): two pairs of two slots; the writer goes to
// the pair the reader is not in, and there to the slot that was not written last; the reader goes to the pair
// written last, announces that, and takes that pair's newest slot.
//
// Why no slot is written while it is read. The reader stores `reading`, then loads `newest` of that pair; the
// writer stores `newest`, then (at its next write) loads `reading`. These four accesses are seq_cst, so of
// the two threads at least one sees the other: either the writer sees the reader's pair and keeps out of it,
// or it looked earlier, and then it is at work in the slot of the pair that `newest` does not name, while the
// reader takes the one it does. With any of the four weakened both may miss each other.
//
// Wait-free on both sides: no loop, and no instruction that loops in hardware either (loads, stores and, on
// x86, one exchange a side). The numbers of values are kept with the slots, so the reader knows exactly which
// value it has, never takes one twice and never goes back.
//
// window_core deals in slot numbers and leaves the payload to its caller, who may keep slots of a size known
// only at run time; window<T> adds the slots.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe::rt {

// What a reader found.
enum class freshness : std::uint8_t {
  empty,     // nothing has been written yet
  unchanged, // what was read last is still the newest
  fresh,     // a value not read before
};

template <class Atomics = std_atomics>
class window_core;

// The end of a window_core that writes. One thread at a time; passing it to another thread needs
// synchronisation of its own. A base of the core, so that the shared words lie at fixed distances and no load
// stands before theirs.
template <class Atomics>
class core_writer {
 public:
  // The slot, 0 to 3, that may be written until end_write(). Never waits, never allocates, cannot fail.
  [[nodiscard]] ROWE_RT std::uint32_t begin_write() noexcept {
    pair_ = core().reading_.load(std::memory_order_seq_cst) ^ 1U;
    return 2 * pair_ + (newest_[pair_] ^ 1U);
  }

  // Makes `slot`, the one begin_write() gave, the newest. Never waits, never allocates, cannot fail.
  ROWE_RT void end_write([[maybe_unused]] std::uint32_t slot) noexcept {
    assert(slot == 2 * pair_ + (newest_[pair_] ^ 1U));
    newest_[pair_] ^= 1U;
    ++sequence_;
    core().sequence_of_[2 * pair_ + newest_[pair_]].store(sequence_);
    core().shared_newest_[pair_].store(static_cast<std::uint8_t>(newest_[pair_]), std::memory_order_seq_cst);
    // release, both: pair with the acquires in begin_read
    core().latest_.store(static_cast<std::uint8_t>(pair_), std::memory_order_release);
    core().shared_sequence_.store(sequence_, std::memory_order_release);
  }

  // How many values were written.
  ROWE_RT std::uint64_t sequence() const noexcept { return sequence_; }

  core_writer(const core_writer&) = delete;
  core_writer& operator=(const core_writer&) = delete;

 private:
  friend class window_core<Atomics>;
  core_writer() noexcept = default;

  window_core<Atomics>& core() noexcept { return static_cast<window_core<Atomics>&>(*this); }

  // What the shared words say; kept here so as not to load their line.
  alignas(line_bytes) std::uint64_t sequence_ = 0;
  std::uint32_t newest_[2] = {0, 0};
  std::uint32_t pair_ = 0; // being written
  typename Atomics::template variable<bool> taken_{false};
};

// The end of a window_core that reads. One thread at a time, as above.
template <class Atomics>
class core_reader {
 public:
  // Which slot to read. `slot` is meaningless when empty. `sequence` is the number of its value, counted from
  // 1; two that are not neighbours mean that values in between were overwritten unread.
  struct view {
    freshness state;
    std::uint32_t slot;
    std::uint64_t sequence;
  };

  // The slot of the newest value. It stays as it is until begin_read() next answers `fresh`, so `unchanged`
  // names the slot of before, still readable. Never waits, never allocates.
  [[nodiscard]] ROWE_RT view begin_read() noexcept {
    // acquire, both: pair with the releases in end_write, so that the words below are at least as new. The
    // number is stored last, so the value may have been read before its number arrives, which then lags
    // behind.
    const std::uint64_t sequence = core().shared_sequence_.load(std::memory_order_acquire);
    if (sequence <= sequence_)
      return {sequence_ == 0 ? freshness::empty : freshness::unchanged, slot_, sequence_};
    const std::uint8_t pair = core().latest_.load(std::memory_order_acquire);
    core().reading_.store(pair, std::memory_order_seq_cst);
    slot_ = 2U * pair + core().shared_newest_[pair].load(std::memory_order_seq_cst);
    sequence_ = core().sequence_of_[slot_].load();
    return {freshness::fresh, slot_, sequence_};
  }

  // The number of the value that begin_read() named last; 0 before the first.
  ROWE_RT std::uint64_t sequence() const noexcept { return sequence_; }

  core_reader(const core_reader&) = delete;
  core_reader& operator=(const core_reader&) = delete;

 private:
  friend class window_core<Atomics>;
  core_reader() noexcept = default;

  window_core<Atomics>& core() noexcept { return static_cast<window_core<Atomics>&>(*this); }

  alignas(line_bytes) std::uint64_t sequence_ = 0; // of the value read last
  std::uint32_t slot_ = 0;                         // where it lies
  typename Atomics::template variable<bool> taken_{false};
};

// Which of four slots to write and to read. Neither copied nor moved; nothing to destroy.
template <class Atomics>
class window_core : protected core_writer<Atomics>, protected core_reader<Atomics> {
 public:
  using writer = core_writer<Atomics>;
  using reader = core_reader<Atomics>;
  using view = typename reader::view;
  static constexpr std::uint32_t slot_count = 4;

  window_core() noexcept = default;
  window_core(const window_core&) = delete;
  window_core& operator=(const window_core&) = delete;

  // Set-up, any thread. Each end is given out once; nullptr afterwards. The pointer is good as long as this
  // is.
  writer* take_writer() noexcept {
    return writer::taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : this;
  }
  reader* take_reader() noexcept {
    return reader::taken_.exchange(true, std::memory_order_seq_cst) ? nullptr : this;
  }

  // The invariant that is broken, or nullptr. Only while no thread is inside either end.
  const char* check() const noexcept {
    const std::uint64_t sequence = shared_sequence_.load(std::memory_order_acquire); // pairs with end_write
    const std::uint8_t latest = latest_.load(std::memory_order_acquire);             // pairs with end_write
    if (latest > 1 || reading_.load(std::memory_order_seq_cst) > 1) return "a pair is 0 or 1";
    for (unsigned pair = 0; pair < 2; ++pair)
      if (shared_newest_[pair].load(std::memory_order_seq_cst) != writer::newest_[pair])
        return "the newest slot that is shared is the writer's own";
    if (sequence != writer::sequence_) return "the number that is shared is the writer's own";
    if (reader::sequence_ > sequence) return "nothing was read that was not written";
    if (sequence != 0 && sequence_of_[2U * latest + writer::newest_[latest]].load() != sequence)
      return "the newest slot holds the newest value";
    if (reader::sequence_ != 0 && sequence_of_[reader::slot_].load() != reader::sequence_)
      return "the slot that was read last is as it was";
    return nullptr;
  }

 private:
  friend writer;
  friend reader;
  using bit = typename Atomics::template variable<std::uint8_t>;
  using word = typename Atomics::template variable<std::uint64_t>;

  // Written by the writer. They stand together because they are always stored and loaded together.
  alignas(line_bytes) typename Atomics::template plain<std::uint64_t> sequence_of_[slot_count];
  bit shared_newest_[2];                        // the slot written last, of each pair
  bit latest_{0};                               // the pair written last
  alignas(line_bytes) word shared_sequence_{0}; // written by the writer, last; all that a reader polls
  alignas(line_bytes) bit reading_{0};          // the pair being read; written by the reader
};

template <class T, class Atomics = std_atomics>
class window;

// The end of a window that writes. One thread at a time, as above.
template <class T, class Atomics>
class window_writer {
 public:
  // Never waits, never allocates, cannot fail.
  ROWE_RT void write(const T& value) noexcept {
    auto& shared = static_cast<window<T, Atomics>&>(*this);
    core_writer<Atomics>& end = shared;
    const std::uint32_t slot = end.begin_write();
    shared.slots_[slot].payload.store(value);
    end.end_write(slot);
  }

  // How many values were written.
  ROWE_RT std::uint64_t sequence() const noexcept {
    const core_writer<Atomics>& end = static_cast<const window<T, Atomics>&>(*this);
    return end.sequence();
  }

  window_writer(const window_writer&) = delete;
  window_writer& operator=(const window_writer&) = delete;

 private:
  friend class window<T, Atomics>;
  window_writer() noexcept = default;
};

// The end of a window that reads. One thread at a time, as above.
template <class T, class Atomics>
class window_reader {
 public:
  // Copies the newest value to `value` when it is fresh, else leaves `value` alone. Never waits, never
  // allocates.
  [[nodiscard]] ROWE_RT freshness read(T& value) noexcept {
    auto& shared = static_cast<window<T, Atomics>&>(*this);
    core_reader<Atomics>& end = shared;
    const auto found = end.begin_read();
    if (found.state == freshness::fresh) value = shared.slots_[found.slot].payload.load();
    return found.state;
  }

  // The number of the value read last, counted from 1; 0 before the first.
  ROWE_RT std::uint64_t sequence() const noexcept {
    const core_reader<Atomics>& end = static_cast<const window<T, Atomics>&>(*this);
    return end.sequence();
  }

  window_reader(const window_reader&) = delete;
  window_reader& operator=(const window_reader&) = delete;

 private:
  friend class window<T, Atomics>;
  window_reader() noexcept = default;
};

// The newest T. Neither copied nor moved; nothing to destroy.
template <class T, class Atomics>
class window : window_core<Atomics>, window_writer<T, Atomics>, window_reader<T, Atomics> {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  using value_type = T;
  using core = window_core<Atomics>;
  using writer = window_writer<T, Atomics>;
  using reader = window_reader<T, Atomics>;

  window() noexcept = default;
  window(const window&) = delete;
  window& operator=(const window&) = delete;

  // Set-up, any thread. Each end is given out once; nullptr afterwards. The pointer is good as long as this
  // is.
  writer* take_writer() noexcept { return core::take_writer() == nullptr ? nullptr : this; }
  reader* take_reader() noexcept { return core::take_reader() == nullptr ? nullptr : this; }

  // The invariant that is broken, or nullptr. Only while no thread is inside either end.
  const char* check() const noexcept { return core::check(); }

 private:
  friend writer;
  friend reader;

  // Apart, so that the reader's copying of one does not slow the writer's filling of the next.
  struct alignas(line_bytes) slot {
    typename Atomics::template plain<T> payload;
  };
  slot slots_[core::slot_count];
};

} // namespace rowe::rt
