// SPDX-License-Identifier: Apache-2.0
// Room recording: what endpoints and programs record, on its way from a thread that must not wait to the
// disk. Knows no endpoint. The feed: from the thread that has messages to the one that writes them. A record
// is a head and bytes, in whole lines of a ring. It goes in whole or not at all, and what did not is counted
// by topic; the reader learns of that in the same order. Wait-free for who puts records in, who allocates
// nothing.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/spsc_ring.hpp>

namespace rowe::recording {

enum class record_kind : std::uint16_t {
  topic,      // its name, type and JSON Schema, each behind its length (std::uint32_t)
  typed,      // the same, with the address of a schema_description in place of the schema
  message,    // its text
  long_begin, // a message in parts: how many bytes it has (std::uint64_t)
  long_part,  // a part of it
  lost,       // `count` messages of the topic had no room
  snapshot,   // the cause for which a black box is asked to write
};

struct record_head {
  std::uint32_t bytes = 0; // that follow
  record_kind kind{};
  std::uint16_t place = 0; // of a message in parts: tells several at a time apart
  std::uint32_t topic = 0;
  std::uint32_t count = 0;
  std::int64_t logged_ns = 0;
  std::int64_t published_ns = 0;
};

inline constexpr std::size_t long_places = 4;

struct record_line {
  std::array<char, 64> bytes;
};

// One thread at a time puts records in, one other takes them out.
class feed {
 public:
  // Takes its memory at once. Check operator bool. Topics have numbers below `topics`.
  feed(std::size_t bytes, std::size_t topics);
  feed(const feed&) = delete;
  feed& operator=(const feed&) = delete;
  explicit operator bool() const noexcept { return ring_ != nullptr; }
  int map_errno() const noexcept { return memory_.map_errno(); }

  // ---- who has messages

  // Whether a record of so many bytes could ever go in.
  bool fits(std::size_t bytes) const noexcept { return lines_of(bytes) + 1 <= lines_; }
  bool has_room(std::size_t bytes) noexcept { return room() >= lines_of(bytes) + 1; }
  // False: there is no room. Of a message it is counted, and a later record says so.
  ROWE_RT bool put(record_head head, std::span<const std::string_view> content) noexcept;
  // A message in parts of `part_bytes` at most, which go in for certain once this was true: there is room for
  // all. `head` has its kind, topic, place and times.
  ROWE_RT bool begin_long(record_head head, std::uint64_t bytes, std::size_t part_bytes) noexcept;
  ROWE_RT void put_part(std::uint16_t place, std::string_view part) noexcept;
  ROWE_RT void count_lost(std::uint32_t topic, std::uint64_t count) noexcept;
  // Asks for a snapshot. While one is on its way, it does for another one, too. False: there is no room.
  ROWE_RT bool ask_for_snapshot(std::string_view cause, std::int64_t now_ns) noexcept;
  // Puts in what could not be said yet of what was lost: of all topics whose names were put in, or of one.
  // False: there is still no room for that.
  bool put_lost(std::int64_t logged_ns) noexcept;
  bool put_lost_of(std::uint32_t topic, std::int64_t logged_ns) noexcept;
  std::uint64_t lost() const noexcept { return lost_total_.get(); } // any thread
  std::uint64_t waiting_bytes() const noexcept {                    // any thread
    return ring_->approximate_size() * sizeof(record_line);
  }

  // ---- who writes them

  // Appends lines to `into`, some hundred at a time. How many bytes.
  std::size_t take(std::string& into);
  // A record of the kind `snapshot` was taken.
  void note_snapshot() noexcept { snapshots_taken_.add(); }
  // How many bytes take() would give now, at least.
  std::size_t pending_bytes() noexcept { return out_->pending_at_least() * sizeof(record_line); }
  // The first record of `bytes`, which is cut off there. False: there is no whole one.
  static bool next(std::string_view& bytes, record_head& head, std::string_view& content) noexcept;

 private:
  using ring = rt::spsc_ring<record_line>;
  static constexpr std::size_t lines_of(std::size_t bytes) noexcept {
    return (sizeof(record_head) + bytes + sizeof(record_line) - 1) / sizeof(record_line);
  }
  std::size_t room() noexcept {
    const std::size_t free = in_->room_at_least();
    return free - (free < reserved_ ? free : reserved_);
  }
  void push(const record_head& head, std::span<const std::string_view> content) noexcept;

  rt::arena memory_;
  std::size_t lines_ = 0;
  ring* ring_ = nullptr;
  ring::producer* in_ = nullptr;
  ring::consumer* out_ = nullptr;
  std::size_t reserved_ = 0;                           // lines, for what is under way
  std::array<std::size_t, long_places> reserved_of_{}; // and of each
  std::array<std::uint64_t, long_places> left_of_{};   // bytes that are still to come
  std::vector<std::uint32_t> lost_of_;                 // by topic, and not said yet
  std::vector<bool> named_;                            // by topic: what it is called was put in
  std::uint32_t topics_with_lost_ = 0;
  rt::counter lost_total_;
  std::uint64_t snapshots_asked_ = 0;
  rt::counter snapshots_taken_; // by who writes
};

} // namespace rowe::recording
