// SPDX-License-Identifier: Apache-2.0
// The client of clients/js in Node, with the npm package ws, against the program. Two reports of roslibjs are
// reenacted: a page does not come back after the robot has restarted (497), and what it shows then is old and
// looks new (246).
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { afterEach, test } from "node:test";
import { fileURLToPath } from "node:url";
import { WebSocket } from "ws";
import { connect } from "../../../clients/js/src/rowe.js";
import { robot } from "../support/robot.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until, watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 120000 };
const patient = { timeout_ms: watchdog_ms };
const made = [];

// Node 18.15 runs neither before() nor after() of a file. So the program must not keep this one from ending,
// with which it ends.
const server = await robot.start();
for (const each of [server.child, server.child.stdout, server.child.stderr]) each.unref();
afterEach(() => {
  for (const one of made.splice(0)) one.close();
});

async function connected(url = server.url, options = {}) {
  const one = connect(url, { WebSocket, ...options });
  made.push(one);
  return one.opened(patient);
}
// Lets it run where it was stopped, by a test or by a busy machine.
const running = (one) => until("it runs", async () => {
  if (one.stop.stopped === false) return true;
  if (one.stop.stopped) await one.stop.reset(one.stop.state.number, patient).catch(() => {});
  return false;
});

test("it shows a topic with its age, at the rate that was asked for", limit, async () => {
  const one = await connected();
  const times = [];
  const odometry = one.subscribe("/odom", (msg, of) => times.push(of.age_ms()), { hz: 20 });
  await until("ten poses", () => times.length >= 10);
  assert.ok(odometry.fresh(watchdog_ms));
  assert.equal(typeof odometry.last.pose.pose.position.x, "number");
  odometry.unsubscribe();
  await one.call("/rosapi/get_time", {}, patient);  // it was read
  const count = times.length;
  await one.call("/rosapi/get_time", {}, patient);
  assert.equal(times.length, count);
});

test("two listeners of one topic cost the robot one subscription", limit, async () => {
  const one = await connected();
  let got = [0, 0];
  for (const at of [0, 1]) one.subscribe("/odom", () => (got[at] += 1), { throttle_ms: 20 * (at + 1) });
  await until("both", () => got[0] > 3 && got[1] > 3);
  assert.deepEqual(got[0], got[1]);
});

test("calls are answered, refused in the robot's words, and end", limit, async () => {
  const one = await connected();
  assert.deepEqual(await one.call("/robot/set_speed", { speed: 0.25 }, patient), { speed: 0.25 });
  await assert.rejects(one.call("/no/such", {}, patient), {
    code: "refused", said: "Service /no/such does not exist",
    message: "/no/such: Service /no/such does not exist",
  });
  await server.pause();
  try {
    await assert.rejects(one.call("/robot/set_speed", { speed: 0.25 }, { timeout_ms: 300 }),
      { code: "timed_out", message: "/robot/set_speed: no answer within 300 ms" });
  } finally {
    server.resume();
  }
});

test("what it publishes comes to others, latched where that was asked for", limit, async () => {
  const one = await connected();
  const refused = [];
  one.on("status", ({ msg }) => refused.push(msg));
  const mine = one.advertise("/js/mine", "std_msgs/String", { latch: true });
  assert.ok(mine.publish({ data: "first" }));
  await one.call("/rosapi/get_time", {}, patient);
  const other = await connected();
  const late = other.subscribe("/js/mine", () => {});
  await until("the latched value", () => late.last);
  assert.deepEqual(late.last, { data: "first" });
  mine.publish({ data: "second" });
  await until("the next value", () => late.last.data === "second");
  one.publish("/odom", {});
  await until("a refusal", () => refused.length);
  assert.match(refused[0], /^publish: \/odom is published by the program/);
});

test("a subscription that is refused says so", limit, async () => {
  const one = await connected(server.url, { decode: () => null });
  const odometry = one.subscribe("/odom", () => {}, { encoding: "zip" });
  assert.match(await until("a refusal", () => odometry.refused), /asks for "zip"/);
});

test("the stop is acknowledged with its times, seen by others, reset by its number", limit, async () => {
  const [one, other] = [await connected(), await connected()];
  await running(one);
  const { number, took_ms, own_ms } = await one.stop.press({ source: "js", reason: "a test", ...patient });
  assert.ok(took_ms >= own_ms && own_ms >= 0, `${took_ms} ${own_ms}`);
  await until("the other one sees it", () => other.stop.stopped);
  const { state } = other.stop;
  assert.deepEqual([state.number, state.cause, state.source], [number, "request", "js"]);
  await assert.rejects(other.stop.reset(number - 1, patient), { code: "refused", said: "number" });
  await running(other);
});

