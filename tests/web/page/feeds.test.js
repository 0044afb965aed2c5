// SPDX-License-Identifier: Apache-2.0
// What the page asks for, what it is told of its rights, and what it takes for true.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { load } from "./load.js";

const { feeds } = await load("feeds.js");
const { rights } = await load("rights.js");
const { judge, robot_clock, usual_age } = await load("truth.js");

const settled = () => new Promise((done) => setImmediate(done));
class fake_robot {
  state = "open";
  asked = [];
  calls = [];
  #on = {};
  answers = {};
  on(name, fn) { (this.#on[name] ??= []).push(fn); }
  emit(name) { for (const fn of this.#on[name] ?? []) fn(); }
  subscribe(topic, fn, { hz }) {
    const one = { topic, fn, hz, age_ms: () => 7, fresh: () => true, refused: null };
    one.unsubscribe = () => (this.asked = this.asked.filter((each) => each !== one));
    this.asked.push(one);
    return one;
  }
  async call(service, args) {
    this.calls.push([service, args]);
    const answer = this.answers[service];
    if (answer instanceof Error) throw answer;
    return answer ?? {};
  }
}
let robot, page;
beforeEach(() => {
  robot = new fake_robot();
  page = Object.assign(new EventTarget(), { hidden: false });
});
const hide = (hidden) => {
  page.hidden = hidden;
  page.dispatchEvent(new Event("visibilitychange"));
};

test("a hidden page asks for nothing, and asks again when it is seen", () => {
  const all = new feeds(robot, page);
  const one = all.want("/odom", () => {}, 30);
  assert.deepEqual(robot.asked.map(({ topic, hz }) => [topic, hz]), [["/odom", 30]]);
  hide(true);
  assert.deepEqual(robot.asked, []);
  assert.equal(one.age_ms, Infinity);
  all.want("/scan", () => {}, 5);
  assert.deepEqual(robot.asked, []);
  hide(false);
  assert.deepEqual(robot.asked.map(({ topic }) => topic), ["/odom", "/scan"]);
  one.end();
  hide(true);
  hide(false);
  assert.deepEqual(robot.asked.map(({ topic }) => topic), ["/scan"]);
});

test("what is not looked at is asked for more slowly, or not at all", () => {
  const one = new feeds(robot, page).want("/odom", () => {}, 30);
  one.at(5);
  assert.deepEqual(robot.asked.map(({ hz }) => hz), [5]);
  one.at(0);
  assert.deepEqual(robot.asked, []);
});

test("a state is judged by the age of the pose, never by the socket alone", () => {
  const pose = (age_ms, fresh) => ({ hz: 30, age_ms, fresh: () => fresh });
  const judged = (link, of, heard = false) => judge(link, { asked_ms: 600, ...of }, 500, heard);
  assert.equal(judged("connecting", pose(Infinity)), "connecting");
  assert.equal(judged("retrying", pose(5, true)), "disconnected");
  assert.equal(judged("open", pose(Infinity, false)), "waiting");
  assert.equal(judged("open", pose(5, true)), "live");
  assert.equal(judged("open", pose(900, false)), "stale");
  assert.equal(judged("open", pose(Infinity), true), "stale", "it was asked for anew, and does not come");
  assert.equal(judged("open", { ...pose(Infinity), asked_ms: 100 }, true), "waiting", "yet");
});

test("a pose may be three times as old as it usually gets, within half a second and five", () => {
  const usual = new usual_age();
  assert.deepEqual([30, 5, 2].map((hz) => usual.stale_ms(hz)), [500, 600, 1500]);
  assert.equal(usual.stale_ms(30, 1), 3000, "before the second value the robot's own rate holds");
  for (const gap_ms of [Infinity, 1000, 990, 40, 1010, 1020]) usual.came(gap_ms);
  assert.equal(usual.stale_ms(30, 100), 3000, "one gap that is unusual changes nothing");
  for (let more = 0; more < 5; more += 1) usual.came(60000);
  assert.equal(usual.stale_ms(30), 5000);
  for (let more = 0; more < 5; more += 1) usual.came(10);
  assert.equal(usual.stale_ms(30), 500);
});

test("the robot's clock is believed as of the middle of the question", async () => {
  robot.answers["/rosapi/get_time"] = { time: { secs: 1000, nsecs: 5e8 } };
  const time = new robot_clock(robot);
  time.turn();
  time.turn();
  await settled();
  assert.equal(robot.calls.length, 1);
  assert.ok(Math.abs(time.at(Date.now()) - 1000500) < 1000);
});

test("the robot says what the role may, of all that was asked for, on each connection", async () => {
  const may = { reset: true, "publish /cmd_vel": true };
  robot.call = async (service, { asked }) => {
    robot.calls.push([service, asked]);
    return { allowed: asked.map(({ right, name }) => may[name ? `${right} ${name}` : right] ?? false) };
  };
  let changes = 0;
  const role = new rights(robot);
  role.changed = () => (changes += 1);
  const seen = () => [role.has("reset"), role.has("guard"), role.has("publish", "/cmd_vel")];
  assert.deepEqual(seen(), [false, false, false], "not known yet");
  await settled();
  assert.deepEqual(seen(), [true, false, true]);
  const asked = [{ right: "reset", name: undefined }, { right: "guard", name: undefined },
    { right: "publish", name: "/cmd_vel" }];
  assert.deepEqual(robot.calls, [["/rowe/rights", asked]]);
  assert.ok(changes > 0);
  role.lacks("reset");
  assert.ok(!role.has("reset"));
  robot.emit("closed");
  assert.deepEqual(seen(), [false, false, false], "another connection may have another role");
  may.guard = true;
  robot.emit("open");
  await settled();
  assert.deepEqual(seen(), [true, true, true]);
});

test("many rights are asked for in several calls, and an answer that was lost says nothing", async () => {
  robot.call = async (_, { asked }) => {
    robot.calls.push(asked.length);
    if (robot.calls.length > 2) throw Object.assign(new Error("lost"), { code: "lost" });
    return { allowed: asked.map(() => true) };
  };
  const role = new rights(robot);
  const names = Array.from({ length: 150 }, (_, at) => `/p${at}`);
  names.forEach((name) => role.has("set", name));
  await settled();
  assert.deepEqual(robot.calls, [64, 64, 22]);
  assert.equal(names.filter((name) => role.has("set", name)).length, 128);
});
