// SPDX-License-Identifier: Apache-2.0
// What tests of whole endpoints share: real sockets on loopback, real service threads.
#pragma once
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <rowe/rowe.hpp>

#include "api/seen.hpp"

namespace endpoints {

using namespace std::chrono_literals;
using rowe::tests::count_of;
using rowe::tests::url_of;

inline constexpr auto timeout = 20s; // a watchdog: nothing here takes a thousandth of it

inline rowe::endpoint_options quick() {
  rowe::endpoint_options options;
  options.retry_min = 10ms;
  options.retry_max = 50ms;
  options.limits.handle_bytes = 4 * 1024 * 1024;
  return options;
}

// What is invoked is kept for receive() from the start.
inline rowe::endpoint_options answering() {
  rowe::endpoint_options options = quick();
  options.answers_any = true;
  return options;
}

inline rowe::endpoint connected(const rowe::endpoint& to, const rowe::endpoint_options& options = quick()) {
  auto made = rowe::endpoint::connect(url_of(to), options).value();
  EXPECT_TRUE(made.wait_peer(timeout));
  return made;
}

// Whether a reply has these members; one of a peer that uses the plain format has in_reply_to behind them.
inline bool says(std::string_view reply, std::string_view object) {
  return reply == object || reply.starts_with(std::string{object.substr(0, object.size() - 1)} + ",");
}

// Whether `ready` comes true before the watchdog barks.
template <class Ready>
bool eventually(Ready&& ready) {
  return rowe::tests::eventually(ready, timeout);
}

// Makes a call that is to run out of time, until its request has gone out: what the service thread takes up
// when the time is over already never does.
template <class Call>
bool goes_out(const rowe::endpoint& by, Call&& call) {
  const std::uint64_t before = count_of(by, "calls_out");
  return eventually([&] {
    call();
    return count_of(by, "calls_out") > before;
  });
}

// Does `step` again and again on a thread of its own, until destroyed.
template <class Step>
class beside {
 public:
  explicit beside(Step step)
      : thread_{[this, step = std::move(step)]() mutable {
          while (!done_.load()) step();
        }} {}
  ~beside() {
    done_.store(true);
    thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  std::thread thread_;
};

// Answers calls: `answer(received)` for each.
template <class Answer>
auto answering_thread(rowe::endpoint& at, Answer answer) {
  return beside{[&at, answer] {
    if (auto call = at.receive(5ms)) answer(*call);
  }};
}

} // namespace endpoints
