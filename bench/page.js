// SPDX-License-Identifier: Apache-2.0
// usage: node bench/page.js [--rounds=15] [--seconds=2]
//
// Questions: how soon does a phone show the page, and what does an open page cost the robot?
//
// `first paint`: Chromium's own first-contentful-paint of the demo robot's page, with nothing cached, its
// processor slowed down four times, over a link of 150 ms round trip and 1.6 Mbit/s, as Lighthouse has a slow
// phone; `live` is until the page shows a pose. `at once` is the same without both.
//
// `service thread`, `loop`: the processor time of the two threads of `rowe serve --demo` (a loop of 1 kHz),
// in percent of a core, in turns: with nobody; with a peer that asks for nothing, by which the service thread
// looks for values each poll_period; with one that asks for what the page does; and with the page, seen and
// hidden. What a page costs is its difference to the peer that asks for nothing. Times are the kernel's, in
// nanoseconds; said are the lower quartile, for a busy host only adds to them, and the median.
//
// What would make it lie: other load. The browser shares the machine and its caches with the robot, which a
// page elsewhere does not, and throttles itself by its own timers, not by a slower processor.
//
// Needs tests/web/run --install, Chromium, and build/release/bin/rowe.
import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { new_page, phone, start_browser } from "../tests/web/support/browser.js";
import { robot } from "../tests/web/support/robot.js";
import { rosbridge_client } from "../tests/web/support/rosbridge.js";

process.env.ROWE_BIN ??= fileURLToPath(new URL("../build/release/bin/rowe", import.meta.url));
const option = (name, usual) =>
  Number(process.argv.find((each) => each.startsWith(`--${name}=`))?.split("=")[1] ?? usual);
const rounds = option("rounds", 15);
const seconds = option("seconds", 2);
const slow = { offline: false, latency: 150, downloadThroughput: 1.6e6 / 8, uploadThroughput: 0.75e6 / 8 };
const wait = (ms) => new Promise((passed) => setTimeout(passed, ms));
const middle = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];

const browser = await start_browser();
const server = await robot.start();

async function paint(throttled) {
  const page = await new_page(browser, { size: phone });
  const session = await page.context().newCDPSession(page);
  if (throttled) {
    await session.send("Network.enable");
    await session.send("Network.emulateNetworkConditions", slow);
    await session.send("Emulation.setCPUThrottlingRate", { rate: 4 });
  }
  await page.goto(server.origin);
  await page.waitForFunction(() => document.body.dataset.state === "live", null, { polling: 5 });
  const [live, first] = await page.evaluate(() => [performance.now(),
    performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? NaN]);
  await page.context().close();
  return { first, live };
}

// The processor time of the robot's threads so far, in nanoseconds.
function spent() {
  const tasks = `/proc/${server.child.pid}/task`;
  const all = { "service thread": 0, loop: 0 };
  for (const task of readdirSync(tasks)) {
    const name = readFileSync(`${tasks}/${task}/comm`, "latin1").trim();
    const [ns] = readFileSync(`${tasks}/${task}/schedstat`, "latin1").split(" ");
    all[name === "robot" ? "loop" : "service thread"] += Number(ns);
  }
  return all;
}
async function cost() {
  await wait(1000);
  const before = spent();
  const began = performance.now();
  await wait(seconds * 1000);
  const after = spent();
  const percent_ns = (performance.now() - began) * 1e4;
  const of = (name) => (after[name] - before[name]) / percent_ns;
  return Object.fromEntries(Object.keys(after).map((name) => [name, of(name)]));
}
const hide = (page) => page.evaluate(() => {
  Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
  document.dispatchEvent(new Event("visibilitychange"));
});
const with_whom = {
  nobody: async () => () => {},
  "a peer that asks for nothing": async () => {
    const client = await rosbridge_client.connect(server.url);
    return () => client.close();
  },
  "a peer that asks for what the page does": async () => {
    const client = await rosbridge_client.connect(server.url);
    const wanted = { "/odom": 33, "/rowe/control/state": 50, "/rowe/stats": 500, "/rowe/parameters": 0,
      "/rowe/stop/state": 0 };
    for (const [topic, throttle_rate] of Object.entries(wanted)) {
      client.send({ op: "subscribe", topic, throttle_rate, queue_length: 1 });
    }
    return () => client.close();
  },
  "the page": async () => {
    const page = await new_page(browser, { size: phone });
    await page.goto(server.origin);
    return () => page.context().close();
  },
  "the page, hidden": async () => {
    const page = await new_page(browser, { size: phone });
    await page.goto(server.origin);
    await wait(1000);
    await hide(page);
    return () => page.context().close();
  },
};

const paints = { "slow phone": [], "at once": [] };
const costs = Object.fromEntries(Object.keys(with_whom).map((name) => [name, []]));
for (let round = 0; round < rounds; round += 1) {
  paints["slow phone"].push(await paint(true));
  paints["at once"].push(await paint(false));
  for (const [name, begin] of Object.entries(with_whom)) {
    const end = await begin();
    costs[name].push(await cost());
    await end();
  }
}
await browser.close();
await server.kill();
for (const [name, all] of Object.entries(paints)) {
  const [first, live] = ["first", "live"].map((what) => middle(all.map((each) => each[what])).toFixed(0));
  console.log(`${name}: first paint ${first} ms, live ${live} ms (medians of ${all.length})`);
}
for (const [name, all] of Object.entries(costs)) {
  const said = ["service thread", "loop"].map((who) => {
    const sorted = all.map((each) => each[who]).sort((a, b) => a - b);
    return `${who} ${sorted[sorted.length >> 2].toFixed(1)} % (median ${middle(sorted).toFixed(1)} %)`;
  });
  console.log(`with ${name}: ${said.join(", ")} of a core`);
}
