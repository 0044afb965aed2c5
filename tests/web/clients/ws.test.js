// SPDX-License-Identifier: Apache-2.0
// The npm package ws as a client: strict about frames, and without any idea of ROS.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { robot } from "../support/robot.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 60000 };
let server;
let client;

before(async () => {
  server = await robot.start();
  client = await rosbridge_client.connect(server.url);
});
after(async () => {
  client?.close();
  await server?.kill();
});

test("an unknown op is answered by a status error with its id", limit, async () => {
  client.send({ op: "nonsense", id: "n1" });
  const status = await client.first("a status", ({ op, id }) => op === "status" && id === "n1");
  assert.equal(status.level, "error");
  assert.equal(typeof status.msg, "string");
  assert.ok(status.msg.length > 0);
});

test("text that is no JSON ends neither the connection nor the robot", limit, async () => {
  client.socket.send("{ this is not JSON");
  client.send({ op: "nonsense", id: "n2" });
  await client.first("a status", ({ id }) => id === "n2");
  assert.equal(client.socket.readyState, client.socket.OPEN);
});

test("a throttled subscription is slower than the robot", limit, async () => {
  client.send({ op: "subscribe", id: "t", topic: "/odom", throttle_rate: 200, queue_length: 1 });
  const begin = Date.now();
  await until("some odometry", () => client.published("/odom").length >= 6);
  assert.ok(Date.now() - begin >= 4 * 200, "six messages came sooner than 200 ms apart");
  client.send({ op: "unsubscribe", id: "t", topic: "/odom" });
});

test("a ping is answered", limit, async () => {
  let answered = null;
  client.socket.on("pong", (data) => (answered = String(data)));
  client.socket.ping("are you there");
  await until("a pong", () => answered === "are you there");
});

test("a page of another origin gets no connection", limit, async () => {
  const { WebSocket } = await import("ws");
  const stranger = new WebSocket(server.url, { origin: "http://elsewhere.example" });
  const status = await new Promise((resolve, reject) => {
    stranger.on("unexpected-response", (_, answer) => resolve(answer.statusCode));
    stranger.on("open", () => reject(new Error("it was let in")));
    stranger.on("error", () => {});
  });
  assert.equal(status, 403);
  stranger.terminate();
});
