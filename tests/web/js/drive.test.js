// SPDX-License-Identifier: Apache-2.0
// Control of a driven topic, against a scripted robot and clocks of our own.
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { connect } from "../../../clients/js/src/rowe.js";
import { fake_socket, fakes, settled } from "./fakes.js";

const limit = { timeout: 20000 };
const clock = fakes();
const twist = (x) => ({ linear: { x, y: 0 }, angular: { z: 0 } });
let robot, base, socket, tick, lost;
const asked = (action) =>
  socket.calls("/rowe/control").filter(({ args }) => !action || args.action === action);
const commands = () => socket.published("/cmd_vel");
const speeds = () => commands().map(({ msg }) => msg.linear.x);
const values = (more) => ({
  topic: "/cmd_vel", driver: "js-1", number: 1, yours: true, lease_ms: 300, hold_ms: 2000,
  tick: (tick += 1), refused: null, ...more,
});
const answer = (more, call = asked().at(-1)) => socket.answer(call, values(more));
const says = (driver, more) => socket.publish("/rowe/control/state", { tick: (tick += 1), topics: [
  { topic: "/cmd_vel", lease_ms: 300, hold_ms: 2000, driver, number: driver === "phone" ? 2 : 1, ...more },
] });
const stop_says = (state, number = 7) => socket.publish("/rowe/stop/state", { state, number, tick: 1 });

// As a robot does while this client drives: heartbeats are answered, and states come.
async function drive_on(ms) {
  const answered = new Set(asked());
  for (let passed = 0; passed < ms; passed += 50) {
    await clock.pass(50);
    for (const call of asked()) {
      if (!answered.has(call)) await answer({}, call);
      answered.add(call);
    }
    says("js-1");
  }
}
async function taken() {
  const take = base.take();
  await answer();
  return take;
}

beforeEach(() => {
  [tick, lost] = [100, []];
  robot = connect("ws://robot/", { WebSocket: fake_socket, name: "js-1" });
  socket = fake_socket.last;
  socket.open();
  base = robot.drive("cmd_vel");
  base.on("lost", (why) => lost.push(why));
});
afterEach(() => robot.close());

test("nothing is sent before control was taken, and what was set is dropped and counted", limit, async () => {
  assert.deepEqual([base.set(twist(1)), base.halt(), base.dropped], [false, false, 1]);
  await clock.pass(1000);
  assert.deepEqual([asked(), commands()], [[], []]);
});

test("control is taken by name, with the newest tick, and the answer says for how long", limit, async () => {
  says(null);
  const control = await taken();
  assert.deepEqual(asked()[0].args, { topic: "/cmd_vel", name: "js-1", action: "take", tick: 101 });
  assert.deepEqual([control.lease_ms, base.held, base.lease_ms, base.hold_ms, base.driver],
    [300, true, 300, 2000, "js-1"]);
});

test("a refusal is an error that says who drives", limit, async () => {
  const take = assert.rejects(base.take(), ({ code, said, answer: { driver } }) => {
    assert.deepEqual([code, said, driver], ["refused", "driven", "phone"]);
    return true;
  });
  await answer({ refused: "driven", driver: "phone", yours: false });
  await take;
  assert.deepEqual([base.held, lost], [false, []]);
});

test("taking over needs a tick, which comes with the refusal where none came yet", limit, async () => {
  const take = base.take_over();
  await answer({ refused: "tick", yours: false, driver: "phone", tick: 555 });
  assert.deepEqual(asked("take_over").map(({ args }) => args.tick), [undefined, 555]);
  await answer();
  assert.ok((await take).yours);
});

test("an old tick is not replaced: the request to take over has waited", limit, async () => {
  says("phone");
  const take = assert.rejects(base.take_over(), { said: "tick" });
  await answer({ refused: "tick", yours: false, driver: "phone" });
  await take;
  assert.equal(asked().length, 1);
});

test("a command is repeated twenty times a second, each time with the newest tick", limit, async () => {
  await taken();
  await clock.pass(50);
  assert.ok(base.set(twist(0.5)));
  assert.deepEqual(speeds(), [0.5], "at once");
  await drive_on(1000);
  assert.ok(speeds().length >= 20, `${speeds().length}`);
  const ticks = commands().slice(1).map((each) => each.tick);
  assert.deepEqual(ticks, [...ticks].sort((a, b) => a - b));
  assert.equal(new Set(ticks).size, ticks.length, "none twice");
});

