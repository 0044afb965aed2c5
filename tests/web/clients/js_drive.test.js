// SPDX-License-Identifier: Apache-2.0
// The client of clients/js drives the demo robot, over real sockets and in real time.
import assert from "node:assert/strict";
import { after, afterEach, before, test } from "node:test";
import { WebSocket } from "ws";
import { connect } from "../../../clients/js/src/rowe.js";
import { driven_robot } from "../support/driven.js";
import { until, watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 120000 };
const slow = { linear: { x: 0.2 } };
let server, made, sockets;

// One whose connections a test can break.
class breakable extends WebSocket {
  constructor(...how) {
    super(...how);
    sockets.push(this);
  }
}

before(async () => {
  server = await driven_robot.start();
});
after(() => server.end());
afterEach(async () => {
  for (const one of made.splice(0)) one.close();
  await server.let_run();
  await until("nobody drives", () => server.driver === null);
  await server.stands();
});

async function driver(name) {
  made ??= [];
  sockets = [];
  const one = connect(server.url, { WebSocket: breakable, name });
  made.push(one);
  await one.opened({ timeout_ms: watchdog_ms });
  const base = one.drive("/cmd_vel");
  base.losses = [];
  base.on("lost", (why) => base.losses.push(why));
  return { one, base };
}
// A command that a busy machine let lapse is given again, as a hand does that still holds the stick.
const hold = (base, command = slow) =>
  until("it moves", () => Math.abs(server.speed) > 0.1 || (base.set(command), false));

test("one drives for as long as it holds its command, and stands still at halt()", limit, async () => {
  const { base } = await driver("one");
  await base.take();
  assert.deepEqual([base.lease_ms, base.hold_ms], [500, 2000]);
  await hold(base);
  assert.equal(server.driver, "one");
  base.halt();
  await server.stands();
  await new Promise((passed) => setTimeout(passed, 2500));  // longer than control is kept without a word
  assert.deepEqual([base.held, server.driver, base.losses], [true, "one", []]);
  await hold(base);
  await base.release();
  await until("nobody drives", () => server.driver === null);
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
  await assert.rejects(first.base.take(), ({ said, answer }) => said === "driven" && answer.driver === "two");
});

test("a driver whose connection breaks stands still, and does not drive when it is back", limit, async () => {
  const { one, base } = await driver("one");
  await base.take();
  await hold(base);
  for (const socket of sockets) socket.terminate();
  await server.stands();
  await until("it knows", () => base.losses.length);
  assert.equal(base.losses[0].reason, "closed");
  await one.opened({ timeout_ms: watchdog_ms });
  await until("the state again", () => one.stop.known);
  assert.equal(base.set(slow), false);
  await base.take();
  await hold(base);
});

test("a stop ends the command, and a reset does not bring it back", limit, async () => {
  const { one, base } = await driver("one");
  await base.take();
  await hold(base);
  await one.stop.press();
  await server.stands();
  await server.let_run();
  await until("it runs", () => one.stop.stopped === false);
  assert.deepEqual([base.commanding, server.speed < 0.01], [false, true]);
  await hold(base);
});

test("a robot that stood still for longer than the lease is not moved by what was held", limit, async () => {
  const { base } = await driver("one");
  await base.take();
  await hold(base);
  await server.pause();
  await new Promise((passed) => setTimeout(passed, 1500));
  server.resume();
  await until("the command has lapsed", () => !base.commanding);
  await server.let_run();
  await server.stands();
});

test("a robot that restarts is not driven before somebody takes control of it", limit, async () => {
  const { one, base } = await driver("one");
  await base.take();
  await hold(base);
  await server.kill();
  await until("it knows", () => base.losses.length);
  await server.restart();
  await server.watch();
  await one.opened({ timeout_ms: watchdog_ms });
  assert.equal(base.set(slow), false);
  await base.take();
  await hold(base);
});
