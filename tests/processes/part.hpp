// SPDX-License-Identifier: Apache-2.0
// The part that the other side plays, whether it is a thread of the test or a process of its own. Through the
// public interface alone, in the loop that every robot has, it
//
//   answers /actor/add ({"a","b"} gives {"sum"}), and never answers /actor/mute;
//   publishes {"process","n"} on /actor/beat, and takes what is published on /orders;
//   answers all other calls with {"process"};
//   calls /base/add when a plain message has the member "ask", and sends others with "echo" back;
//
// and tells of each thing that comes to it in a line: "order TEXT", "message TEXT", "call TEXT", "mute TEXT",
// "sum NUMBER", "failed ERROR".
#pragma once
#include <unistd.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/rowe.hpp>

#include "net/own_address.hpp"

namespace part {

struct numbers {
  double a, b;
};
struct total {
  double sum;
};
struct beat {
  std::int64_t process, n;
};

using speaker = std::function<void(std::string_view what, std::string_view text)>;

} // namespace part

template <>
inline constexpr auto rowe::schema<part::numbers> = rowe::fields<&part::numbers::a, &part::numbers::b>{};
template <>
inline constexpr auto rowe::schema<part::total> = rowe::fields<&part::total::sum>{};
template <>
inline constexpr auto rowe::schema<part::beat> = rowe::fields<&part::beat::process, &part::beat::n>{};

namespace part {

class actor {
 public:
  actor(rowe::endpoint& as, speaker tell)
      : adds_{as.serve<numbers, total>("/actor/add").value()},
        mutes_{as.serve<rowe::json_text, rowe::json_text>("/actor/mute").value()},
        beats_{as.advertise<beat>("/actor/beat", {.keep = rowe::keep::newest}).value()},
        orders_{as.subscribe<rowe::json_text>("/orders").value()},
        mail_{as.open_lane().value()},
        asks_{as.client<numbers, total>("/base/add").value()},
        tell_{std::move(tell)} {}

  // One cycle. What cannot be sent is for the test to miss.
  void step(rowe::time_point now) {
    while (auto asked = adds_.try_next(now)) {
      (void)adds_.reply(*asked, {asked->value().a + asked->value().b}, now);
    }
    while (auto asked = mutes_.try_next(now)) {
      tell_("mute", asked->value());
      held_.push_back(std::move(*asked)); // one that is destroyed is refused
    }
    while (auto taken = orders_.try_take()) tell_("order", taken->value());
    while (auto came = mail_.try_receive(now)) take(*came, now);
    while (auto ended = asks_.try_finish()) {
      if (ended->reply) {
        tell_("sum", std::to_string(static_cast<long>(ended->reply->sum)));
      } else {
        tell_("failed", ended->reply.error().name());
      }
    }
    (void)beats_.publish({::getpid(), ++beat_}, now);
  }

 private:
  static bool has(std::string_view text, std::string_view member) {
    return text.find(member) != std::string_view::npos;
  }

  void take(const rowe::message_view& came, rowe::time_point now) {
    tell_(came.wants_reply() ? "call" : "message", came.value());
    if (came.wants_reply()) {
      (void)mail_.try_reply(came, rowe::message("process", ::getpid()), now);
    } else if (has(came.value(), R"("ask")")) {
      (void)asks_.start({38, 4}, rowe::rt::for_ever, now);
    } else if (has(came.value(), R"("echo")")) {
      (void)mail_.try_send(came.value(), rowe::rt::for_ever, now, came.from());
    }
  }

  rowe::responder<numbers, total> adds_;
  rowe::responder<rowe::json_text, rowe::json_text> mutes_;
  std::vector<rowe::request<rowe::json_text>> held_;
  rowe::publisher<beat> beats_;
  rowe::subscriber<rowe::json_text> orders_;
  rowe::lane mail_;
  rowe::caller<numbers, total> asks_;
  speaker tell_;
  std::int64_t beat_ = 0;
};

// Those that are killed come back to their port.
inline rowe::endpoint_options quick_options(const std::string& address = rowe::tests::own_address()) {
  rowe::endpoint_options options;
  options.address = address;
  options.allow_hosts = {address};
  options.retry_min = std::chrono::milliseconds{10};
  options.retry_max = std::chrono::milliseconds{50};
  options.limits.handle_bytes = 4 * 1024 * 1024;
  options.answers_any = true; // calls that come before the lane is opened wait for it
  return options;
}

} // namespace part
