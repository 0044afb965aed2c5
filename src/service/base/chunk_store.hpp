// SPDX-License-Identifier: Apache-2.0
// The texts of long messages: those that are too long for a slot. A text lies in chunks of a pool of its own,
// and whoever needs it holds a reference: a message that is being received, messages on their way out, and
// the last value of a latched topic. Nothing is copied between these.
//
// The memory of the pool is given from outside, and may have to be opened before it is used. A chunk is not
// touched before it is first used, so an endpoint whose messages are short never pays for it.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/base/indexed_pool.hpp"
#include "service/base/shares.hpp"
#include "service/base/transport.hpp"

namespace rowe::service {

// Makes the memory of a pool usable. A step of it takes some system calls, and touches no page.
class pool_opener {
 public:
  // The first so many bytes; never fewer than before. False: the system has no memory for them.
  virtual bool open(std::size_t bytes) noexcept = 0;

 protected:
  ~pool_opener() = default;
};

class chunk_store {
 public:
  static constexpr std::size_t chunk_bytes = 16 * 1024;

  static constexpr std::uint32_t chunks_for(std::size_t bytes) noexcept {
    return static_cast<std::uint32_t>((bytes + chunk_bytes - 1) / chunk_bytes);
  }
  // Whether there are long messages at all.
  static bool in_use(const limits& bounds) noexcept {
    return bounds.long_message_bytes_max > bounds.message_bytes_max;
  }
  // In front of the chunks there is a place for one text in one piece that is no long one, with what may be
  // read behind it. Who uses it has used a chunk before.
  static std::size_t whole_bytes(const limits& bounds) noexcept {
    return in_use(bounds) ? bounds.message_bytes_max + tailroom_bytes : 0;
  }
  // How many chunks there are: as many longest messages as there are slots for long ones.
  static std::uint32_t chunk_count(const limits& bounds) noexcept;
  // The pool's memory, and what the store itself takes of the arena.
  static std::size_t pool_bytes(const limits& bounds) noexcept {
    return std::size_t{chunk_count(bounds)} * chunk_bytes + whole_bytes(bounds);
  }
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  // `pool` has pool_bytes(), or is empty: then there are no long messages. `opener`: none, if all of it can
  // be used.
  chunk_store(rt::arena& memory, std::span<std::byte> pool, const limits& bounds,
              pool_opener* opener = nullptr) noexcept;

  // The longest text; 0: there are no long messages.
  std::size_t text_bytes_max() const noexcept { return text_bytes_max_; }
  std::uint32_t chunks() const noexcept { return links_.size(); }
  std::uint32_t free() const noexcept { return chunks() - in_use_; }

  // Of the chunks, a quarter is for messages that are being received. Whoever receives says how many those
  // have.
  std::uint32_t receiving() const noexcept { return receiving_; }
  std::uint32_t receiving_max() const noexcept { return reserve_of(chunks()); }
  void begin_receiving(std::uint32_t count) noexcept { receiving_ += count; }
  void end_receiving(std::uint32_t count) noexcept { receiving_ -= count; }
  // How many are free for anything else. Negative: what was received has made it so.
  std::int64_t left() const noexcept { return std::int64_t{free()} + receiving_ - receiving_max(); }

  // A new text of no bytes, with one reference, and chunks for `bytes_max`. None: the store has no room.
  text_id begin(std::size_t bytes_max) noexcept;
  // Adds chunks, so that the text may have `bytes_max`. False: there are not so many.
  bool grow(text_id text, std::size_t bytes_max) noexcept;
  // Adds bytes, for which there are chunks.
  void append(text_id text, std::span<const std::byte> bytes) noexcept;
  // Keeps only the bytes from `at` on, so many; gives back chunks that have none of them.
  void cut(text_id text, std::size_t at, std::size_t bytes) noexcept;

  void retain(text_id text) noexcept { ++texts_[text].references; }
  void release(text_id text) noexcept {
    assert(texts_[text].references > 0);
    if (--texts_[text].references == 0) free(text);
  }
  std::uint32_t references(text_id text) const noexcept { return texts_[text].references; }

  std::size_t bytes(text_id text) const noexcept { return texts_[text].bytes; }
  std::uint32_t chunks_of(text_id text) const noexcept { return texts_[text].chunks; }

  // Where a reader is in a text. A new one is at its beginning.
  struct place {
    chunk_id chunk{};         // none: the first
    std::size_t chunk_at = 0; // where in the text the chunk begins
  };
  // The bytes from `at` on that lie together: at least one where `at` is within the text. A reader goes
  // forward: `at` is not before the place, which is moved.
  std::span<const std::byte> read(text_id text, std::size_t at, place& from) const noexcept;
  // Copies bytes of the text, from `at` on.
  void copy(text_id text, std::size_t at, place& from, std::span<std::byte> into) const noexcept;

  // The place for a text in one piece.
  std::span<std::byte> whole() const noexcept { return whole_; }

  // No chunk is lost, and none belongs to two texts. For tests.
  bool check() const noexcept;
  std::uint32_t texts() const noexcept { return free_.in_use(); }

 private:
  struct chain {
    chunk_id first{};
    chunk_id last_written{}; // where append() goes on
    std::uint32_t chunks = 0;
    std::uint32_t references = 0;
    std::uint32_t begins_at = 0; // in the first chunk
    std::uint32_t end_at = 0;    // in the last chunk that was written to
    std::size_t bytes = 0;
    text_id next_free{};
  };
  static std::size_t text_count(const limits& bounds) noexcept;

  std::span<std::byte> bytes_of(chunk_id chunk) const noexcept {
    return chunks_.subspan(chunk.value * chunk_bytes, chunk_bytes);
  }
  bool open_for(std::uint32_t chunks) noexcept;
  chunk_id take_chunk() noexcept;
  void give_back(chunk_id first, chunk_id end) noexcept;
  void free(text_id text) noexcept;

  std::size_t text_bytes_max_;
  std::span<std::byte> whole_;
  std::span<std::byte> chunks_;
  rows<chunk_id, chunk_id> links_; // to the next one of the same text, or the next free one
  chunk_id free_chunk_{};          // of those that were used before; the others come in their order
  std::uint32_t untouched_ = 0;
  pool_opener* opener_;
  std::uint32_t open_; // can be used
  std::uint32_t in_use_ = 0;
  std::uint32_t receiving_ = 0; // of those
  rows<text_id, chain> texts_;
  indexed_pool<text_id, chain, &chain::next_free> free_;
};

} // namespace rowe::service