test("a guard stops the robot when it lets go, and when it is gone", limit, async () => {
  const one = await connected(server.url, { name: "js-guard" });
  await running(one);
  await one.stop.guard();
  const is_it = ({ name, fresh }) => name === "js-guard" && fresh;
  await until("it is a guard", () => one.stop.state?.guards.some(is_it));
  await running(one);
  await one.stop.let_go().catch(({ said }) => assert.equal(said, "guards"));
  await until("it is stopped", () => one.stop.stopped);
  await until("no guard", () => one.stop.state.guards.length === 0);
  await running(one);
});

test("a robot that has no stop is known to have none", limit, async () => {
  const hub = await robot.start("--name", "hub");
  try {
    const one = await connected(hub.url);
    await until("it is known", () => one.stop.configured === false);
    assert.deepEqual([one.stop.stopped, one.stop.known], [null, false]);
    await assert.rejects(one.drive("/cmd_vel").take(), { code: "refused" });
  } finally {
    await hub.kill();
  }
});

test("after a restart of the robot all comes back by itself (roslibjs 497)", limit, async () => {
  const mortal = await robot.start();
  try {
    const one = await connected(mortal.url);
    const odometry = one.subscribe("/odom", () => {}, { hz: 30 });
    const mine = one.advertise("/js/mine", "std_msgs/String");
    const stats = one.subscribe("/rowe/stats", () => {});
    await until("it shows", () => odometry.fresh(watchdog_ms) && stats.last);
    const { epoch } = stats.last;
    await mortal.kill();
    await until("it knows", () => one.state !== "open");
    assert.equal(mine.publish({ data: "into nothing" }), false);
    await assert.rejects(one.call("/rosapi/get_time"), { code: "closed" });
    // What it shows is old at once, however young (246).
    assert.ok(!odometry.fresh(watchdog_ms));
    assert.ok(odometry.last);
    const age_ms = odometry.age_ms();
    await until("its age grows", () => odometry.age_ms() > age_ms);
    await mortal.restart();
    await until("it shows again", () => odometry.fresh(watchdog_ms));
    await until("another run", () => stats.fresh(watchdog_ms) && stats.last.epoch !== epoch);
    await until("the stop again", () => one.stop.known);
    const listener = await rosbridge_client.connect(mortal.url);
    listener.send({ op: "subscribe", topic: "/js/mine", type: "std_msgs/String" });
    await until("it is offered again", () => {
      mine.publish({ data: "back" });
      return listener.published("/js/mine").length;
    });
    assert.ok(listener.published("/js/mine").every(({ data }) => data === "back"));
    listener.close();
  } finally {
    await mortal.kill();
  }
});

test("a robot that stands still is given up, and shown old until it moves", limit, async () => {
  const mortal = await robot.start();
  try {
    const one = await connected(mortal.url);
    const odometry = one.subscribe("/odom", () => {}, { hz: 30 });
    await until("it shows", () => odometry.fresh(watchdog_ms));
    const closed = new Promise((done) => one.on("closed", done));
    await mortal.pause();
    assert.match((await closed).reason, /silent for 10000 ms/);
    assert.ok(!odometry.fresh(watchdog_ms) && odometry.age_ms() >= 10000);
    mortal.resume();
    await until("it shows again", () => odometry.fresh(watchdog_ms));
  } finally {
    mortal.resume();
    await mortal.kill();
  }
});

test("a press without a free connection goes to a place reserved for the stop", limit, async () => {
  const full = await robot.start("--demo", "--limit", "connections_max=4");
  const others = [];
  try {
    await full.let_run();
    while (others.length < 2) others.push(await rosbridge_client.connect(full.url));
    const one = connect(full.url, { WebSocket });
    made.push(one);
    const press = one.stop.press({ source: "js", ...patient });
    await press;
    await until("it is seen", () => one.stop.stopped);
    assert.ok(one.stop.limited);
    assert.notEqual(one.state, "open");
    for (const other of others.splice(0)) other.close();
    await one.opened(patient);
    await until("all works", () => one.stop.known && !one.stop.limited);
  } finally {
    for (const other of others) other.close();
    await full.kill();
  }
});

test("a process ends when it has closed its robot, connected or not", limit, async () => {
  const source = fileURLToPath(new URL("../../../clients/js/src/rowe.js", import.meta.url));
  const program = `
    import { connect } from ${JSON.stringify(source)};
    import { WebSocket } from "ws";
    const nobody = connect("ws://127.0.0.1:9/", { WebSocket });
    const robot = await connect(process.argv[1], { WebSocket }).opened();
    nobody.close();
    robot.close();
    console.log("closed");`;
  const here = fileURLToPath(new URL("..", import.meta.url));
  const child = spawn(process.execPath, ["--input-type=module", "-e", program, "--", server.url],
    { cwd: here, stdio: ["ignore", "pipe", "inherit"] });
  const bark = setTimeout(() => child.kill("SIGKILL"), watchdog_ms);
  let said = "";
  child.stdout.on("data", (words) => (said += words));
  const [code] = await once(child, "close");
  clearTimeout(bark);
  assert.deepEqual([code, said], [0, "closed\n"]);
});
