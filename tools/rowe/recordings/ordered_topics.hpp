// SPDX-License-Identifier: Apache-2.0
// Publishes on several topics so that the messages leave in the order in which they were given. An endpoint
// keeps order within a topic only: what several topics have is taken and written side by side. So before a
// message on another topic than the last one, this waits until all before it were written, which the
// endpoint's counters say. One thread.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/endpoint.hpp>

#include "play_plan.hpp"

namespace rowe::tools {

struct topics_options {
  rt::duration ttl = rt::for_ever;
  std::uint32_t longest = 0; // bytes that a message may have
};

class ordered_topics {
 public:
  // The memory that handles of so many topics need, where no message is longer than that.
  static std::size_t handle_bytes_for(std::size_t topics, std::size_t longest) noexcept;

  // Errors: as endpoint::advertise(); `wrong` is the topic's name then.
  static result<ordered_topics> open(endpoint& via, const std::vector<played_topic>& topics,
                                     const topics_options& how, std::string& wrong);

  // Waits while earlier messages are being written, but not for long: `full` says to try again. Errors:
  // full; no_peer; too_big (longer than may be sent, or no memory is left for it); closed.
  status publish(std::size_t topic, std::string_view json);

  // From here on no message is longer.
  void take_at_most(std::uint32_t bytes) noexcept { how_.longest = std::min(how_.longest, bytes); }
  std::uint32_t longest() const noexcept { return how_.longest; }

  // Whether all that was published is written, or lost. Waits for that, but not for long.
  bool all_left();

 private:
  struct opened {
    played_topic what;
    publisher<json_text> to;
    std::uint32_t bytes_max = 0;
  };
  ordered_topics(endpoint& via, const topics_options& how) : via_{via}, how_{how} {}
  result<publisher<json_text>> advertise(const played_topic& what, std::uint32_t bytes_max);
  // Makes room for a message of so many bytes.
  status grow(opened& topic, std::size_t bytes);
  std::uint64_t left() const;

  endpoint& via_;
  topics_options how_;
  std::vector<opened> topics_;
  std::size_t last_ = 0;            // the topic of the newest message
  std::uint64_t under_way_ = 0;     // messages since everything had left
  std::size_t under_way_bytes_ = 0; // likewise
  std::uint64_t left_before_ = 0;   // what left() said then
  std::uint64_t left_last_ = 0;     // and when it was asked last
  rt::time_point moved_at_{};       // when it had changed
};

} // namespace rowe::tools
