// SPDX-License-Identifier: Apache-2.0
// Robots that drive on after the link is gone, and commands that come late (turtlebot_apps 55, duckietown
// 200, roslibjs: what is published offline is sent after the next connection). With roslib, which has no
// ticks, and a network that stalls and breaks. The robot obeys a living client, and none of what was queued.
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, before, beforeEach, afterEach, test } from "node:test";
import { Ros, Topic } from "roslib";
import { driven_robot } from "../support/driven.js";
import { relay } from "../support/relay.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
const forward = { linear: { x: 0.4, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } };
let server, network, ros, commands, timer;

before(async () => {
  network = await relay.start();
  server = await driven_robot.start("--allow-host", network.host);
  network.port = server.port;
});
after(async () => {
  network.end();
  await server.end();
});
beforeEach(async () => {
  network.flow();
  ros = new Ros({ url: network.url });
  ros.on("error", () => {});
  await once(ros, "connection");
  commands = new Topic({ ros, name: "/cmd_vel", messageType: "geometry_msgs/Twist" });
});
afterEach(async () => {
  let_go();
  ros.close();
  network.cut();
  await server.let_run();
  await until("nobody drives", () => server.driver === null);
});

// As teleop does: twenty commands a second.
function hold() {
  timer = setInterval(() => commands.publish(forward), 50);
}
function let_go() {
  clearInterval(timer);
}
// The fastest that it was in this time.
async function fastest_within(ms) {
  let fastest = 0;
  const end = Date.now() + ms;
  while (Date.now() < end) {
    fastest = Math.max(fastest, Math.abs(server.speed));
    await new Promise((passed) => setTimeout(passed, 10));
  }
  return fastest;
}

test("a client without ticks drives while it lives, and the robot stands when its commands end", limit,
  async () => {
    hold();
    await server.moves();
    let_go();
    await server.stands();
  });

test("the robot stands still behind a stall, and what comes out of it does not move it", limit, async () => {
  hold();
  await server.moves();
  network.hold();
  await server.stands();  // while the client goes on sending
  await new Promise((passed) => setTimeout(passed, 2000));
  let_go();
  network.flow();  // a hundred commands arrive at once
  assert.ok(await fastest_within(1500) < 0.01);
  hold();
  await server.moves();
});

test("commands that were queued offline never move it after the next connection", limit, async () => {
  hold();
  await server.moves();
  network.cut();
  await until("roslib knows", () => !ros.isConnected);
  await server.stands();
  for (let i = 0; i < 40; ++i) commands.publish(forward);  // kept by roslib, without a time
  let_go();
  ros.connect(network.url);
  await once(ros, "connection");
  assert.ok(await fastest_within(1500) < 0.01);
  hold();
  await server.moves();
});

test("a client that dies without a word leaves the robot standing", limit, async () => {
  hold();
  await server.moves();
  network.hold();  // it is gone: not even its end is seen
  let_go();
  await server.stands();
  await until("nobody drives", () => server.driver === null);
});
