// SPDX-License-Identifier: Apache-2.0
// The robot's stop as the page sees it, against a link and clocks of our own.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { load } from "./load.js";

const { stop } = await load("stop.js");
const { causes, refusals, short, text } = await load("text.js");

let now, link, made;
const pass = (ms) => (now += ms);
const sent = (service) => link.sent.filter((each) => each.service === service);
const state = (more) => ({ state: "running", number: 7, cause: null, source: null, since_ms: 1000, tick: 100,
  unguarded: false, guards: [], loops: [], ...more });
const says = (more) => made.received({ op: "publish", topic: "/rowe/stop/state", msg: state(more) });
const answer = (call, values, result = true) =>
  made.received({ op: "service_response", id: call.id, service: call.service, values, result });
const acknowledged = { number: 8, accepted_ns: "9007199254740993000", observed_ns: "9007199254741333000" };

beforeEach(() => {
  now = 1000;
  Object.defineProperty(globalThis, "performance", { value: { now: () => now }, configurable: true });
  Date.now = () => 5e11 + now;
  link = { state: "open", sent: [], send(message) { this.sent.push(message); } };
  made = new stop(link, "page-1");
  made.opened();
});

test("a robot is asked whether it has a stop, and may have none", () => {
  assert.equal(made.configured, null);
  answer(sent("/rowe/stop/state")[0], "Service /rowe/stop/state does not exist", false);
  assert.equal(made.configured, false);
  says();
  assert.equal(made.configured, true, "a loop took a latch later");
});

test("a press asks at once, and changes nothing of what the robot is", () => {
  says();
  made.press();
  assert.equal(sent("/rowe/stop").length, 1);
  assert.ok(made.pending);
  assert.ok(!made.stopped);
});

test("a stop is acknowledged with the time since the press and the robot's own", () => {
  made.press();
  pass(4.2);
  answer(sent("/rowe/stop")[0], acknowledged);
  assert.ok(!made.pending);
  assert.equal(made.asked.answer.took_ms.toFixed(3), "4.200");
  assert.equal(made.asked.answer.own_ms, 0.34);
  assert.equal(text.acknowledged("ang-01", made.asked.answer).replaceAll("\u00a0", " "),
    "acknowledged in 4.2 ms by ang-01 (its own time 0.34 ms)");
});

test("it is asked for again until it is acknowledged, and overdue after half a second", () => {
  made.press();
  for (let i = 0; i < 4; i += 1) {
    pass(250);
    made.turn();
  }
  assert.equal(sent("/rowe/stop").length, 5);
  assert.ok(made.overdue);
  answer(sent("/rowe/stop")[1], acknowledged);
  assert.ok(!made.overdue);
  pass(1000);
  made.turn();
  assert.equal(sent("/rowe/stop").length, 5);
});

test("an answer of a robot whose loop did not acknowledge is no acknowledgment", () => {
  made.press();
  answer(sent("/rowe/stop")[0], { ...acknowledged, observed_ns: null });
  assert.ok(made.pending && made.asked.taken);
});

test("a press that was not answered is asked for again on the next connection", () => {
  made.press();
  link.state = "disconnected";
  pass(5000);
  made.turn();
  assert.equal(sent("/rowe/stop").length, 1);
  link.state = "open";
  made.opened();
  assert.equal(sent("/rowe/stop").length, 2);
});

test("an acknowledgment is forgotten once the robot runs again, not by what was told before", () => {
  made.press();
  answer(sent("/rowe/stop")[0], acknowledged);
  says({ state: "stopped", number: 8, cause: "request" });
  assert.ok(made.asked);
  says({ number: 9 });
  assert.equal(made.asked, null);
});

test("an acknowledgment is not told of another stop, of a robot that started anew for one", () => {
  says({ state: "stopped", number: 7, cause: "guard" });
  made.press();
  answer(sent("/rowe/stop")[0], acknowledged);
  says({ state: "stopped", number: 7, cause: "guard" });
  assert.ok(made.asked, "a state from before the press");
  says({ state: "stopped", number: 8, cause: "request" });
  assert.ok(made.asked);
  says({ state: "stopped", number: 8, cause: "request" });
  assert.ok(made.asked);
  says({ state: "stopped", number: 900, cause: "start" });
  assert.equal(made.asked, null);
});

test("what the robot said last does not hold once it is silent", () => {
  says({ state: "stopped" });
  assert.ok(made.known && made.stopped);
  pass(1001);
  assert.ok(!made.known);
});

test("when the robot was stopped is known to a page that was opened later", () => {
  says({ state: "stopped", since_ms: 90000 });
  assert.equal(made.began, Date.now() - 90000);
});

test("a guard answers ticks as they come, and nothing but ticks", () => {
  says();
  made.guard();
  says({ tick: 120 });
  pass(5000);
  made.turn();
  assert.deepEqual(sent("/rowe/stop/guard").map(({ args }) => args),
    [{ guard: "page-1", tick: 100 }, { guard: "page-1", tick: 120 }]);
});

test("a page that is hidden lets go, says so, and does not guard again by itself", () => {
  says();
  made.guard();
  made.hide();
  assert.deepEqual(sent("/rowe/stop/guard").at(-1).args, { guard: "page-1", tick: 100, resign: true });
  assert.ok(made.hidden && !made.guarding);
  says({ tick: 140 });
  assert.equal(sent("/rowe/stop/guard").length, 2);
});