test("what is set more often is thinned, and the last one holds", limit, async () => {
  await taken();
  await clock.pass(50);
  for (let i = 1; i <= 10; i += 1) assert.ok(base.set(twist(i)));
  assert.deepEqual(speeds(), [1]);
  await drive_on(50);
  assert.deepEqual(speeds(), [1, 10]);
});

test("a message that its sender writes to after set() does not change the command", limit, async () => {
  await taken();
  await clock.pass(50);
  const command = twist(0.5);
  base.set(command);
  command.linear.x = 100;
  await drive_on(100);
  assert.deepEqual([...new Set(speeds())], [0.5]);
});

test("halt() sends one command of zeros at once, and control is kept by heartbeats", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set({ ...twist(0.5), lights: true, frame: "base", gears: [1, 2] });
  assert.ok(base.halt());
  assert.deepEqual(commands().at(-1).msg, { ...twist(0), lights: false, frame: "base", gears: [0, 0] });
  const count = commands().length;
  await drive_on(3000);
  assert.equal(commands().length, count);
  assert.equal(asked("take").length, 7);
  assert.ok(base.held && !base.commanding);
});

test("another command to stand still may be given", limit, async () => {
  const arm = robot.drive("/arm", { zero: { hold: true }, name: "arm" });
  const take = arm.take();
  await answer({ topic: "/arm" });
  await take;
  assert.ok(arm.halt());
  assert.deepEqual(socket.published("/arm").map(({ msg }) => msg), [{ hold: true }]);
});

test("release() halts, gives control back, and nothing is sent after it", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  const release = base.release();
  assert.deepEqual([speeds(), asked("release").length, base.held], [[0.5, 0], 1, false]);
  await answer({ yours: false, driver: null });
  await release;
  await clock.pass(3000);
  assert.deepEqual([speeds().length, asked().length, lost], [2, 2, []]);
});

test("a release before the answer to a take wins", limit, async () => {
  const take = assert.rejects(base.take(), { code: "closed", message: /released before the answer/ });
  base.release().catch(() => {});
  assert.deepEqual(asked().map(({ args }) => args.action), ["take", "release"]);
  await answer({}, asked()[0]);
  await take;
  assert.ok(!base.held);
});

test("what was released while its answer was awaited is not asked for again", limit, async () => {
  const take = base.take().catch(({ code }) => code);
  base.close().catch(() => {});
  await answer({ refused: "tick", yours: false, driver: null }, asked("take").at(-1));
  assert.equal(await take, "refused");
  assert.deepEqual(asked().map(({ args }) => args.action), ["take", "release"]);
});

test("control is lost with the connection, and not taken again by itself", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  socket.end();
  assert.deepEqual(lost, [{ reason: "closed", driver: null, said: null }]);
  assert.deepEqual([base.held, base.commanding], [false, false]);
  robot.link.turn(true);
  socket = fake_socket.last;
  socket.open();
  says(null);
  await clock.pass(1000);
  assert.deepEqual([asked(), commands(), base.set(twist(0.5))], [[], [], false]);
});

test("ticks of another run of the robot count from the first one on, however small", limit, async () => {
  tick = 1e9;
  await taken();
  socket.end();
  robot.link.turn(true);
  socket = fake_socket.last;
  socket.open();
  tick = 5;
  says(null);
  base.take().catch(() => {});
  assert.equal(asked()[0].args.tick, 6);
});

test("control that another one took is lost, and who took it is known", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  says("js-1");
  says("phone");
  assert.deepEqual(lost, [{ reason: "taken_over", driver: "phone", said: null }]);
  const count = commands().length;
  assert.equal(base.set(twist(0.5)), false);
  await clock.pass(1000);
  assert.equal(commands().length, count);
});

test("another one by the same name is another one", limit, async () => {
  await taken();
  says("js-1");
  assert.deepEqual(lost, []);
  says("js-1", { number: 2 });
  assert.equal(lost[0].reason, "taken_over");
});

test("a state from before the answer takes nothing away", limit, async () => {
  const take = base.take();
  tick = 200;
  await answer();
  await take;
  tick = 150;
  says(null);
  assert.deepEqual([base.held, base.driver, lost], [true, "js-1", []]);
  tick = 300;
  says(null);
  assert.equal(lost[0].reason, "expired");
});

