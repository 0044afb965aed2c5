// SPDX-License-Identifier: Apache-2.0
// The names of topics and services that are gone, until all peers know it. Few, so each is looked for from
// the first on. Service thread only; nothing waits or allocates.
#pragma once
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

namespace rowe::service {

class gone_names {
 public:
  static std::uint32_t count(const limits& bounds) noexcept {
    return 1 + (bounds.topics_max + bounds.services_max) / 4;
  }
  // Of one: topic_bytes_max, and the slash that may be added.
  static std::size_t name_bytes_max(const limits& bounds) noexcept {
    return std::size_t{bounds.topic_bytes_max} + 1;
  }
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(count(bounds)) +
           rt::arena::bytes_for(count(bounds) * name_bytes_max(bounds));
  }
  gone_names(rt::arena& memory, const limits& bounds) noexcept
      : rows_{memory.carve<row>(count(bounds))},
        names_{memory.carve<char>(count(bounds) * name_bytes_max(bounds))},
        name_bytes_max_{name_bytes_max(bounds)} {}

  std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(rows_.size()); } // all places
  // When the one in this place was found to be gone; 0: there is none.
  std::uint32_t gone_at(std::uint32_t place) const noexcept { return rows_[place].gone_at; }
  bool is_topic(std::uint32_t place) const noexcept { return rows_[place].is_topic; }
  std::string_view name(std::uint32_t place) const noexcept {
    return {names_.data() + place * name_bytes_max_, rows_[place].name_bytes};
  }
  // False: all places are taken. If it was gone before, only the newer time stays.
  bool add(std::string_view name, bool is_topic, std::uint32_t gone_at) noexcept {
    assert(gone_at != 0 && name.size() <= name_bytes_max_);
    std::uint32_t place = find(name, is_topic);
    for (std::uint32_t i = 0; place == size() && i != size(); ++i) {
      if (rows_[i].gone_at == 0) place = i;
    }
    if (place == size()) return false;
    rows_[place] = {gone_at, static_cast<std::uint16_t>(name.size()), is_topic};
    name.copy(names_.data() + place * name_bytes_max_, name.size());
    return true;
  }
  void drop(std::string_view name, bool is_topic) noexcept {
    if (const std::uint32_t place = find(name, is_topic); place != size()) rows_[place].gone_at = 0;
  }
  // Drops those that were gone then. False: there are none.
  bool drop_until(std::uint32_t then) noexcept {
    bool any = false;
    for (row& one : rows_) {
      if (one.gone_at == 0 || one.gone_at > then) continue;
      one.gone_at = 0;
      any = true;
    }
    return any;
  }

 private:
  struct row {
    std::uint32_t gone_at = 0;
    std::uint16_t name_bytes = 0;
    bool is_topic = false; // else a service
  };
  // Its place; size(): it is not there.
  std::uint32_t find(std::string_view wanted, bool is_topic) const noexcept {
    std::uint32_t place = 0;
    while (place != size() &&
           (rows_[place].gone_at == 0 || rows_[place].is_topic != is_topic || name(place) != wanted))
      ++place;
    return place;
  }

  std::span<row> rows_;
  std::span<char> names_;
  std::size_t name_bytes_max_;
};

} // namespace rowe::service
