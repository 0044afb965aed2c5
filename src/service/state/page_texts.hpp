// SPDX-License-Identifier: Apache-2.0
// The long texts that are being sent as pages. Each holds its text until its page has ended, so a reader gets
// the value that it has begun to read, though the topic has a newer one. Few are sent at a time, and two of
// them have a quarter of all chunks at most. Where others need the chunks, and only a page holds a text, the
// page ends where it is; so does the page of a slow reader whose place others need. Service thread only;
// nothing waits or allocates.
#pragma once
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include "service/base/chunk_store.hpp"
#include "service/base/ids.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/shares.hpp"

namespace rowe::service {

class page_texts {
 public:
  explicit page_texts(chunk_store& chunks) noexcept : chunks_{chunks} {}

  // Whether all places are taken.
  bool full() const noexcept { return sending() == long_pages_max || in_use() == long_page_rows; }
  // Gives up the page of a slow reader, but not the oldest page. False: there is none.
  bool displace_slow(rt::time_point now) noexcept {
    const page* first = nullptr;
    for (const page& each : pages_)
      if (each.text && (first == nullptr || each.begun < first->begun)) first = &each;
    for (page& each : pages_) {
      if (!each.text || &each == first || !is_slow(each, now)) continue;
      chunks_.release(each.text);
      each.text = {};
      return true;
    }
    return false;
  }
  // Whether a page of this text may begin, besides those that are being sent.
  bool has_room_for(text_id text) const noexcept {
    std::uint32_t others = 0;
    for (const page& each : pages_)
      if (each.text && each.text != text) others += chunks_.chunks_of(each.text);
    return others == 0 || others + chunks_.chunks_of(text) <= reserve_of(chunks_.chunks());
  }
  // A page begins: its number. It is not full().
  std::uint32_t begin(text_id text, rt::time_point now) noexcept {
    assert(!full());
    std::uint32_t which = 0;
    while (pages_[which].in_use) ++which;
    chunks_.retain(text);
    pages_[which] = {.text = text, .in_use = true, .begun = now};
    return which;
  }
  // The bytes from `at` on that lie together; none: the text was given up. A reader goes forward.
  std::span<const std::byte> read(std::uint32_t which, std::size_t at) noexcept {
    page& one = pages_[which];
    one.taken = at;
    return one.text ? chunks_.read(one.text, at, one.place) : std::span<const std::byte>{};
  }
  void end(std::uint32_t which) noexcept {
    assert(pages_[which].in_use);
    if (pages_[which].text) chunks_.release(pages_[which].text);
    pages_[which] = {};
  }
  // Others need chunks: gives up a text that only a page holds. False: there is none.
  bool give_up() noexcept {
    for (page& each : pages_) {
      if (!each.text || chunks_.references(each.text) != 1) continue;
      chunks_.release(each.text);
      each.text = {};
      return true;
    }
    return false;
  }

  std::uint32_t in_use() const noexcept {
    std::uint32_t count = 0;
    for (const page& each : pages_) count += static_cast<std::uint32_t>(each.in_use);
    return count;
  }

 private:
  struct page {
    text_id text{};
    bool in_use = false;
    chunk_store::place place{};
    rt::time_point begun{};
    std::size_t taken = 0; // bytes
  };
  static bool is_slow(const page& one, rt::time_point now) noexcept {
    return is_slow_reader(one.taken, now - one.begun);
  }
  std::uint32_t sending() const noexcept {
    std::uint32_t count = 0;
    for (const page& each : pages_) count += each.text ? 1U : 0U;
    return count;
  }
  chunk_store& chunks_;
  std::array<page, long_page_rows> pages_{};
};

} // namespace rowe::service
