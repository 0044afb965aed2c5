// SPDX-License-Identifier: Apache-2.0
// Plays recorded messages: each at its time, in their order, whatever it takes. Where there is no room it
// waits; where there is no connection the pace goes on once there is one again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <rowe/rt/histogram.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "../keys.hpp"
#include "../network/remote.hpp"
#include "ordered_topics.hpp"
#include "play_plan.hpp"
#include "playback_clock.hpp"
#include "read_ahead.hpp"

namespace rowe::tools {

struct player_options {
  double rate = 1;
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;  // what is shown as the end
  std::int64_t lap_ns = 0; // from one lap's begin to the next one's
  std::optional<rt::duration> timeout;
};

struct player_figures {
  std::uint64_t published = 0;
  std::uint64_t faults = 0;                      // parts that could not be read
  std::uint64_t laps = 0;                        // that were played to their end
  std::size_t longest_sent = 0;                  // bytes
  std::string longest_on;                        // its topic
  std::map<std::size_t, std::uint64_t> too_long; // by the recording's topics
  std::map<std::size_t, std::uint64_t> no_object;
  bool was_quit = false; // by a key
};

class player {
 public:
  player(ordered_topics& to, const play_plan& plan, const std::vector<recorded_topic>& recorded,
         read_ahead& from, remote& hub, keys& keyboard, const player_options& chosen, const console& says);

  // Plays to the end. Nothing: it came there, or was ended by a key.
  std::optional<exit_code> play();

  const player_figures& figures() const noexcept { return figures_; }
  // How late messages were published; those of steps do not count.
  const rt::histogram& lateness() const noexcept { return lateness_; }

 private:
  enum class next_step : std::uint8_t { go_on, publish_now, drop, quit };

  std::optional<exit_code> play_one(const read_item& item);
  std::optional<exit_code> publish(std::size_t topic, std::string_view json, rt::time_point due,
                                   bool stepped);
  next_step wait_until_due(std::int64_t time_ns);
  next_step stay_at_end();
  next_step look_at_keys(rt::time_point until);
  // Prints what has happened, and learns from it how long a message may be there.
  void hear_of_server();
  void seek(rt::duration by);
  void skip(std::map<std::size_t, std::uint64_t>& count, std::size_t topic, const std::string& why);
  void show_status(bool at_once);
  const std::string& name_of(std::size_t topic) const { return recorded_[topic].name; }

  ordered_topics& to_;
  const play_plan& plan_;
  const std::vector<recorded_topic>& recorded_;
  read_ahead& from_;
  remote& hub_;
  keys& keys_;
  const player_options& chosen_;
  const console& says_;
  playback_clock clock_;
  player_figures figures_;
  rt::inline_histogram<7> lateness_;
  bool shows_status_;
  rt::time_point status_due_{};
  rt::time_point report_due_{};
  bool server_takes_less_ = false; // than we could send
};

} // namespace rowe::tools
