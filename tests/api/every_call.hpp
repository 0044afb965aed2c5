// SPDX-License-Identifier: Apache-2.0
// Every call of an endpoint that cannot be used.
#pragma once
#include <string>
#include <string_view>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

#include "endpoints.hpp"

namespace endpoints {

// The calls that did not fail with this error at once, each in a line.
inline std::string calls_without(rowe::errc wanted, rowe::endpoint& of) {
  std::string wrong;
  const auto expect = [&](std::string_view call, const auto& answer) {
    if (answer.code() == wanted) return;
    wrong.append(call).append(": ").append(answer ? "no error" : answer.error().name()).append("\n");
  };
  using pose = rowe::ros::pose;
  expect("advertise", of.advertise<pose>("/x"));
  expect("subscribe", of.subscribe<pose>("/x"));
  expect("serve", of.serve<pose, pose>("/x"));
  expect("client", of.client<pose, pose>("/x"));
  expect("parameter", of.parameter<double>("x", 1.0));
  expect("open_lane", of.open_lane());
  expect("stop_latch", of.stop_latch());
  expect("emergency_stop", of.emergency_stop({}, timeout));
  expect("reset_emergency_stop", of.reset_emergency_stop({}, timeout));
  expect("send", of.send("{}", timeout));
  expect("try_send", of.try_send("{}", timeout));
  expect("wait_room", of.wait_room(timeout));
  expect("receive", of.receive(timeout));
  expect("invoke", of.invoke("{}", timeout));
  expect("wait_peer", of.wait_peer(timeout));
  expect("set_access", of.set_access({}));
  expect("close", of.close(timeout));
  const auto empty = [&](std::string_view call, bool is_so) {
    if (!is_so) wrong.append(call).append(": something\n");
  };
  empty("peers", of.peers() == 0);
  empty("connections", of.connections().empty());
  empty("identity_of", std::string_view{of.identity_of({})}.empty());
  empty("port", of.port() == 0);
  empty("wake_descriptor", of.wake_descriptor() == -1);
  empty("try_event", !of.try_event());
  empty("counts", of.counts().empty());
  empty("service_grants", !of.service_grants().pinned);
  empty("memory_locked", !of.memory_locked());
  empty("memory_unlocked_bytes", of.memory_unlocked_bytes() == 0);
  return wrong;
}

} // namespace endpoints
