// SPDX-License-Identifier: Apache-2.0
// Driving over real sockets and in real time, against a robot in a few lines (support/control.js).
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { WebSocket } from "ws";
import { connect } from "../../../clients/js/src/rowe.js";
import { driven_robot } from "../support/control.js";
import { until, watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 120000 };
const slow = { linear: { x: 0.2 } };
let server, made;

beforeEach(async () => {
  made = [];
  server = await driven_robot.start();
});
afterEach(async () => {
  for (const one of made) one.close();
  await server.end();
});

async function driver(name) {
  const one = await connect(server.url, { WebSocket, name }).opened({ timeout_ms: watchdog_ms });
  made.push(one);
  const base = one.drive("/cmd_vel");
  base.losses = [];
  base.on("lost", (why) => base.losses.push(why));
  return { one, base };
}
const moves = () => until("it moves", () => server.moves);
const stands = () => until("it stands still", () => !server.moves);
// A command that a busy machine let lapse is given again, as a hand does that still holds the stick.
const hold = (base, command = slow) => until("it moves", () => server.moves || !base.set(command) && false);

test("one drives for as long as it holds its command, and stands still at halt()", limit, async () => {
  const { base } = await driver("one");
  await base.take();
  await hold(base);
  assert.deepEqual(server.moves, slow);
  await until("commands", () => server.commands.length > 10 || (base.commanding || base.set(slow), false));
  base.halt();
  await until("zeros", () => server.moves?.linear.x === 0);
  await stands();
  await until("heartbeats", () => server.asked.filter((action) => action === "take").length > 3);
  assert.ok(base.held);
  await base.release();
  assert.equal(server.driver, null);
});

test("the second one is refused, takes over, and the first one is told by whom", limit, async () => {
  const [first, second] = [await driver("one"), await driver("two")];
  await first.base.take();
  await hold(first.base);
  const by_one = ({ said, answer }) => said === "driven" && answer.driver === "one";
  await assert.rejects(second.base.take(), by_one);
  assert.equal(second.base.held, false);
  await second.base.take_over();
  await until("the first one knows", () => first.base.losses.length);
  assert.deepEqual([first.base.losses[0].reason, first.base.losses[0].driver], ["taken_over", "two"]);
  assert.equal(first.base.set(slow), false);
  await hold(second.base);
});

test("a driver whose connection breaks stands still, and does not drive when it is back", limit, async () => {
  const { one, base } = await driver("one");
  await base.take();
  await hold(base);
  for (const { socket } of server.peers) socket.terminate();
  await until("it knows", () => base.losses.length);
  assert.equal(base.losses[0].reason, "closed");
  await one.opened({ timeout_ms: watchdog_ms });
  const [takes, commands] = [server.asked.length, server.commands.length];
  await until("the state again", () => one.stop.known);
  assert.deepEqual([server.asked.length, server.commands.length, base.set(slow)], [takes, commands, false]);
  await base.take();
  await hold(base);
});

test("a stop ends the command, and a reset does not bring it back", limit, async () => {
  const { one, base } = await driver("one");
  await base.take();
  await hold(base);
  await one.stop.press();
  await until("it is stopped", () => one.stop.stopped);
  await one.stop.reset();
  await until("it runs", () => one.stop.stopped === false);
  const { length } = server.commands;
  const asked = server.asked.length;
  await until("it goes on asking", () => server.asked.length > asked + 1);
  assert.deepEqual([server.commands.length, base.commanding], [length, false]);
  await hold(base);
});

test("ticks that do not come make commands old, and the robot stands still", limit, async () => {
  const { base } = await driver("one");
  await base.take();
  await hold(base);
  server.refuses = "role";  // a heartbeat brings no tick either
  server.silent = true;
  await stands();
  await until("it is told", () => base.losses.length);
  assert.equal(base.losses[0].said, "role");
});
