// SPDX-License-Identifier: Apache-2.0
// Several subscribers as one: of what has arrived, the earliest message first. One thread.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../console.hpp"
#include "../exit_code.hpp"

namespace rowe::tools {

// A message, and the topic it is of.
struct incoming {
  std::string_view topic; // empty: a plain message
  message_view body;
};

struct subscriptions_wanted {
  std::vector<std::string> topics;
  std::uint32_t text_bytes_max = limits{}.message_bytes_max; // of a message
  std::uint32_t depth = 512; // of messages that are no long ones, in all: 30 MiB
  rt::duration throttle{};   // at most one message of a topic in so much time; 0: all
};

// The throttle of so many messages a second, which a server of rosbridge reads in whole milliseconds.
rt::duration throttle_of(double hertz) noexcept;

class subscriptions {
 public:
  static constexpr std::size_t topics_max = 16;

  // Of each topic, where they share `depth` places.
  static std::uint32_t depth_of_each(const subscriptions_wanted& what) noexcept;
  // What the endpoint must allow its handles.
  static std::size_t bytes_for(const subscriptions_wanted& what) noexcept;

  // Subscribes to all of them; otherwise says why not, and the verb ends with `otherwise`.
  static std::optional<subscriptions> open(endpoint& hub, const subscriptions_wanted& what, const console& to,
                                           exit_code& otherwise);

  // Waits for the next message, at most `timeout`. Errors: timed_out, also after a signal; closed.
  result<incoming> take(rt::duration timeout);

 private:
  struct one {
    std::string topic;
    subscriber<json_text> from;
    std::optional<message_view> next{}; // taken, and not the earliest so far
  };
  result<incoming> try_take();

  std::vector<one> all_;
};

} // namespace rowe::tools
