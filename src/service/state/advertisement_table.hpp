// SPDX-License-Identifier: Apache-2.0
// What peers advertise: topics, and the numbers that some peers give them. Service thread only; nothing waits
// or allocates.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/ids.hpp"
#include "service/state/peer_set.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct advertisement {
  topic_id topic{};
  std::int64_t lifespan_ns = wire::unlimited; // of each message
  bool latched = false;                       // what this peer publishes there is retained
  std::uint32_t tag = wire::no_number;        // the peer's number for it
};

class advertisement_table {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(bounds.connections_max) +
           rt::arena::bytes_for<advertisement>(std::size_t{bounds.connections_max} *
                                               bounds.advertisements_per_connection_max) +
           rt::arena::bytes_for<std::uint64_t>(peer_set::words_for(bounds.connections_max) *
                                               bounds.topics_max);
  }
  advertisement_table(rt::arena& memory, const limits& bounds) noexcept
      : words_{peer_set::words_for(bounds.connections_max)},
        rows_{memory.carve<row>(bounds.connections_max)},
        publishers_{memory.carve<std::uint64_t>(words_ * bounds.topics_max)} {
    const std::size_t each = bounds.advertisements_per_connection_max;
    const auto all = memory.carve<advertisement>(bounds.connections_max * each);
    for (const peer_index i : rows_.ids()) rows_[i].places = all.subspan(i.value * each, each);
  }

  std::span<advertisement> of(peer_index peer) const noexcept {
    return rows_[peer].places.first(rows_[peer].count);
  }
  // Null if the peer does not advertise the topic.
  advertisement* find(peer_index peer, topic_id topic) const noexcept {
    const auto mine = of(peer);
    const auto found =
        std::find_if(mine.begin(), mine.end(), [topic](const advertisement& a) { return a.topic == topic; });
    return found != mine.end() ? &*found : nullptr;
  }
  // The topic that the peer advertises by this number; none if there is none.
  topic_id find_tag(peer_index peer, std::uint32_t tag) const noexcept {
    for (const advertisement& one : of(peer)) {
      if (one.tag == tag) return one.topic;
    }
    return {};
  }
  // Who advertises the topic.
  peer_set publishers_of(topic_id topic) const noexcept {
    return peer_set{publishers_.subspan(topic.value * words_, words_)};
  }
  std::size_t places() const noexcept { return rows_[{0}].places.size(); } // of each peer
  bool full(peer_index peer) const noexcept { return rows_[peer].count == places(); }
  void add(peer_index peer, const advertisement& one) noexcept {
    row& to = rows_[peer];
    to.places[to.count++] = one;
    publishers_of(one.topic).add(peer);
  }
  // The last advertisement takes its place.
  void remove(peer_index peer, advertisement& one) noexcept {
    row& from = rows_[peer];
    publishers_of(one.topic).remove(peer);
    one = from.places[--from.count];
  }

  // The sets of publishers are those of the rows.
  bool check() const noexcept {
    std::size_t held = 0;
    for (const peer_index peer : rows_.ids()) {
      for (const advertisement& one : of(peer)) {
        if (!publishers_of(one.topic).has(peer)) return false;
        ++held;
      }
    }
    for (const std::uint64_t word : publishers_) held -= static_cast<std::size_t>(std::popcount(word));
    return held == 0;
  }

 private:
  struct row {
    std::uint32_t count = 0;
    std::span<advertisement> places;
  };
  const std::size_t words_; // of each set of publishers
  rows<peer_index, row> rows_;
  std::span<std::uint64_t> publishers_; // by topic
};

} // namespace rowe::service