test("a page that does not guard has nothing to let go when it is hidden", () => {
  says();
  made.hide();
  assert.ok(!made.hidden);
  assert.equal(sent("/rowe/stop/guard").length, 0);
});

test("a guard goes on guarding on the next connection, and a name still taken is waited for", () => {
  says();
  made.guard();
  made.opened();
  says({ state: "stopped", cause: "guard", tick: 300 });
  answer(sent("/rowe/stop/guard").at(-1), { refused: "name" });
  assert.ok(made.guarding);
  says({ state: "stopped", cause: "guard", tick: 320 });
  assert.equal(sent("/rowe/stop/guard").at(-1).args.tick, 320);
});

test("a guard that is refused for good does not guard", () => {
  says();
  made.guard();
  answer(sent("/rowe/stop/guard")[0], { refused: "role" });
  assert.ok(!made.guarding);
  assert.equal(made.refused, "guard_role");
});

test("a page whose guard the robot does not know says so, and does not guard", () => {
  says();
  made.guard();
  answer(sent("/rowe/stop/guard")[0], "Service /rowe/stop/guard does not exist", false);
  assert.ok(!made.guarding);
  assert.equal(made.refused, "guard_service");
  assert.ok(refusals[made.refused]);
});

test("to forget somebody else's guard takes another right than to guard", () => {
  says({ guards: [{ name: "desk", fresh: false }] });
  made.dismiss("desk");
  answer(sent("/rowe/stop/guard")[0], { refused: "role", right: "reset" });
  assert.equal(made.refused, "dismiss_role");
  made.dismiss("desk");
  answer(sent("/rowe/stop/guard")[1], { refused: "tick" });
  assert.equal(made.refused, "guard_tick");
});

test("a reset names the stop that was shown, and echoes the newest tick", () => {
  says({ state: "stopped", number: 8, tick: 700 });
  says({ state: "stopped", number: 9, tick: 900 });
  made.reset(8);
  const call = sent("/rowe/stop/reset")[0];
  assert.deepEqual(call.args, { number: 8, tick: 900 });
  answer(call, { refused: "number" });
  assert.equal(made.refused, "reset_number");
  made.reset(9);
  answer(sent("/rowe/stop/reset")[1], { refused: null });
  assert.equal(made.refused, null);
});

test("every cause and every refusal of the robot has its words", async () => {
  const { readFile } = await import("node:fs/promises");
  const source = "../../../src/service/threads/stop_rules.cpp";
  const rules = await readFile(new URL(source, import.meta.url), "utf8");
  const names = (list) =>
    [...rules.match(new RegExp(`${list}\\{([^}]*)\\}`))[1].matchAll(/"(\w+)"/g)].map(([, name]) => name);
  assert.deepEqual(names("cause_names").sort(), Object.keys(causes).sort());
  const told = new Set(Object.keys(refusals).map((name) => name.split("_")[1]));
  // "service" is the page's own: the robot has no such service.
  assert.deepEqual([...names("refusal_names"), "service"].sort(), [...told].sort());
});

test("who stopped it is shown without the port of the connection", () => {
  assert.equal(text.stopped_by("10.0.0.23:51234"), "STOPPED by 10.0.0.23");
  assert.equal(text.stopped_by("[::1]:51234"), "STOPPED by [::1]");
  assert.equal(text.stopped_by("desk:1"), "STOPPED by desk:1");
});

test("short times have the decimals that matter", () => {
  assert.deepEqual([0.344, 4.24, 99.94, 120, 1200].map((ms) => short(ms).replace("\u00a0", " ")),
    ["0.34 ms", "4.2 ms", "99.9 ms", "120 ms", "1.2 s"]);
});

// ---- where the robot takes no connection

let kept;
const without_connection = () => {
  kept = { state: "open", sent: [], turns: [], send(message) { this.sent.push(message); },
    turn(hurry) { this.turns.push(hurry); } };
  link.state = "disconnected";
  link.sent = [];
  made = new stop(link, "page-1", kept);
  made.opened();
};

test("where only a place for the stop was free it stops and sees that", () => {
  without_connection();
  assert.ok(made.limited);
  assert.deepEqual(kept.sent.map(({ op, topic, service }) => [op, topic ?? service]),
    [["subscribe", "/rowe/stop/state"], ["call_service", "/rowe/stop/state"]]);
  says();
  made.press();
  const [asked] = kept.sent.filter(({ service }) => service === "/rowe/stop");
  answer(asked, acknowledged);
  assert.ok(!made.pending);
  assert.deepEqual(link.sent, []);
});

test("there it guards nothing", () => {
  without_connection();
  made.guarding = true;
  says();
  assert.ok(!kept.sent.some(({ service }) => service === "/rowe/stop/guard"));
});

test("the ordinary connection is used as soon as there is one", () => {
  without_connection();
  link.state = "open";
  made.opened();
  assert.ok(!made.limited);
  made.press();
  assert.equal(sent("/rowe/stop").length, 1);
});

test("a press without any connection hurries, and is sent once there is one", () => {
  without_connection();
  kept.state = "disconnected";
  made.press();
  assert.deepEqual(kept.turns, [true]);
  kept.state = "open";
  kept.sent = [];
  made.opened();
  assert.ok(kept.sent.some(({ service }) => service === "/rowe/stop"));
});
