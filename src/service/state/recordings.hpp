// SPDX-License-Identifier: Apache-2.0
// Who records, and which topics: each sink gets the values of the topics that it wants. A topic's row says in
// topic::aside which sinks these are, so nothing is searched for when it is published. Long values are
// copied in shares, over several cycles.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/rt/clock.hpp>

#include "service/base/chunk_store.hpp"
#include "service/base/ids.hpp"
#include "service/base/record_sink.hpp"
#include "service/state/topic_table.hpp"

namespace rowe::service {

class recordings {
 public:
  static constexpr std::size_t sinks_max = 6; // a bit of topic::aside for each
  static constexpr std::uint8_t everyone = topic::recorders;

  recordings(topic_table& topics, chunk_store& chunks) noexcept : topics_{topics}, chunks_{chunks} {}

  // Its bit in topic::aside; 0: sinks_max are there. Afterwards look() is due for all topics.
  std::uint8_t add(record_sink& sink) noexcept;
  void remove(record_sink& sink) noexcept;
  bool any() const noexcept { return count_ != 0; }

  // Finds out who records the topic, if that is not known. True: somebody does.
  bool look(topic_id index) noexcept {
    return (topics_.at(index).aside & ~topic::asked_over_http) != 0 && find(index);
  }

  // A value of a topic for which look() was true. `only`: for these sinks alone.
  void keep(topic_id index, std::string_view json, rt::time_point now, rt::time_point published,
            std::uint8_t only = everyone) noexcept;
  void keep_long(topic_id index, text_id value, rt::time_point now, rt::time_point published,
                 std::uint8_t only = everyone) noexcept;
  // Copies so many bytes of the long values that are under way, or all.
  void copy_long(std::size_t bytes) noexcept;
  bool any_long() const noexcept { return long_count_ != 0; }

  std::uint32_t black_boxes() const noexcept;
  // Asks all black boxes to write what they retain. How many will.
  std::uint32_t snapshot(std::string_view cause) noexcept;

 private:
  bool find(topic_id index) noexcept;
  struct long_value {
    text_id text{}; // none: the place is free
    std::size_t done = 0;
    chunk_store::place at{};
    std::uint8_t sinks = 0;
  };
  template <class Do>
  void each(unsigned sinks, Do&& does) noexcept {
    for (std::size_t i = 0; i < sinks_max; ++i)
      if ((sinks >> i & 1) != 0) does(*sinks_[i], static_cast<std::uint8_t>(1U << i));
  }

  topic_table& topics_;
  chunk_store& chunks_;
  std::array<record_sink*, sinks_max> sinks_{};
  std::size_t count_ = 0;
  std::array<long_value, record_sink::long_places> long_values_{};
  std::size_t long_count_ = 0;
};

} // namespace rowe::service
