// SPDX-License-Identifier: Apache-2.0
// The robot's stop as a client sees it, against sockets and clocks of our own.
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { connect } from "../../../clients/js/src/rowe.js";
import { fake_socket, fakes, settled } from "./fakes.js";

const limit = { timeout: 20000 };
const clock = fakes();
let robot, stop, first;
const last = () => fake_socket.last;
const state = (more) => ({
  state: "running", number: 7, cause: null, source: null, since_ms: 1000, tick: 100, unguarded: false,
  guards: [], loops: [], ...more,
});
const says = (more, socket = first) => socket.publish("/rowe/stop/state", state(more));
const presses = (socket = first) => socket.calls("/rowe/stop");
const acknowledged = { number: 8, accepted_ns: "9007199254740993000", observed_ns: "9007199254741333000" };
const beats = () => first.calls("/rowe/stop/guard").map(({ args }) => args);

function begin(options) {
  robot?.close();
  robot = connect("ws://robot:8080/?token=x", { WebSocket: fake_socket, name: "js-1", ...options });
  ({ stop } = robot);
  first = last();
}
beforeEach(() => {
  begin();
  first.open();
});
afterEach(() => robot.close());

test("a robot is asked whether it has a stop, and may have none", limit, async () => {
  assert.equal(stop.configured, null);
  await first.answer(first.calls("/rowe/stop/state")[0], "Service /rowe/stop/state does not exist", false);
  assert.equal(stop.configured, false);
  says();
  assert.equal(stop.configured, true, "a loop took a latch later");
});

test("a press asks at once, and changes nothing of what the robot is", limit, () => {
  says();
  stop.press({ source: "thumb", reason: "a child" });
  assert.deepEqual(presses().map(({ args }) => args), [{ source: "thumb", reason: "a child" }]);
  assert.deepEqual([stop.pending, stop.stopped], [true, false]);
});

test("a stop is acknowledged with the time since the press and the robot's own", limit, async () => {
  const press = stop.press();
  await clock.pass(4);
  await first.answer(presses()[0], acknowledged);
  const { number, took_ms, own_ms } = await press;
  assert.deepEqual([number, took_ms, own_ms, stop.pending], [8, 4, 0.34, false]);
});

test("it is asked for again each half second until it is acknowledged", limit, async () => {
  stop.press();
  await clock.pass(500);
  assert.ok(!stop.overdue);
  await clock.pass(1500);
  assert.equal(presses().length, 5);
  assert.ok(stop.overdue);
  await first.answer(presses()[1], acknowledged);
  assert.ok(!stop.overdue && !stop.pending);
  await clock.pass(2000);
  assert.equal(presses().length, 5);
});

test("an answer of a robot whose loop did not acknowledge is no acknowledgment", limit, async () => {
  stop.press();
  await first.answer(presses()[0], { ...acknowledged, observed_ns: null });
  assert.ok(stop.pending);
});

test("who waits in vain is told so, and the asking goes on", limit, async () => {
  const waits = assert.rejects(stop.press({ timeout_ms: 700 }), {
    code: "timed_out",
    message: "/rowe/stop: not acknowledged within 700 ms: the robot says why",
  });
  stop.press({ timeout_ms: 100 });
  await first.answer(presses()[0], "the robot says why", false);
  await clock.pass(700);
  await waits;
  const count = presses().length;
  await clock.pass(1000);
  assert.equal(presses().length, count + 2);
});

test("a robot that has no stop for five seconds is not asked for ever", limit, async () => {
  const waits = assert.rejects(stop.press({ timeout_ms: 60000 }),
    { message: "/rowe/stop: Service /rowe/stop does not exist" });
  for (let passed = 0; passed <= 5000; passed += 500) {
    assert.ok(stop.pending);
    await first.answer(presses().at(-1), "Service /rowe/stop does not exist", false);
    await clock.pass(500);
  }
  await first.answer(presses().at(-1), "Service /rowe/stop does not exist", false);
  await waits;
  const count = presses().length;
  await clock.pass(1000);
  assert.deepEqual([presses().length, stop.configured, stop.pending], [count, false, false]);
});

test("a press that was not answered is asked for again on the next connection", limit, async () => {
  stop.press();
  first.end();
  robot.link.turn(true);
  const next = fake_socket.made.find((each) => each !== first && !each.url.includes("rowe/stop"));
  next.open();
  assert.equal(presses(next).length, 1);
});

test("without a connection a press goes to the places that are reserved for the stop", limit, async () => {
  begin();
  stop.press();
  const kept = last();
  assert.equal(kept.url, "ws://robot:8080/rowe/stop?token=x");
  kept.open();
  assert.equal(presses(kept).length, 1);
  assert.ok(stop.limited);
  says({ state: "stopped", number: 8 }, kept);
  assert.ok(stop.stopped);
  await kept.answer(presses(kept)[0], acknowledged);
  assert.ok(!stop.pending);
  first.open();
  await clock.pass(50);
  assert.ok(kept.closed, "the place is free for others");
  assert.deepEqual([stop.limited, stop.known], [false, false]);
  await clock.pass(3000);
  assert.equal(last(), kept, "no other one while the first stands");
});

