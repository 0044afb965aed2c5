// SPDX-License-Identifier: Apache-2.0
// What `rowe top` shows of a robot: lines, made of the answers of its services /rowe/stats and
// /rowe/stop/state.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/json_value.hpp>

namespace rowe::tools {

enum class line_look : std::uint8_t { plain, heading, good, bad };

struct view_line {
  std::string text;
  line_look look = line_look::plain;
};

enum class topic_order : std::uint8_t { rate, bytes, gap, name };
inline constexpr std::array<std::string_view, 4> topic_orders{"rate", "bytes", "gap", "name"};

class robot_view {
 public:
  // Answers that came together. Losses are compared with those of the time before.
  void take(json_value stats, json_value stop);

  // `columns`: what does not fit is cut off; 0: nothing is.
  std::vector<view_line> lines(topic_order by, std::size_t columns) const;

 private:
  struct topic {
    std::string name, type;
    double hertz = 0, bytes = 0, gap_ms = 0;
    std::uint64_t subscribers = 0;
    double bytes_per_second() const noexcept { return hertz * bytes; }
    // Of what nobody subscribes to the robot measures nothing.
    bool is_known() const noexcept { return subscribers != 0 || hertz > 0; }
  };
  struct loss {
    std::uint64_t all = 0;
    std::uint64_t before = 0; // at the time before
    bool is_chosen = false;   // somebody did not want them
  };
  void take_losses(json_value stats);
  void add_topics(std::vector<view_line>& to, topic_order by, std::size_t columns) const;
  void add_losses(std::vector<view_line>& to) const;

  std::string head_;
  std::string stop_;
  line_look stop_look_ = line_look::plain;
  std::vector<topic> topics_;
  std::uint64_t topics_left_out_ = 0;
  std::map<std::string, loss> losses_;
  std::vector<std::vector<std::string>> peers_;
  std::uint64_t peers_left_out_ = 0;
  std::vector<std::vector<std::string>> loops_;
};

} // namespace rowe::tools
