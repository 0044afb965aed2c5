// SPDX-License-Identifier: Apache-2.0
// The connection's life against a socket and clocks of our own.
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { link, retry_ms } from "../../../clients/js/src/link.js";
import { fake_socket, fakes, settled } from "./fakes.js";

const limit = { timeout: 20000 };
const clock = fakes();
let made, received, opened, closed;
const socket = () => fake_socket.last;
const count = () => fake_socket.made.length;

beforeEach(() => {
  [received, opened, closed] = [[], 0, []];
  const events = {
    opened: () => (opened += 1),
    received: (message) => received.push(message),
    closed: (why, was_open) => closed.push({ ...why, was_open }),
  };
  made = new link("ws://robot/", events, { WebSocket: fake_socket, decode: ([op]) => ({ op: `${op}` }) });
});
afterEach(() => made.close());

test("attempts come after a quarter of a second, then ever later, up to five seconds", limit, () => {
  assert.deepEqual([0, 1, 2, 3, 4, 5, 99].map(retry_ms), [250, 500, 1000, 2000, 4000, 5000, 5000]);
});

test("what is said before the connection stands is dropped, not kept", limit, () => {
  assert.equal(made.send({ op: "old" }), false);
  socket().open();
  assert.equal(made.send({ op: "new" }), true);
  assert.deepEqual(socket().sent, [{ op: "new" }]);
  assert.equal(opened, 1);
});

test("what would wait in the socket behind too much is dropped, too", limit, () => {
  socket().open();
  socket().bufferedAmount = 1001;
  assert.equal(made.send({ op: "late" }, 1000), false);
  assert.equal(made.send({ op: "urgent" }), true);
  assert.deepEqual(socket().sent, [{ op: "urgent" }]);
});

test("a refused connection is tried again when its time has come", limit, async () => {
  socket().end();
  assert.equal(made.state, "disconnected");
  await clock.pass(200);
  assert.deepEqual([count(), made.retry_in_ms], [1, 50]);
  await clock.pass(50);
  assert.deepEqual([count(), made.state, made.retry_in_ms], [2, "retrying", 0]);
  assert.deepEqual(closed, [{ code: 1006, reason: "", was_open: false }]);
});

test("the waits grow while nobody speaks, even if somebody accepts", limit, async () => {
  for (const wait of [250, 500, 1000]) {
    socket().open();
    socket().end();
    assert.equal(made.retry_in_ms, wait);
    await clock.pass(wait);
  }
  socket().open();
  socket().say({ op: "publish" });
  socket().end();
  assert.equal(made.retry_in_ms, 250);
});

test("an attempt without an answer is given up, and another one is made", limit, async () => {
  const first = socket();
  await clock.pass(3950);
  assert.equal(made.state, "connecting");
  await clock.pass(50);
  assert.equal(made.state, "disconnected");
  assert.ok(first.closed);
  assert.equal(first.onopen, null);
  await clock.pass(250);
  assert.equal(count(), 2);
});

test("a connection that says nothing for ten seconds is given up, and says why", limit, async () => {
  socket().open();
  await clock.pass(9950);
  assert.equal(made.state, "open");
  await clock.pass(50);
  assert.equal(made.state, "disconnected");
  assert.deepEqual(closed, [{ code: 1006, reason: "silent for 10000 ms", was_open: true }]);
});

test("a phone that slept notices by the calendar what its monotonic clock missed", limit, async () => {
  socket().open();
  clock.calendar += 60000;
  await clock.pass(50);
  assert.equal(made.state, "disconnected");
});

test("a calendar that is set back makes nothing young", limit, async () => {
  socket().open();
  clock.calendar -= 3600000;
  await clock.pass(10000);
  assert.equal(made.state, "disconnected");
});

test("a page that comes back does not wait for the next attempt", limit, () => {
  socket().end();
  made.turn(true);
  assert.equal(count(), 2);
  made.turn(true);
  assert.equal(count(), 2, "one attempt at a time");
});

test("who lost a place to another one comes back later, unless there is a hurry", limit, async () => {
  socket().open();
  socket().end(1013);
  await clock.pass(1950);
  assert.equal(count(), 1);
  made.turn(true);
  assert.equal(count(), 2);
});

test("what is no object with an op is ignored, and a binary message is decoded", limit, () => {
  socket().open();
  for (const data of ["{", "3", "null", "[]", '{"x":1}']) socket().onmessage({ data });
  assert.deepEqual(received, []);
  socket().say({ op: "status", msg: "yes" });
  socket().onmessage({ data: new Uint8Array([7]).buffer });
  assert.deepEqual(received, [{ op: "status", msg: "yes" }, { op: "7" }]);
});

test("an old socket is not heard any more once it was given up", limit, async () => {
  const first = socket();
  first.open();
  await clock.pass(10250);
  assert.equal(count(), 2);
  first.say({ op: "publish" });
  first.end();
  assert.deepEqual([received, made.state], [[], "retrying"]);
});

test("after close() no attempt comes and no timer is left that keeps Node from ending", limit, async () => {
  socket().end();
  made.close();
  assert.equal(clock.timers.size, 0);
  await clock.pass(60000);
  made.turn(true);
  assert.deepEqual([count(), made.state], [1, "closed"]);
});

test("a token that no socket can offer is a refused attempt, and the clock goes on", limit, async () => {
  let turned = 0;
  const odd = new link("ws://robot/", { closed: (why) => closed.push(why), turned: () => (turned += 1) },
    { WebSocket: class { constructor() { throw new SyntaxError("odd"); } } });
  await settled();
  assert.deepEqual([odd.state, closed.at(-1)], ["disconnected", { code: 1006, reason: "odd" }]);
  await clock.pass(1000);
  assert.ok(closed.length > 1 && turned > 15, `${closed.length} attempts, ${turned} turns`);
  odd.close();
});
