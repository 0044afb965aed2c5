// SPDX-License-Identifier: Apache-2.0
// How `rowe stop` reaches a robot. First as everybody does, at the URL that was given. As soon as that is
// refused, or after `hedge` without an answer, also on the path /rowe/stop behind it, for which a robot keeps
// places that nobody else gets; who connects first is asked. Not on both from the start: where nothing is
// wrong, and that is known within a round trip, a second connection would only delay the first.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"
#include "../network/remote.hpp"

namespace rowe::tools {

// "ws://host/rowe/stop" for "ws://host/": the path with that behind it, its query kept. Empty where it ends
// so already.
std::string stop_url(const std::string& url);

// A connection to the robot, and what is asked over it.
struct stop_way {
  using service = caller<json_text, json_text>;
  static constexpr std::uint32_t text_bytes_max = 4096; // what is said of a stop

  stop_way(endpoint via, const std::string& url, const console& to);
  // False where handles cannot be had; it was said why. `named`: the robot can be asked its name.
  bool open(bool named, const console& to);

  endpoint hub;
  remote connection;
  watcher waits;
  std::optional<service> stopping, stating, stats;
};

class stop_ways {
 public:
  static constexpr rt::duration hedge = std::chrono::milliseconds{20};

  // Of the options, what both ways have in common.
  stop_ways(std::string url, const endpoint_options& shared, const console& to)
      : url_{std::move(url)}, shared_{shared}, to_{to} {
    silent_.be_quiet(true);
  }

  // Prepares the first way. Otherwise the verb ends with this, and the reason was printed.
  std::optional<exit_code> open();

  // Waits until there is a connection, at most so long. As remote::wait().
  std::optional<exit_code> connect(rt::duration timeout);

  // Lets the other one go. Not before the stop: it takes as long as the other side likes, up to 1.5 s.
  void drop_other() noexcept {
    if (chosen_ == ordinary_.get()) kept_.reset();
  }

  // The one that connected last.
  stop_way& way() noexcept { return *chosen_; }
  bool on_kept_place() const noexcept { return chosen_ == kept_.get(); }

 private:
  bool open_kept();

  std::string url_;
  const endpoint_options shared_;
  const console& to_;
  console silent_{"stop"};
  std::unique_ptr<stop_way> ordinary_;
  std::unique_ptr<stop_way> kept_;
  stop_way* chosen_ = nullptr;
};

} // namespace rowe::tools
