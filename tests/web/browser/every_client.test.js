// SPDX-License-Identifier: Apache-2.0
// Every client at once: three pages in Chromium, three of roslib (one of them by CBOR), three of
// @foxglove/ws-protocol, all unmodified, at the 1 kHz of a robot. Counts only, so that a busy machine is only
// slow: what a client misses was lost, and counted under a name.
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, before, test } from "node:test";
import foxglove from "@foxglove/ws-protocol";
import { Ros, Topic } from "roslib";
import WebSocket from "ws";
import { new_page, start_browser } from "../support/browser.js";
import { all_of, ask, hub } from "../support/reenact.js";
import { robot } from "../support/robot.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until, watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 240000 };
const { FoxgloveClient } = foxglove;
const type = "nav_msgs/Odometry";
let browser;

before(async () => (browser = await start_browser()));
after(() => browser?.close());

// What thins out as a client asked for it.
const chosen = ["replaced", "throttled"];
const losses_of = ({ losses }) =>
  Object.entries(losses).filter(([name, count]) => count > 0 && !chosen.includes(name));

// Each has the `sequences` that it heard, in their order.
async function roslib_client(server, compression) {
  const ros = new Ros({ url: server.url });
  await once(ros, "connection");
  const made = { sequences: [], close: () => ros.close() };
  new Topic({ ros, name: "/odom", messageType: type, compression })
    .subscribe(({ header }) => made.sequences.push(header.seq));
  return made;
}

async function foxglove_client(server) {
  const socket = new WebSocket(server.url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
  const client = new FoxgloveClient({ ws: socket });
  const made = { sequences: [], close: () => socket.terminate() };
  client.on("advertise", (channels) => {
    const found = channels.find(({ topic }) => topic === "/odom");
    if (found) client.subscribe(found.id);
  });
  client.on("message", ({ data }) =>
    made.sequences.push(JSON.parse(new TextDecoder().decode(data)).header.seq));
  await once(socket, "open");
  return made;
}

async function live_page(server) {
  const page = await new_page(browser);
  await page.goto(`${server.origin}/`);
  await page.waitForFunction(() => /\d/.test(document.getElementById("about").title)); // it has statistics
  return page;
}

// Those who get each message, and the pages, which ask for 30 a second.
async function everybody(server) {
  const pages = [];
  for (let i = 0; i < 3; i++) pages.push(await live_page(server));
  const readers = [];
  for (const compression of ["none", "none", "cbor"]) readers.push(await roslib_client(server, compression));
  for (let i = 0; i < 3; i++) readers.push(await foxglove_client(server));
  return { pages, readers };
}

async function end({ pages, readers }) {
  for (const reader of readers) reader.close();
  for (const page of pages) {
    assert.deepEqual(page.faults, []);
    await page.context().close();
  }
}

// As until(), but looks after each message that came: 8 at a time are then some 1000 in a second.
async function all_have(readers, sequence) {
  const end = Date.now() + watchdog_ms;
  while (!readers.every(({ sequences }) => sequences.at(-1) >= sequence)) {
    assert.ok(Date.now() < end, `not all get ${sequence}`);
    await new Promise((resolve) => setImmediate(resolve));
  }
}

const numbers_shown = (page) => page.locator("#x").textContent();

test("a robot's 1 kHz reaches nine clients, and what one misses was counted by name", limit, async (t) => {
  const server = await robot.start();
  try {
    const all = await everybody(server);
    const { pages, readers } = all;
    await until("everybody hears it", () => readers.every(({ sequences }) => sequences.length > 0));
    const first = Math.max(...readers.map(({ sequences }) => sequences[0]));
    await until("3000 messages", () => readers.every(({ sequences }) => sequences.at(-1) >= first + 3000));
    for (const page of pages) {
      const before = await numbers_shown(page);
      await page.waitForFunction((then) => document.getElementById("x").textContent !== then, before);
    }
    const asker = await rosbridge_client.connect(server.url);
    const losses = losses_of(await ask(asker, "/rowe/stats"));
    asker.close();
    t.diagnostic(`counted: ${losses.map((one) => one.join(" ")).join(", ") || "nothing"}`);
    const lost = losses.reduce((sum, [, count]) => sum + count, 0);
    for (const { sequences } of readers) {
      const heard = sequences.filter((one) => one >= first && one < first + 3000);
      assert.deepEqual(heard, [...new Set(heard)].sort((a, b) => a - b)); // each once, in order
      const missing = 3000 - heard.length;
      t.diagnostic(`${missing} of 3000 are missing`);
      assert.ok(missing <= lost);
    }
    await end(all);
  } finally {
    await server.kill();
  }
});

// The speaker waits for those who read each message before it says more, so nothing may be missing.
test("nobody of nine misses one of 3000 messages that come as fast as all read them", limit, async () => {
  const server = await hub();
  try {
    const speaker = await rosbridge_client.connect(server.url);
    speaker.send({ op: "advertise", topic: "/odom", type });
    const all = await everybody(server);
    const { pages, readers } = all;
    const say = (seq) => speaker.send({ op: "publish", topic: "/odom", msg: {
      header: { seq, stamp: { secs: 0, nsecs: seq }, frame_id: "odom" },
      pose: { pose: { position: { x: seq / 1000, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } },
      twist: { twist: { linear: { x: 1, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } } },
    } });
    let said = 0;
    await until("everybody hears it", () => {
      say(said++);
      return readers.every(({ sequences }) => sequences.length > 0);
    });
    await until("all have it", () => readers.every(({ sequences }) => sequences.at(-1) === said - 1));
    for (const { sequences } of readers) sequences.length = 0;
    const from = said;
    while (said < from + 3000) {
      for (let i = 0; i < 8; i++) say(said++);
      await all_have(readers, said - 1);
    }
    for (const { sequences } of readers) {
      assert.deepEqual(sequences.map((one) => one - from), all_of(said - from));
    }
    // Who asked for 30 a second has the newest value, too.
    const newest = ((said - 1) / 1000).toFixed(3);
    for (const page of pages) {
      await page.waitForFunction((x) => document.getElementById("x").textContent === x, newest);
    }
    assert.deepEqual(losses_of(await ask(speaker, "/rowe/stats")), []);
    speaker.close();
    await end(all);
  } finally {
    await server.kill();
  }
});
