// SPDX-License-Identifier: Apache-2.0
// What is said on each connection, and how calls end, against a socket and clocks of our own.
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { connect, robot_error } from "../../../clients/js/src/rowe.js";
import { fake_socket, fakes, settled } from "./fakes.js";

const limit = { timeout: 20000 };
const clock = fakes();
let robot;
const socket = () => fake_socket.last;
const options = { WebSocket: fake_socket, decode: (bytes) => JSON.parse(new TextDecoder().decode(bytes)) };
// Of a test, and not of the stop's state.
const asked = (op) => socket().of(op).filter(({ topic }) => !topic.startsWith("/rowe/"));
const fails = (promise, code, words) => assert.rejects(promise, (error) => {
  assert.ok(error instanceof robot_error);
  assert.equal(error.code, code);
  assert.match(error.message, words);
  return true;
});
function again() {
  const before = socket();
  before.end();
  robot.link.turn(true);
  assert.notEqual(socket(), before);
  socket().open();
}

beforeEach(() => (robot = connect("http://robot:8080", options)));
afterEach(() => robot.close());

// ---- connecting

test("http is ws, and a token is offered beside the subprotocol that is spoken", limit, () => {
  assert.deepEqual([socket().url, socket().protocols], ["ws://robot:8080/", []]);
  let word = "one";
  connect("wss://robot/", { ...options, token: () => word }).close();
  assert.deepEqual(socket().protocols, ["rowe.v1", "rowe.token.one"]);
});

test("where there is no WebSocket, the error says what to do", limit, () => {
  assert.throws(() => connect("ws://robot/", { WebSocket: null }), (error) => {
    assert.equal(error.code, "no_websocket");
    assert.match(error.message, /npm install ws/);
    return true;
  });
});

test("opened() waits for the connection, and not for ever", limit, async () => {
  const waits = robot.opened();
  socket().end();
  await clock.pass(250);
  socket().open();
  assert.equal(await waits, robot);
  assert.equal(await robot.opened(), robot);
  socket().end();
  const words = /not open within 300 ms \(disconnected, attempt 2\)/;
  const late = fails(robot.opened({ timeout_ms: 300 }), "timed_out", words);
  await clock.pass(300);
  await late;
  const ended = fails(robot.opened(), "closed", /closed here/);
  robot.close();
  await ended;
  await fails(robot.opened(), "closed", /closed here/);
});

test("the events say what became of a connection", limit, async () => {
  const seen = [];
  for (const name of ["open", "closed", "refused"]) robot.on(name, (why) => seen.push([name, why?.code]));
  socket().end(1006);
  await clock.pass(250);
  socket().open();
  socket().end(1001);
  robot.close();
  assert.deepEqual(seen, [["refused", 1006], ["open", undefined], ["closed", 1001], ["closed", 1000]]);
});

test("a robot that has nothing to say is asked for the time, and not taken for gone", limit, async () => {
  socket().open();
  for (let i = 0; i < 5; i += 1) {
    await clock.pass(5000);
    const probe = socket().calls("/rosapi/get_time").at(-1);
    await socket().answer(probe, {});
  }
  assert.equal(fake_socket.made.length, 1);
  await clock.pass(10000);
  assert.notEqual(robot.state, "open", "one that does not answer is gone");
});

// ---- subscriptions

test("nothing is subscribed to before the connection stands, and everything on each one", limit, async () => {
  robot.subscribe("/odom", () => {}, { type: "nav_msgs/Odometry", hz: 30 });
  robot.advertise("/mine", "std_msgs/String", { latch: true });
  assert.deepEqual(socket().sent, []);
  for (let i = 0; i < 2; i += 1) {
    again();
    const [{ id, ...subscribe }] = asked("subscribe");
    assert.deepEqual(subscribe, {
      op: "subscribe", topic: "/odom", type: "nav_msgs/Odometry", throttle_rate: 33, queue_length: 1,
    });
    assert.equal(typeof id, "string");
    const [{ topic, type, latch }] = asked("advertise");
    assert.deepEqual([topic, type, latch], ["/mine", "std_msgs/String", true]);
  }
});

test("two subscriptions to one topic share one on the wire, at the quicker rate", limit, () => {
  socket().open();
  const got = [[], []];
  const slow = robot.subscribe("/odom", (msg) => got[0].push(msg), { throttle_ms: 100 });
  const quick = robot.subscribe("/odom", (msg) => got[1].push(msg), { throttle_ms: 20, queue_length: 3 });
  const rates = asked("subscribe").map(({ throttle_rate, queue_length }) => [throttle_rate, queue_length]);
  assert.deepEqual(rates, [[100, 1], [20, 3]]);
  assert.equal(new Set(asked("subscribe").map(({ id }) => id)).size, 1);
  socket().publish("/odom", 1);
  assert.deepEqual(got, [[1], [1]]);
  quick.unsubscribe();
  assert.equal(asked("subscribe").at(-1).throttle_rate, 100);
  assert.deepEqual(asked("unsubscribe"), []);
  socket().publish("/odom", 2);
  assert.deepEqual(got, [[1, 2], [1]]);
  slow.unsubscribe();
  slow.unsubscribe();
  assert.equal(asked("unsubscribe").length, 1);
  assert.equal(asked("unsubscribe")[0].id, asked("subscribe")[0].id);
});

