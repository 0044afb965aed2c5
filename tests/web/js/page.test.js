// SPDX-License-Identifier: Apache-2.0
// What a page does to the client that it holds: hides, loses the focus, comes back.
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { connect } from "../../../clients/js/src/rowe.js";
import { fake_socket, fakes } from "./fakes.js";

const limit = { timeout: 20000 };
const clock = fakes();
let robot, base, socket, page;
const happens = (name, target = page) => target.dispatchEvent(new Event(name));
const speeds = () => socket.published("/cmd_vel").map(({ msg }) => msg.x);
function hides(hidden) {
  document.hidden = hidden;
  happens("visibilitychange", document);
}

beforeEach(async () => {
  page = new EventTarget();
  globalThis.document = Object.assign(new EventTarget(), { hidden: false });
  globalThis.addEventListener = page.addEventListener.bind(page);
  robot = connect("ws://robot/", { WebSocket: fake_socket, name: "page" });
  socket = fake_socket.last;
  socket.open();
  socket.publish("/rowe/stop/state", { state: "running", number: 7, tick: 1 });
  base = robot.drive("/cmd_vel");
  const take = base.take();
  const control = { driver: "page", lease_ms: 300, hold_ms: 2000, tick: 1 };
  await socket.answer(socket.calls("/rowe/control")[0], control);
  await take;
  await clock.pass(50);
  base.set({ x: 1 });
});
afterEach(() => {
  robot.close();
  delete globalThis.document;
  delete globalThis.addEventListener;
});

test("a page that loses the focus stands still, and may drive on when somebody says so", limit, () => {
  happens("blur");
  assert.deepEqual([speeds(), base.commanding, base.held], [[1, 0], false, true]);
  assert.ok(base.set({ x: 2 }));
});

test("a page that is left stands still", limit, () => {
  happens("pagehide");
  assert.deepEqual([speeds(), base.commanding], [[1, 0], false]);
});

test("a page that is hidden stands still, and lets others drive", limit, async () => {
  const released = () => socket.calls("/rowe/control").filter(({ args }) => args.action === "release").length;
  hides(true);
  assert.deepEqual([speeds(), released(), base.held], [[1, 0], 1, false]);
  hides(false);
  assert.equal(base.set({ x: 3 }), false, "somebody must take control anew");
});

test("a page that is hidden or left guards no more", limit, () => {
  const resigned = () => socket.calls("/rowe/stop/guard").filter(({ args }) => args.resign).length;
  robot.stop.guard().catch(() => {});
  happens("blur");
  assert.equal(resigned(), 0, "somebody may still see it");
  hides(true);
  assert.deepEqual([resigned(), robot.stop.guarding], [1, false]);
  robot.stop.guard().catch(() => {});
  happens("pagehide");
  assert.equal(resigned(), 2);
});

test("a page or a network that comes back does not wait for the next attempt", limit, () => {
  const comes = [
    () => happens("online"), () => happens("pageshow"), () => happens("focus"), () => hides(false),
  ];
  for (const come of comes) {
    const first = fake_socket.made.filter(({ url }) => !url.includes("stop")).at(-1);
    first.end();
    come();
    assert.notEqual(fake_socket.made.filter(({ url }) => !url.includes("stop")).at(-1), first);
  }
});

test("a page takes a place reserved for the stop before anybody presses", limit, async () => {
  socket.end();
  await clock.pass(50);
  assert.ok(fake_socket.made.some(({ url }) => url === "ws://robot/rowe/stop"));
});

test("a robot that was closed does not listen any more", limit, () => {
  robot.close();
  const count = fake_socket.made.length;
  for (const name of ["online", "focus", "blur", "pagehide"]) happens(name);
  hides(true);
  assert.equal(fake_socket.made.length, count);
});
