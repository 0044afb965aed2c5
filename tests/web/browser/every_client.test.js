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
import { ask } from "../support/reenact.js";
import { robot } from "../support/robot.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 240000 };
const { FoxgloveClient } = foxglove;
const type = "nav_msgs/Odometry";
let browser;

before(async () => (browser = await start_browser()));
after(() => browser?.close());

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
  await page.waitForFunction(() => document.querySelectorAll("#rates tr").length > 0); // it has statistics
  return page;
}

test("a robot's 1 kHz reaches nine clients, and what one misses was counted by name", limit, async (t) => {
  const server = await robot.start();
  try {
    const [pages, readers] = [[], []]; // pages ask for 30 a second
    for (let i = 0; i < 3; i++) pages.push(await live_page(server));
    for (const how of ["none", "none", "cbor"]) readers.push(await roslib_client(server, how));
    for (let i = 0; i < 3; i++) readers.push(await foxglove_client(server));
    await until("everybody hears it", () => readers.every(({ sequences }) => sequences.length > 0));
    const first = Math.max(...readers.map(({ sequences }) => sequences[0]));
    await until("3000 messages", () => readers.every(({ sequences }) => sequences.at(-1) >= first + 3000));
    for (const page of pages) {
      const before = await page.locator("#x").textContent();
      await page.waitForFunction((then) => document.getElementById("x").textContent !== then, before);
    }
    const asker = await rosbridge_client.connect(server.url);
    const chosen = ["replaced", "throttled"]; // what thins out as a client asked for it
    const losses = Object.entries((await ask(asker, "/rowe/stats")).losses)
      .filter(([name, count]) => count > 0 && !chosen.includes(name));
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
    for (const page of pages) assert.deepEqual(page.faults, []);
    for (const reader of readers) reader.close();
  } finally {
    await server.kill();
  }
});
