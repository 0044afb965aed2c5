// SPDX-License-Identifier: Apache-2.0
// usage: node bench/stick.js [--rounds=5] [--events=100]
//
// Question: how long is it from a finger on the stick in a browser to the loop that obeys it?
//
// Chromium shows a page with the client of clients/js, which subscribes to odometry at 30 Hz. A finger moves
// on it ten times a second (touch events of the browser's own protocol), each time to another place, and the
// page commands that place. Measured is from the event's own time stamp, which is when the browser got it, to
// the cycle of a loop of 1 kHz whose latest_within() returns this command for the first time. Both are read
// from one clock. Rounds alternate: alone; and beside 10 Mbit/s of telemetry on the same connection, behind
// which users of mowglinext saw their commands wait (282).
//
// Excluded: the screen and the way from the finger to the browser, and the network between the two machines.
// What would make it lie: Chromium rounds time stamps to 0.1 ms. It shares two cores with the robot here.
//
// Needs tests/web/run --install, Chromium, and build/release/bin/bench_stick_robot.
import { spawn } from "node:child_process";
import { once } from "node:events";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { client_page } from "../tests/web/support/client_page.js";
import { start_browser } from "../tests/web/support/browser.js";

const option = (name, usual) =>
  Number(process.argv.find((each) => each.startsWith(`--${name}=`))?.split("=")[1] ?? usual);
const rounds = option("rounds", 5);
const events = option("events", 100);
const program = fileURLToPath(new URL("../build/release/bin/bench_stick_robot", import.meta.url));
const telemetry = { alone: 0, "beside 10 Mbit/s": 1250 };

const script = `
  import { connect } from "rowe";
  const robot = await connect().opened();
  const base = robot.drive("/cmd_vel");
  robot.subscribe("/odom", () => {}, { hz: 30 });
  robot.subscribe("/telemetry", () => {});
  await base.take();
  window.events = [];
  document.body.style = "position:fixed;inset:0;touch-action:none";
  const obey = (event) => {
    const x = event.clientX / 1000;
    base.set({ linear: { x }, angular: { z: 0 } });
    window.events.push([x, performance.timeOrigin + event.timeStamp]);
  };
  for (const type of ["pointerdown", "pointermove"]) document.addEventListener(type, obey);
  window.ready = true;`;

async function round(browser, bytes) {
  const robot = spawn(program, [String(bytes)], { stdio: ["pipe", "pipe", "inherit"] });
  const lines = createInterface({ input: robot.stdout });
  const port = Number((await once(lines, "line"))[0].split(" ")[1]);
  const seen = new Map();
  lines.on("line", (line) => {
    const [, x, ns] = line.split(" ");
    if (!seen.has(x)) seen.set(x, Number(ns) / 1e6);
  });
  const page = await client_page(browser, `http://127.0.0.1:${port}`, { module: script });
  await page.waitForFunction(() => window.ready);
  const session = await page.context().newCDPSession(page);
  const touch = (type, x) =>
    session.send("Input.dispatchTouchEvent", { type, touchPoints: x ? [{ x, y: 100 }] : [] });
  await touch("touchStart", 10);
  for (let i = 0; i < events; ++i) {
    await new Promise((passed) => setTimeout(passed, 90 + 20 * Math.random()));
    await touch("touchMove", 20 + i);
  }
  await new Promise((passed) => setTimeout(passed, 500));
  const made = await page.evaluate(() => window.events);
  await page.context().close();
  robot.stdin.end();
  await once(robot, "exit");
  const took = made.map(([x, at]) => (seen.get(x.toFixed(6)) ?? NaN) - at);
  return { took: took.filter((ms) => !Number.isNaN(ms)), lost: took.filter(Number.isNaN).length };
}

const at = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
const browser = await start_browser();
const all = Object.fromEntries(Object.keys(telemetry).map((name) => [name, { took: [], lost: 0 }]));
for (let i = 0; i < rounds; ++i) {
  for (const [name, bytes] of Object.entries(telemetry)) {
    const { took, lost } = await round(browser, bytes);
    all[name].took.push(...took);
    all[name].lost += lost;
  }
}
await browser.close();
for (const [name, { took, lost }] of Object.entries(all)) {
  const sorted = took.sort((a, b) => a - b);
  const ms = (share) => `${at(sorted, share).toFixed(1)} ms`;
  console.log(`${name}: p50 ${ms(0.5)}, p99 ${ms(0.99)}, max ${ms(1)} of ${sorted.length} events; ` +
    `${lost} replaced by a newer one or dropped`);
}