test("what was unsubscribed from is not asked for on the next connection", limit, async () => {
  socket().open();
  robot.subscribe("/odom", () => {}).unsubscribe();
  robot.advertise("/mine", "x/Y").unadvertise();
  assert.deepEqual(asked("unadvertise").map(({ topic }) => topic), ["/mine"]);
  again();
  assert.deepEqual([asked("subscribe"), asked("advertise")], [[], []]);
});

test("the age of what is shown grows, and is infinite without a value", limit, async () => {
  socket().open();
  const odometry = robot.subscribe("/odom", () => {});
  assert.deepEqual([odometry.age_ms(), odometry.fresh()], [Infinity, false]);
  socket().publish("/odom", { x: 1 });
  await clock.pass(400);
  assert.deepEqual([odometry.age_ms(), odometry.fresh(), odometry.fresh(400)], [400, true, false]);
  clock.calendar += 5000;
  assert.equal(odometry.age_ms(), 5400, "a phone slept");
});

test("what came on an earlier connection is old until a new value came (roslibjs 246)", limit, async () => {
  socket().open();
  const odometry = robot.subscribe("/odom", () => {});
  socket().publish("/odom", { x: 1 });
  assert.ok(odometry.fresh());
  socket().end();
  assert.ok(!odometry.fresh(60000));
  await clock.pass(250);
  socket().open();
  assert.ok(!odometry.fresh(60000), "nothing came on this one");
  assert.deepEqual([odometry.last, odometry.age_ms()], [{ x: 1 }, 250]);
  socket().publish("/odom", { x: 2 });
  assert.ok(odometry.fresh());
});

test("a later listener gets the last value of this connection, if it asks for that", limit, async () => {
  socket().open();
  const got = [];
  const map = { qos: { durability: "transient_local" } };
  robot.subscribe("/map", () => {});
  socket().publish("/map", 1);
  robot.subscribe("/map", (msg) => got.push(["plain", msg]));
  robot.subscribe("/map", (msg, of) => got.push(["late", msg, of.age_ms()]), map);
  robot.subscribe("/map", (msg) => got.push(["gone", msg]), map).unsubscribe();
  await clock.pass(100);
  assert.deepEqual(got, [["late", 1, 0]]);
  again();
  robot.subscribe("/map", (msg) => got.push(["later", msg]), map);
  await settled();
  assert.equal(got.length, 1);
});

test("a fault of one listener keeps nothing from the others, and is reported", limit, async () => {
  socket().open();
  const uncaught = [];
  const listeners = process.listeners("uncaughtException");
  process.removeAllListeners("uncaughtException");
  process.on("uncaughtException", ({ message }) => uncaught.push(message));
  try {
    let got = 0;
    robot.subscribe("/odom", () => { throw new Error("mine"); });
    robot.subscribe("/odom", () => (got += 1));
    socket().publish("/odom", {});
    await settled();
    assert.deepEqual([got, uncaught], [1, ["mine"]]);
  } finally {
    process.removeAllListeners("uncaughtException");
    for (const each of listeners) process.on("uncaughtException", each);
  }
});

test("a refused subscription says so in the robot's words, until a value comes", limit, () => {
  socket().open();
  const told = [];
  robot.on("status", ({ msg }) => told.push(msg));
  const odometry = robot.subscribe("/odom", () => {});
  const [{ id }] = asked("subscribe");
  socket().say({ op: "status", level: "warning", id, msg: "a warning" });
  assert.equal(odometry.refused, null);
  socket().say({ op: "status", level: "error", id, msg: "topics_max is 64" });
  assert.equal(odometry.refused, "topics_max is 64");
  assert.deepEqual(told, ["a warning", "topics_max is 64"]);
  socket().publish("/odom", {});
  assert.equal(odometry.refused, null);
});

test("an encoding is asked for, and needs somebody who reads it", limit, () => {
  socket().open();
  let got;
  robot.subscribe("/scan", (msg) => (got = msg), { encoding: "cbor" });
  assert.equal(asked("subscribe")[0].compression, "cbor");
  const bytes = new TextEncoder().encode('{"op":"publish","topic":"/scan","msg":[1]}');
  socket().onmessage({ data: bytes.buffer });
  assert.deepEqual(got, [1]);
  const other = connect("ws://robot/", { WebSocket: fake_socket });
  assert.throws(() => other.subscribe("/scan", () => {}, { encoding: "cbor" }), /"cbor" needs connect/);
  other.close();
});

