// SPDX-License-Identifier: Apache-2.0
// What the generators really did: how often each class of each member of each operation was said in each
// state of what it names. A cell that can happen and has not, after as many seeds as the tests run, is a hole
// in the generators, and fails.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "swarm_grammar.hpp"

namespace swarm {

// The states of each dimension, one after the other: the columns.
enum class state : std::uint8_t {
  topic_absent,    // nobody holds it
  topic_strangers, // peers do
  topic_own,       // a handle of this process does
  topic_latched,   // likewise, and it is latched
  subscription_none,
  subscription_idle,
  subscription_queued,    // throttled, with a queue in which something may wait
  subscription_throttled, // throttled, without one
  subscription_backpressured,
  service_nobodys,
  service_peers,
  service_own,
  service_endpoints,
  call_none,    // the peer asks nothing
  call_open,    // it waits for answers
  call_same_id, // under this very id
  answer_asked,
  answer_over, // it has answered, or the call is over
  answer_foreign,
  stop_unused, // no latch yet
  stop_stopped,
  stop_running,
  connection_fresh, // nothing was said on it
  connection_rosbridge,
  connection_bare,
  connection_backpressured,
  connection_closing, // a close frame, or what breaks the protocol, was sent before
};
inline constexpr std::size_t states = 27;

struct state_name {
  dimension of;
  std::string_view name;
};
const std::array<state_name, states>& state_names();

class coverage {
 public:
  coverage() : counts_(rows().size() * states) {}

  void add(std::size_t row, state in) { ++counts_[row * states + static_cast<std::size_t>(in)]; }
  void add(const coverage& more) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += more.counts_[i];
  }
  // For memory that processes share.
  std::vector<std::uint32_t>& counts() { return counts_; }
  static std::size_t cells() { return rows().size() * states; }

  // Cells that can happen and were not seen.
  std::vector<std::string> holes() const;
  std::string table() const;

 private:
  std::vector<std::uint32_t> counts_;
};

// Whether the row's operation looks at what the column says.
bool has(std::size_t row, std::size_t column);
// Why a cell cannot happen; empty: it can.
std::string_view impossible(std::size_t row, std::size_t column);

} // namespace swarm
