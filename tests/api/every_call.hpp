// SPDX-License-Identifier: Apache-2.0
// Every call of an endpoint and of handles that cannot be used.
#pragma once
#include <string>
#include <string_view>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

#include "endpoints.hpp"

namespace endpoints {

using place = rowe::ros::pose;

// The calls that did not fail with `wanted`, each in a line.
struct failing_calls {
  rowe::errc wanted;
  std::string wrong{};

  void operator()(std::string_view call, const auto& answer) {
    if (answer.code() == wanted) return;
    wrong.append(call).append(": ").append(answer ? "no error" : answer.error().name()).append("\n");
  }
};

// One handle of each kind.
struct handles {
  rowe::publisher<place> publishes;
  rowe::publisher<rowe::json_text> publishes_text;
  rowe::subscriber<place> hears, hears_newest;
  rowe::subscriber<rowe::json_text> hears_text;
  rowe::responder<place, place> serves;
  rowe::responder<rowe::json_text, rowe::json_text> serves_text;
  rowe::caller<place, place> calls;
  rowe::caller<rowe::json_text, rowe::json_text> calls_text;
  rowe::lane lane;
};

inline std::string calls_without(rowe::errc wanted, handles& of) {
  failing_calls expect{wanted};
  const auto now = rowe::rt::monotonic_clock::now();
  expect("publish", of.publishes.publish({}));
  expect("publish text", of.publishes_text.publish("{}"));
  const auto takes = [&](std::string_view what, auto& from) {
    expect(std::string{"try_take "}.append(what), from.try_take());
    expect(std::string{"latest "}.append(what), from.latest());
    expect(std::string{"take "}.append(what), from.take(timeout));
  };
  takes("all", of.hears);
  takes("newest", of.hears_newest);
  takes("text", of.hears_text);
  expect("try_next", of.serves.try_next());
  expect("next", of.serves.next(timeout));
  expect("try_next text", of.serves_text.try_next());
  expect("start", of.calls.start({}, timeout, now));
  expect("try_finish", of.calls.try_finish());
  expect("call", of.calls.call({}, timeout));
  of.calls.cancel({0, 1});
  expect("start text", of.calls_text.start("{}", timeout, now));
  expect("try_finish text", of.calls_text.try_finish());
  expect("call text", of.calls_text.call("{}", timeout));
  of.calls_text.cancel({0, 1});
  expect("lane send", of.lane.send("{}", timeout));
  expect("lane try_send", of.lane.try_send("{}", timeout));
  expect("lane wait_room", of.lane.wait_room(timeout));
  expect("lane try_receive", of.lane.try_receive());
  expect("lane receive", of.lane.receive(timeout));
  expect("lane invoke", of.lane.invoke("{}", timeout));
  expect("lane start", of.lane.start("{}", timeout, now));
  expect("lane try_finish", of.lane.try_finish());
  of.lane.cancel({0, 1});
  return expect.wrong;
}

inline std::string calls_without(rowe::errc wanted, rowe::endpoint& of) {
  failing_calls expect{wanted};
  expect("advertise", of.advertise<place>("/x"));
  expect("subscribe", of.subscribe<place>("/x"));
  expect("serve", of.serve<place, place>("/x"));
  expect("client", of.client<place, place>("/x"));
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
    if (!is_so) expect.wrong.append(call).append(": something\n");
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
  return expect.wrong;
}

} // namespace endpoints