test("what is large has a second connection, which ends with the first", limit, async () => {
  socket().open();
  const first = socket();
  const images = [];
  const one = robot.subscribe("/camera", (msg) => images.push(msg), { apart: true });
  const other = robot.subscribe("/map", () => {}, { apart: true });
  const second = socket();
  assert.notEqual(second, first);
  assert.deepEqual([second.url, second.protocols], [first.url, first.protocols]);
  second.open();
  assert.deepEqual(asked("subscribe").map(({ topic }) => topic), ["/camera", "/map"]);
  assert.deepEqual(first.of("subscribe").filter(({ topic }) => !topic.startsWith("/rowe/")), []);
  second.publish("/camera", 1);
  assert.deepEqual([images, one.fresh()], [[1], true]);
  const said = [];
  robot.on("status", ({ msg }) => said.push(msg));
  second.say({ op: "status", level: "error", msg: "no" });
  assert.deepEqual(said, ["no"]);
  second.end();
  assert.deepEqual([robot.state, one.fresh()], ["open", false], "the first one does not end with it");
  await clock.pass(300);
  assert.ok(socket() !== second && socket().url === second.url, "it comes back");
  socket().open();
  const third = socket();
  first.end();
  assert.ok(third.closed, "it takes no place that the first one needs");
  await clock.pass(300);
  const again = socket();
  assert.deepEqual(asked("subscribe"), []);
  again.open();
  socket().open();
  assert.deepEqual([again === socket(), asked("subscribe").length], [false, 2]);
  const fourth = socket();
  one.unsubscribe();
  other.unsubscribe();
  await clock.pass(50);
  assert.ok(fourth.closed && !again.closed, "nobody wants it any more");
  robot.close();
  assert.equal(fake_socket.made.every((each) => each.closed), true);
});

// ---- publishing

test("what is published without a connection is dropped and counted, never kept", limit, async () => {
  const mine = robot.advertise("/mine", "x/Y");
  assert.equal(robot.publish("/mine", 1), false);
  assert.equal(mine.publish(2), false);
  socket().open();
  assert.deepEqual([asked("publish"), robot.dropped], [[], 2]);
  assert.equal(mine.publish(3), true);
  socket().bufferedAmount = 65537;
  assert.equal(mine.publish(4), false);
  again();
  assert.deepEqual([asked("publish"), robot.dropped], [[], 3]);
});

// ---- calls

test("a call has its answer, or the robot's refusal", limit, async () => {
  socket().open();
  const [sum, none] = [robot.call("/add", { a: 1, b: 2 }), robot.call("/none")];
  const [add] = socket().calls("/add");
  assert.deepEqual(add.args, { a: 1, b: 2 });
  const refused = assert.rejects(none, ({ code, said, message }) => {
    assert.deepEqual([code, said], ["refused", "Service /none does not exist"]);
    assert.equal(message, "/none: Service /none does not exist");
    return true;
  });
  await socket().answer(socket().calls("/none")[0], "Service /none does not exist", false);
  await refused;
  await socket().answer(add, { sum: 3 });
  assert.deepEqual(await sum, { sum: 3 });
});

test("a call without a connection fails at once, and is not sent later", limit, async () => {
  await fails(robot.call("/add"), "closed", /^\/add: no connection to ws:\/\/robot:8080\/ \(connecting\)$/);
  socket().open();
  assert.deepEqual(socket().calls("/add"), []);
});

test("a call that is not answered ends, and says after how long", limit, async () => {
  socket().open();
  const words = /^\/slow: no answer within 700 ms$/;
  const late = fails(robot.call("/slow", {}, { timeout_ms: 700 }), "timed_out", words);
  const other = fails(robot.call("/slow"), "timed_out", /within 5000 ms/);
  await clock.pass(700);
  await late;
  await socket().answer(socket().calls("/slow")[0], {});
  await clock.pass(4300);
  await other;
});

test("a call that the connection's end leaves open says that nobody knows", limit, async () => {
  socket().open();
  const lost = fails(robot.call("/slow"), "lost", /ended \(1001 going\) before an answer/);
  socket().end(1001, "going");
  await lost;
  assert.equal(clock.timers.size, 1, "only the link's timer is left");
});

test("close() ends calls, and leaves no timer", limit, async () => {
  socket().open();
  const lost = fails(robot.call("/slow"), "lost", /closed here/);
  robot.close();
  await lost;
  assert.equal(clock.timers.size, 0);
  await fails(robot.call("/slow"), "closed", /\(closed\)/);
  assert.equal(robot.publish("/x", 1), false);
});