test("a heartbeat that is refused ends control, and says why", limit, async () => {
  for (const [refused, reason] of [["driven", "taken_over"], ["role", "refused"], ["topic", "refused"]]) {
    lost = [];
    await taken();
    await clock.pass(500);
    await answer({ refused, yours: false, driver: "phone" });
    assert.deepEqual(lost, [{ reason, driver: "phone", said: refused }]);
  }
});

test("a heartbeat on its way when control is lost does not take it again", limit, async () => {
  await taken();
  await clock.pass(500);
  const [, beat] = asked("take");
  says(null);
  assert.equal(asked().at(-1).args.action, "release");
  await answer({}, beat);
  assert.deepEqual([base.held, lost.length], [false, 1]);
});

test("control that nobody confirms for hold_ms is taken for lost", limit, async () => {
  await taken();
  await clock.pass(2000);
  assert.ok(base.held);
  await clock.pass(100);
  assert.deepEqual(lost, [{ reason: "expired", driver: "js-1", said: null }]);
});

test("a command that lapsed while the page stood still does not come back by itself", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  await drive_on(200);
  const count = commands().length;
  clock.skip(400);
  await drive_on(300);
  assert.deepEqual([commands().length, base.commanding, base.held], [count, false, true]);
  assert.ok(base.set(twist(0.5)), "somebody still holds it");
});

test("a command lapses, too, while the robot or the network says nothing", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  await drive_on(200);
  await clock.pass(250);
  assert.ok(base.commanding);
  await clock.pass(100);
  const count = commands().length;
  await drive_on(300);
  assert.deepEqual([commands().length, base.commanding, base.held], [count, false, true]);
});

test("on a network that does not move commands are left out, and lapse; not halt()", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  socket.bufferedAmount = 2000;
  const count = commands().length;
  await drive_on(200);
  assert.equal(commands().length, count);
  assert.ok(base.dropped > 0);
  assert.ok(base.commanding);
  await drive_on(300);
  assert.ok(!base.commanding);
  socket.bufferedAmount = 0;
  await drive_on(300);
  assert.equal(commands().length, count);
  socket.bufferedAmount = 2000;
  assert.ok(base.halt());
});

test("a stop ends the command; after a reset only a new one counts", limit, async () => {
  stop_says("running");
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  stop_says("stopped", 8);
  assert.equal(base.set(twist(0.5)), false);
  await drive_on(200);
  assert.ok(!base.commanding);
  stop_says("running", 8);
  const count = commands().length;
  await drive_on(200);
  assert.equal(commands().length, count);
  assert.ok(base.set(twist(0.5)));
  stop_says("running", 9);  // it was stopped and reset between two states
  await drive_on(200);
  assert.ok(!base.commanding);
});

test("a press of the stop ends the command before the robot has answered", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  robot.stop.press();
  assert.equal(base.set(twist(0.5)), false);
  await drive_on(200);
  assert.deepEqual(speeds(), [0.5]);
});

test("a number that is none is refused with its place, and nothing is sent", limit, async () => {
  await taken();
  await clock.pass(50);
  assert.throws(() => base.set(twist(NaN)), /^TypeError: command\.linear\.x is NaN/);
  assert.throws(() => base.set({ a: [0, Infinity] }), /command\.a\[1\] is Infinity/);
  await clock.pass(200);
  assert.deepEqual([commands(), base.commanding], [[], false]);
});

test("close() of the robot halts and forgets; that of a topic ends its subscription", limit, async () => {
  await taken();
  await clock.pass(50);
  base.set(twist(0.5));
  robot.close();
  assert.deepEqual([speeds(), lost[0].reason], [[0.5, 0], "closed"]);
  robot = connect("ws://robot/", { WebSocket: fake_socket });
  socket = fake_socket.last;
  socket.open();
  await robot.drive("/cmd_vel").close();
  assert.deepEqual(socket.of("unsubscribe").map(({ topic }) => topic), ["/rowe/control/state"]);
});

test("who drives is known to who does not", limit, async () => {
  let changes = 0;
  base.on("changed", () => (changes += 1));
  says("phone");
  says("phone");
  assert.deepEqual([base.driver, base.lease_ms, base.held, changes], ["phone", 300, false, 1]);
  await settled();
});
