// SPDX-License-Identifier: Apache-2.0
// What `rowe replay` is asked, and its two ways to play: a trajectory, and recorded messages.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include <rowe/rt/clock.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "../network/remote.hpp"
#include "../recordings/play_plan.hpp"
#include "../recordings/recorded_messages.hpp"

namespace rowe::tools {

struct replay_options {
  remote_place at;
  std::string file;
  std::string tum; // the file, which is a trajectory then
  std::string topic;
  std::string rate;
  std::string from;
  std::string to;
  topic_wishes wishes;
  std::optional<rt::duration> ttl;
  std::optional<rt::duration> timeout;
  bool loop = false;
  bool quiet = false;

  const std::string& path() const noexcept { return tum.empty() ? file : tum; }
};

// How --rate is written: "2x", "250Hz", or a number alone.
struct rate_wish {
  std::optional<double> factor;
  std::optional<double> hz;
  std::optional<double> plain;
};
// Nothing: `wrong` says what is.
std::optional<rate_wish> rate_wish_of(std::string_view text, std::string& wrong);

// Both play to the end and say what came of it. What is wrong with the arguments they say, too.
exit_code replay_trajectory(const replay_options& o, const rate_wish& pace, const console& to);
exit_code replay_messages(const replay_options& o, const rate_wish& pace, kept_as kind, const console& to);

} // namespace rowe::tools
