// SPDX-License-Identifier: Apache-2.0
// The client of clients/js in Chromium: its example pages, without a bundler and with one, of the demo robot
// and of one that is driven.
import assert from "node:assert/strict";
import { join } from "node:path";
import { afterEach, test } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { close_pages } from "../support/browser.js";
import { client_page } from "../support/client_page.js";
import { driven_robot } from "../support/driven.js";
import { browser, limit, server } from "../support/demo.js";
import { robot } from "../support/robot.js";
import { until } from "../support/watchdog.js";

const source = fileURLToPath(new URL("../../../clients/js/", import.meta.url));
let driven;
afterEach(async () => {
  await close_pages(browser);
  await driven?.end();
  driven = null;
});

const shown = (page, id, pattern) =>
  page.waitForFunction(([of, wanted]) => new RegExp(wanted).test(document.getElementById(of).innerText),
    [id, pattern.source]);

// Chromium has no way to hide a page without a screen, nor to take the focus from it.
const hides = (page, hidden) => page.evaluate((value) => {
  Object.defineProperty(document, "hidden", { get: () => value, configurable: true });
  document.dispatchEvent(new Event("visibilitychange"));
}, hidden);

test("the page without a bundler shows a pose and its age, stops and resets", limit, async () => {
  await server.let_run();
  const page = await client_page(browser, server.origin);
  await shown(page, "pose", /^x -?\d+\.\d\d, y -?\d+\.\d\d \(now\)$/);
  await shown(page, "latch", /^(running|STOPPED)$/);
  await page.click("#stop");
  await shown(page, "latch", /^STOPPED$/);
  page.on("dialog", (dialog) => dialog.dismiss());  // a busy machine may keep its loop from being reset
  await until("it runs", async () => {
    await page.click("#reset").catch(() => {});
    return (await page.innerText("#latch")) === "running";
  });
  assert.deepEqual(page.faults, []);
});

test("it comes back with the robot; what it shows meanwhile is OLD (roslibjs 497, 246)", limit, async () => {
  const mortal = await robot.start();
  try {
    const page = await client_page(browser, mortal.origin);
    await shown(page, "pose", /\(now\)$/);
    await mortal.kill();
    await shown(page, "pose", /\(OLD: \d+\.\d s\)$/);
    await shown(page, "latch", /^not known/);
    await mortal.restart();
    await shown(page, "pose", /\(now\)$/);
    await shown(page, "latch", /^(running|STOPPED)$/);
  } finally {
    await mortal.kill();
  }
});

test("the bundled button stops the robot and says how long that took", limit, async () => {
  const bundled = await build({
    entryPoints: [join(source, "examples", "bundled.js")], bundle: true, minify: true, write: false,
    globalName: "stop_button", alias: { rowe: join(source, "src", "rowe.js") },
  });
  const page = await client_page(browser, server.origin, {
    files: { "/stop_button.js": bundled.outputFiles[0].text },
    module: "// the button alone",
  });
  await page.addScriptTag({ url: "/stop_button.js" });
  await page.evaluate((url) => (window.robot = stop_button.add(document.body, url)), server.url);
  await page.evaluate(() => window.robot.opened());
  await page.click("button");
  const says = /^acknowledged in \d+\.\d ms$/;
  await until("an acknowledgment", async () => says.test(await page.innerText("span")));
  await page.waitForFunction(() => window.robot.stop.stopped);
  await server.let_run();
});

test("driving lasts while the button is held", limit, async () => {
  driven = await driven_robot.start();
  const page = await client_page(browser, driven.origin);
  await shown(page, "driver", /^nobody drives$/);
  await page.hover("#drive");
  await page.mouse.down();
  await driven.moves();
  await page.mouse.up();
  await until("it was released", () => driven.driver === null);
  await driven.stands();
  await shown(page, "driver", /^nobody drives$/);
});

// A page that holds a command as long as it may.
async function driving_page() {
  driven = await driven_robot.start();
  const page = await client_page(browser, driven.origin, { module: `
    import { connect } from "rowe";
    const robot = window.robot = await connect().opened();
    const base = window.base = robot.drive("/cmd_vel");
    await base.take();
    window.hold = () => base.set({ linear: { x: 0.2 } });
    window.ready = true;` });
  await page.waitForFunction(() => window.ready);
  await drives(page);
  return page;
}
// Gives the command again until it counts, as a hand does that holds the stick.
const drives = (page) => until("it drives", async () => {
  await page.evaluate(() => window.hold());
  return Math.abs(driven.speed) > 0.1;
});

test("a page that loses the focus stands still, keeps control, and may drive on", limit, async () => {
  const page = await driving_page();
  await page.evaluate(() => dispatchEvent(new Event("blur")));
  await driven.stands();
  assert.ok(await page.evaluate(() => window.base.held && !window.base.commanding));
  await drives(page);
});

test("a page that is hidden stands still, and lets others drive", limit, async () => {
  const page = await driving_page();
  await hides(page, true);
  await driven.stands();
  await until("nobody drives", () => driven.driver === null);
  await hides(page, false);
  assert.equal(await page.evaluate(() => window.hold()), false);
  await page.evaluate(() => window.base.take());
  await drives(page);
});

test("a page that is left stands still", limit, async () => {
  const page = await driving_page();
  await page.goto("about:blank");
  await driven.stands();
  await until("nobody drives", () => driven.driver === null);
});

test("a page that was frozen does not drive on by itself", limit, async () => {
  const page = await driving_page();
  await page.evaluate(() => {
    const end = performance.now() + 1000;
    while (performance.now() < end);
  });
  await page.waitForFunction(() => !window.base.commanding);
  await driven.stands();
});
