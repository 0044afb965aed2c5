// SPDX-License-Identifier: Apache-2.0
// Which topics of a recording are played, and under which names.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "decoders.hpp"

namespace rowe::tools {

struct topic_wishes {
  std::vector<std::string> only;    // patterns, also several with commas between; none: all topics
  std::vector<std::string> without; // likewise
  std::vector<std::string> remaps;  // "FROM:=TO", "FROM=TO"
};

// A topic that is published.
struct played_topic {
  std::string name;
  std::string type;
  bool latched = false;
};

struct play_plan {
  std::vector<played_topic> topics;
  // By the places of the recording's topics:
  std::vector<std::optional<std::size_t>> to; // the place in `topics`; nothing: it is not played
  std::vector<message_decoder> decoders;
  std::vector<std::size_t> selected; // the places of those that are played
  // What is not played although it was not left out by wish: a sentence for each reason.
  std::vector<std::string> not_played;
};

// Nothing: a wish is wrong, and `wrong` says which.
std::optional<play_plan> plan_for(const std::vector<recorded_topic>& recorded, const topic_wishes& wishes,
                                  std::string& wrong);

} // namespace rowe::tools
