// SPDX-License-Identifier: Apache-2.0
// roslib in Node, unmodified, by a client certificate. It opens a WebSocket by its URL alone, so the program
// around it gives the global one its certificate.
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, before, test } from "node:test";
import { WebSocket } from "ws";
import { set_up_robot } from "../support/set_up.js";

const limit = { timeout: 60000 };
let robot, own;

before(async () => {
  robot = await set_up_robot.start();
  robot.ask_for_certificates();
  own = robot.certificate("arm-1", "driver");
  await robot.serve();
});
after(() => robot?.end());

// Opens it with these options of TLS.
const socket_with = (options) => class extends WebSocket {
  constructor(url) { super(url, { ca: robot.root(), ...options }); }
};

test("roslib connects by its program's certificate, and hears of the end of it", limit, async () => {
  globalThis.WebSocket = socket_with({ cert: own, key: own });
  const { Ros, Topic } = await import("roslib");
  const ros = new Ros({ url: robot.url });
  await once(ros, "connection");
  const topic = new Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry" });
  const message = await new Promise((done) => topic.subscribe(done));
  assert.equal(typeof message.pose.pose.position.x, "number");
  const closed = once(ros, "close");
  robot.remove("arm-1");
  await closed;
});

test("without a certificate, and without a token, it is refused in words", limit, async () => {
  const socket = new (socket_with({}))(robot.url);
  const [, answer] = await once(socket, "unexpected-response");
  assert.equal(answer.statusCode, 401);
  socket.on("error", () => {});
  socket.terminate();
});
