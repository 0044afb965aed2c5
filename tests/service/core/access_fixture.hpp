// SPDX-License-Identifier: Apache-2.0
// Cores whose peers have roles, for tests of what is let in, carried out and shown.
#pragma once
#include "core_fixtures.hpp"

#include <rowe/access.hpp>
#include <rowe/parameter.hpp>
#include <rowe/stop_latch.hpp>

#include <deque>
#include <string>
#include <string_view>

namespace access_fixture {

using namespace harness;

inline constexpr std::string_view far = "10.0.0.7:50000";
inline constexpr std::string_view here = "127.0.0.1:50000";

inline std::string token_of(std::string_view name) { return std::string{name} + "-shows-this-token"; }

inline rowe::endpoint_options with_roles() {
  rowe::endpoint_options options = small_options();
  options.relay = true;
  options.stop.unguarded = true;
  options.access.roles = {{.name = "arm",
                           .subscribe = {"/arm/**"},
                           .publish = {"/*", "/arm/*"},
                           .advertise = {"/arm/*"},
                           .call = {"/*", "/arm/*"},
                           .provide = {"/arm/*"}},
                          {.name = "guard", .guard = true}};
  for (const char* const role : {"observer", "driver", "supervisor", "peer", "arm", "guard"})
    options.access.identities.push_back({role, role, rowe::hash_token(token_of(role))});
  return options;
}

// Such options, changed.
template <class Change>
rowe::endpoint_options with_roles(Change change) {
  rowe::endpoint_options options = with_roles();
  change(options.access);
  return options;
}

// Opens a parameter of the process.
template <class T>
rowe::parameter<T> open_parameter(core_harness& on, std::string_view name, const T& first,
                                  const rowe::range<T>& allowed = {}) {
  auto* const cell = on.shared.parameters.open(rowe::detail::parameter_request_of(name, first, allowed), -1);
  EXPECT_NE(cell, nullptr);
  on.cycle();
  return {rowe::detail::parameter_handle{nullptr, *cell}, first, allowed};
}

// What a peer is told when it says this.
inline std::string answer_to(core_harness& on, peer& of, std::string_view text) {
  of.say(text);
  on.cycles(2);
  return of.hear_as_one();
}

// A loop that can be stopped. It begins stopped.
class stoppable_loop {
 public:
  explicit stoppable_loop(core_harness& on)
      : on_{on}, latch_{on.open<rowe::stop_latch>(rowe::detail::latch_request({.name = "base"}))} {}
  bool is_stopped() { return latch_.engaged(on_.now); }
  // Looks, and acknowledges a stop.
  bool moves() {
    const bool engaged = is_stopped();
    if (engaged) latch_.acknowledge(on_.now);
    on_.cycle();
    return !engaged;
  }

 private:
  core_harness& on_;
  rowe::stop_latch latch_;
};

// The state of the stop as a peer is told of it.
inline std::string stop_state(core_harness& on, peer& to) {
  (void)to.hear();
  const std::string state = answer_to(on, to, R"({"op":"call_service","service":"/rowe/stop/state"})");
  return std::string{rowe::json::find(rowe::json::root(state).raw, "values")->raw};
}

// Members that name the stop as a peer is told of it: "number":1,"tick":2
inline std::string stop_as_shown(core_harness& on, peer& to) {
  const std::string state = stop_state(on, to);
  const auto member = [&](std::string_view name) { return std::string{rowe::json::find(state, name)->raw}; };
  return R"("number":)" + member("number") + R"(,"tick":)" + member("tick");
}

// The answer to /rowe/stop/SERVICE, with these members and those; `more` ends in a comma.
inline std::string call_stop(core_harness& on, peer& by, std::string_view service, std::string_view more) {
  return answer_to(on, by,
                   R"({"op":"call_service","service":"/rowe/stop/)" + std::string{service} + R"(","args":{)" +
                       std::string{more} + stop_as_shown(on, by) + "}}");
}

struct access : core_test {
  explicit access(const rowe::endpoint_options& options = with_roles()) : core_test{options} {}

  peer& comes(std::string_view who, std::string_view address = far, std::string_view path = "/") {
    const std::string token = who.empty() ? "" : token_of(who);
    peer& one = peers.emplace_back(on, rowe::service::side::server, address, path, "", token);
    on.cycle();
    return one;
  }
  bool is_in(peer& one) { return on.core.peers() == peers.size() && !on.net.closed_by_us(one.id()); }
  std::string answer_to(peer& of, std::string_view text) { return access_fixture::answer_to(on, of, text); }
  std::string call(peer& by, std::string_view service, std::string_view args = "{}") {
    (void)by.hear();
    return answer_to(by, R"({"op":"call_service","id":"c","service":")" + std::string{service} +
                             R"(","args":)" + std::string{args} + "}");
  }
  // Of Foxglove's protocol, behind its greeting.
  peer& viewer(std::string_view role, std::string_view address = far) {
    peer& one = peers.emplace_back(on, rowe::service::side::server, address, "/", "foxglove.websocket.v1",
                                   token_of(role));
    for (int i = 0; i < 20; ++i) (void)one.hear_after(2);
    return one;
  }
  std::string events() {
    std::string all;
    while (const auto one = on.shared.try_event()) all += std::string{one->what} + "\n";
    return all;
  }
  // What events of this kind say, as far as `said` says it; a line for each.
  template <class Said>
  std::string events(rowe::event::kind of, Said said) {
    std::string all;
    while (const auto one = on.shared.try_event())
      if (one->what_kind == of) all += said(*one) + "\n";
    return all;
  }
  std::deque<peer> peers;
};

} // namespace access_fixture
