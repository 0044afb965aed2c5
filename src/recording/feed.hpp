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

#include <rowe/rt/arena.hpp>
#include <rowe/rt/attributes.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/spsc_ring.hpp>

namespace rowe::recording {

inline constexpr std::size_t topics_max = 4096;

enum class record_kind : std::uint32_t {
  topic,   // its name, type and JSON Schema: two lengths stand in front, see topic_record
  message, // its text
  lost,    // `count` messages of the topic had no room
};

struct record_head {
  std::uint32_t bytes = 0; // that follow
  record_kind kind{};
  std::uint32_t topic = 0;
  std::uint32_t count = 0;
  std::int64_t logged_ns = 0;
  std::int64_t published_ns = 0;
};

struct record_line {
  std::array<char, 64> bytes;
};

// One thread at a time puts records in, one other takes them out.
class feed {
 public:
  // Takes its memory at once. Check operator bool.
  explicit feed(std::size_t bytes) noexcept;
  feed(const feed&) = delete;
  feed& operator=(const feed&) = delete;
  explicit operator bool() const noexcept { return ring_ != nullptr; }
  int map_errno() const noexcept { return memory_.map_errno(); }

  // ---- who has messages

  // Whether a record of so many bytes could ever go in.
  bool fits(std::size_t bytes) const noexcept { return lines_of(bytes) + 1 <= lines_; }
  bool has_room(std::size_t bytes) noexcept { return in_->room_at_least() >= lines_of(bytes) + 1; }
  // False: there is no room. Of `message` it is counted; the head of a later record says how many.
  ROWE_RT bool put(record_head head, std::span<const std::string_view> content) noexcept;
  ROWE_RT void count_lost(std::uint32_t topic, std::uint64_t count) noexcept;
  // Puts in what could not be said yet of what was lost. False: there is still no room for that.
  bool put_lost(std::int64_t logged_ns) noexcept;
  std::uint64_t lost() const noexcept { return lost_total_.get(); } // any thread
  std::uint64_t waiting_bytes() const noexcept {                    // any thread
    return ring_->approximate_size() * sizeof(record_line);
  }

  // ---- who writes them

  // Appends lines to `into`, some hundred at a time. How many bytes.
  std::size_t take(std::string& into);
  // The first record of `bytes`, which is cut off there. False: there is no whole one.
  static bool next(std::string_view& bytes, record_head& head, std::string_view& content) noexcept;

 private:
  using ring = rt::spsc_ring<record_line>;
  static constexpr std::size_t lines_of(std::size_t bytes) noexcept {
    return (sizeof(record_head) + bytes + sizeof(record_line) - 1) / sizeof(record_line);
  }
  bool put_lost_of(std::uint32_t topic, std::int64_t logged_ns) noexcept;
  void push(const record_head& head, std::span<const std::string_view> content) noexcept;

  rt::arena memory_;
  std::size_t lines_ = 0;
  ring* ring_ = nullptr;
  ring::producer* in_ = nullptr;
  ring::consumer* out_ = nullptr;
  std::array<std::uint32_t, topics_max> lost_of_{}; // and not said yet
  std::uint32_t topics_with_lost_ = 0;
  rt::counter lost_total_;
};

} // namespace rowe::recording