test("such a place is taken before a press only where that is asked for", limit, async () => {
  begin();
  await clock.pass(3000);
  assert.equal(last(), first);
  begin({ reserved: true });
  await clock.pass(450);
  assert.equal(last(), first);
  await clock.pass(50);
  assert.notEqual(last(), first);
  begin({ reserved: true });
  first.end();
  await clock.pass(50);
  assert.match(last().url, /rowe\/stop/);
});

test("an acknowledgment is forgotten once the robot runs again, not before", limit, async () => {
  stop.press();
  await first.answer(presses()[0], acknowledged);
  says({ state: "stopped", number: 8 });
  assert.ok(stop.asked);
  says({ number: 9 });
  assert.equal(stop.asked, null);
});

test("an acknowledgment is not told of another stop, of a robot that started anew", limit, async () => {
  says({ state: "stopped", number: 7, cause: "guard" });
  stop.press();
  await first.answer(presses()[0], acknowledged);
  says({ state: "stopped", number: 7, cause: "guard" });
  assert.ok(stop.asked, "a state from before the press");
  says({ state: "stopped", number: 8 });
  assert.ok(stop.asked);
  says({ state: "stopped", number: 900, cause: "start" });
  assert.equal(stop.asked, null);
});

test("what the robot said last holds only while it goes on speaking", limit, async () => {
  says({ state: "stopped" });
  assert.deepEqual([stop.known, stop.stopped], [true, true]);
  await clock.pass(1000);
  assert.deepEqual([stop.known, stop.stopped, stop.state.number], [false, null, 7]);
  says();
  first.end();
  assert.deepEqual([stop.known, stop.stopped], [false, null]);
});

test("a reset names the stop that was shown, and its refusal is an error", limit, async () => {
  says({ state: "stopped", number: 8, tick: 120 });
  const reset = assert.rejects(stop.reset(8), ({ code, said, message }) => {
    assert.deepEqual([code, said, message], ["refused", "guards", "/rowe/stop/reset: refused: guards"]);
    return true;
  });
  const [call] = first.calls("/rowe/stop/reset");
  assert.deepEqual(call.args, { number: 8, tick: 120 });
  await first.answer(call, { state: "stopped", number: 8, refused: "guards" });
  await reset;
  const other = stop.reset();
  await first.answer(first.calls("/rowe/stop/reset")[1], { state: "running", number: 8, refused: null });
  assert.equal((await other).state, "running");
});

test("a reset with an old tick is refused, and not asked for again by itself", limit, async () => {
  says({ state: "stopped", number: 8, tick: 120 });
  const reset = assert.rejects(stop.reset(8), { said: "tick" });
  await first.answer(first.calls("/rowe/stop/reset")[0], { refused: "tick", tick: 500 });
  await reset;
  assert.equal(first.calls("/rowe/stop/reset").length, 1);
});

test("a guard answers ticks as they come, and nothing but ticks", limit, async () => {
  says();
  const guard = stop.guard();
  await first.answer(first.calls("/rowe/stop/guard")[0], { refused: null, tick: 101 });
  await guard;
  says({ tick: 120 });
  await clock.pass(3000);
  assert.deepEqual(beats(), [{ guard: "js-1", tick: 100 }, { guard: "js-1", tick: 120 }]);
});

test("a guard that knows no tick yet gets one with the refusal", limit, async () => {
  const guard = stop.guard();
  await first.answer(first.calls("/rowe/stop/guard")[0], { refused: "tick", tick: 77 });
  await first.answer(first.calls("/rowe/stop/guard")[1], { refused: null, tick: 78 });
  await guard;
  assert.deepEqual(beats().map(({ tick }) => tick), [0, 77]);
  assert.ok(stop.guarding);
});

test("one that may not guard is told so; an old tick does not end the guarding", limit, async () => {
  says();
  stop.guard().catch(() => {});
  for (const refused of ["tick", "name"]) {
    says({ tick: 130 });
    await first.answer(first.calls("/rowe/stop/guard").at(-1), { refused });
    assert.ok(stop.guarding);
  }
  says({ tick: 140 });
  await first.answer(first.calls("/rowe/stop/guard").at(-1), { refused: "guards" });
  assert.deepEqual([stop.guarding, stop.refused], [false, "guards"]);
  const role = assert.rejects(stop.guard(), { said: "role" });
  await first.answer(first.calls("/rowe/stop/guard").at(-1), { refused: "role", right: "guard" });
  await role;
  assert.deepEqual([stop.guarding, stop.refused], [false, "role"]);
});

test("letting go resigns, and what is gone can be dismissed", limit, async () => {
  says();
  stop.guard().catch(() => {});
  stop.let_go().catch(() => {});
  assert.deepEqual(beats().at(-1), { guard: "js-1", tick: 100, resign: true });
  assert.ok(!stop.guarding);
  says({ tick: 150 });
  assert.equal(beats().length, 2);
  stop.dismiss("phone").catch(() => {});
  assert.deepEqual(beats().at(-1), { guard: "phone", tick: 150, resign: true });
});

test("close() ends a press that waits", limit, async () => {
  const press = assert.rejects(stop.press(), { code: "closed" });
  robot.close();
  await press;
  await settled();
  assert.equal(clock.timers.size, 0);
});
