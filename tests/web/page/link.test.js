// SPDX-License-Identifier: Apache-2.0
// The connection's life against a socket and clocks of our own.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { load } from "./load.js";

const { kept_link, link, retry_ms } = await load("link.js");

class fake_socket {
  static last = null;
  sent = [];
  closed = false;
  constructor() { fake_socket.last = this; }
  send(text) { this.sent.push(JSON.parse(text)); }
  close() { this.closed = true; }
}

let monotonic, calendar, received, opened, made;
const pass = (ms) => { monotonic += ms; calendar += ms; };
const socket = () => fake_socket.last;

beforeEach(() => {
  [monotonic, calendar, received, opened] = [1000, 5e11, [], 0];
  globalThis.WebSocket = fake_socket;
  Object.defineProperty(globalThis, "performance", { value: { now: () => monotonic }, configurable: true });
  Date.now = () => calendar;
  made = new link("ws://robot/", {
    opened: () => (opened += 1),
    received: (message) => received.push(message),
  });
});

test("attempts come after a quarter of a second, then ever later, up to five seconds", () => {
  assert.deepEqual([0, 1, 2, 3, 4, 5, 99].map(retry_ms), [250, 500, 1000, 2000, 4000, 5000, 5000]);
});

test("what is said before the connection stands is dropped, not kept", () => {
  made.send({ op: "old" });
  socket().onopen();
  made.send({ op: "new" });
  assert.deepEqual(socket().sent, [{ op: "new" }]);
  assert.equal(opened, 1);
});

test("a refused connection is tried again when its time has come", () => {
  const first = socket();
  first.onclose();
  assert.equal(made.state, "disconnected");
  pass(249);
  made.turn();
  assert.equal(socket(), first);
  assert.equal(made.retry_in_ms, 1);
  pass(1);
  made.turn();
  assert.notEqual(socket(), first);
  assert.equal(made.state, "retrying");
});

test("the waits grow while nobody speaks, even if somebody accepts", () => {
  for (const wait of [250, 500, 1000]) {
    socket().onopen();
    socket().onclose();
    assert.equal(made.retry_in_ms, wait);
    pass(wait);
    made.turn();
  }
  socket().onopen();
  socket().onmessage({ data: '{"op":"publish"}' });
  socket().onclose();
  assert.equal(made.retry_in_ms, 250);
});

test("an attempt without an answer is given up", () => {
  const first = socket();
  pass(4000);
  made.turn();
  assert.equal(made.state, "disconnected");
  assert.ok(first.closed);
  assert.equal(first.onopen, null);
});

test("a connection that says nothing for ten seconds is given up", () => {
  socket().onopen();
  pass(9999);
  made.turn();
  assert.equal(made.state, "open");
  pass(1);
  made.turn();
  assert.equal(made.state, "disconnected");
});

test("a phone that slept notices by the calendar what its monotonic clock missed", () => {
  socket().onopen();
  calendar += 60000;
  made.turn();
  assert.equal(made.state, "disconnected");
});

test("a calendar that is set back makes nothing young", () => {
  socket().onopen();
  calendar -= 3600000;
  monotonic += 10000;
  made.turn();
  assert.equal(made.state, "disconnected");
});

test("a page that comes back does not wait for the next attempt", () => {
  const first = socket();
  first.onclose();
  made.turn(true);
  assert.notEqual(socket(), first);
});

test("what is no JSON object with an op is ignored", () => {
  socket().onopen();
  for (const data of ["{", "3", "null", "[]", '{"x":1}', new ArrayBuffer(4)]) socket().onmessage({ data });
  assert.deepEqual(received, []);
  socket().onmessage({ data: '{"op":"status","msg":"yes"}' });
  assert.deepEqual(received, [{ op: "status", msg: "yes" }]);
});

// ---- the second connection

const kept_beside = (first) => new kept_link("ws://robot/rowe/stop", first, { opened() {}, received() {} });

test("a second connection is made only when the first is refused", () => {
  const first = socket();
  const kept = kept_beside(made);
  kept.turn();
  assert.equal(socket(), first);
  first.onclose();
  kept.turn();
  assert.notEqual(socket(), first);
  assert.equal(kept.state, "connecting");
  socket().onopen();
  kept.send({ op: "x" });
  assert.deepEqual(socket().sent, [{ op: "x" }]);
});

test("or when it is late", () => {
  const first = socket();
  const kept = kept_beside(made);
  pass(499);
  kept.turn();
  assert.equal(socket(), first);
  pass(1);
  kept.turn();
  assert.notEqual(socket(), first);
});

test("and it ends when the first one is there", () => {
  const first = socket();
  const kept = kept_beside(made);
  pass(500);
  kept.turn();
  const second = socket();
  second.onopen();
  first.onopen();
  kept.turn();
  assert.ok(second.closed);
  assert.equal(kept.state, "disconnected");
  pass(60000);
  kept.turn();
  assert.equal(socket(), second, "no third one while the first stands");
});

test("who lost a place that another one needed comes back later, unless there is a hurry", () => {
  socket().onopen();
  const lost = socket();
  lost.onclose({ code: 1013 });
  pass(1999);
  made.turn();
  assert.equal(socket(), lost);
  made.turn(true);
  assert.notEqual(socket(), lost);
});
