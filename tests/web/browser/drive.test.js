// SPDX-License-Identifier: Apache-2.0
// Driving on the page, in Chromium, of the demo robot: stick, keys, gamepad; two pages that want the same
// robot; and whatever may happen to a page while somebody drives by it. What is seen of the robot is what it
// does, by its odometry, and who drives it, by its own word.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { after, afterEach, before, test } from "node:test";
import { artefact, close_pages, desk, new_page, phone } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until } from "../support/watchdog.js";

let client;
before(async () => {
  client = await rosbridge_client.connect(server.url);
  client.send({ op: "subscribe", topic: "/odom", throttle_rate: 20, queue_length: 1 });
  client.send({ op: "subscribe", topic: "/rowe/control/state" });
});
after(() => client?.close());
afterEach(() => close_pages(browser));

const speed = () => client.published("/odom").at(-1)?.twist.twist.linear.x ?? NaN;
const driver = () => client.published("/rowe/control/state").at(-1)?.topics[0].driver;
const stands = () => until("it stands still", () => speed() === 0);
const moves = (sign = 1) => until("it moves", async () => {
  await server.let_run();
  return speed() * sign > 0.1;
});
const nobody = () => until("nobody drives", () => driver() === null);
const is_mine = (page, mine) =>
  page.waitForFunction((wanted) => (document.body.dataset.drive === "mine") === wanted, mine);
const line = (page, pattern) => page.waitForFunction((wanted) =>
  new RegExp(wanted).test(document.getElementById("driver_says").textContent), pattern.source);

async function page_of(options) {
  const page = await new_page(browser, options);
  await page.goto(`${server.origin}/#view=drive`);
  await page.waitForFunction(() => document.body.dataset.state === "live");
  await page.locator("#take").waitFor({ state: "visible" });
  return page;
}

// A page that drives a robot that stands still: its first command ends the figure that it drives by itself.
async function driving_page(options = { size: desk }) {
  const page = await page_of(options);
  await until("it runs", async () => {
    await server.let_run();
    return (await page.getAttribute("body", "data-stop")) === "running";
  });
  await page.click("#take");
  await is_mine(page, true);
  await until("a command counts", async () => {
    await page.keyboard.press("KeyW", { delay: 120 });
    return client.published("/rowe/control/state").at(-1)?.topics[0].age_ms !== null;
  });
  await stands();
  return page;
}

// The stick, by touch events as a phone makes them.
async function touch(page, type, forward = 0) {
  const { x, y, width, height } = await page.locator("#stick").boundingBox();
  const session = (page.session ??= await page.context().newCDPSession(page));
  const points = { x: x + width / 2, y: y + height / 2 - forward * (height / 3) };
  const touchPoints = /End|Cancel/.test(type) ? [] : [points];
  await session.send("Input.dispatchTouchEvent", { type, touchPoints });
}

test("a stick that a finger holds drives, held still too, and let go it stands still", limit, async () => {
  const page = await driving_page({ size: phone });
  await touch(page, "touchStart");
  await touch(page, "touchMove", 1);
  await moves();
  await line(page, /^0\.50 m\/s, /);
  const sent = client.published("/odom").length;
  await until("it goes on", () => client.published("/odom").length > sent + 50);
  assert.ok(speed() > 0.1, "commands repeat while it is held still");
  writeFileSync(artefact("driving.png"), await page.screenshot());
  await touch(page, "touchEnd");
  await stands();
  await line(page, /^Standstill/);
  await touch(page, "touchStart");
  await touch(page, "touchMove", -1);
  await moves(-1);
  await touch(page, "touchCancel");
  await stands();
});

test("keys drive while they are held; the limit is the slider's", limit, async () => {
  const page = await driving_page();
  await page.locator("#limit").fill("0.2");
  await page.keyboard.press("KeyW", { delay: 120 });  // letters drive there, too; arrows move the slider
  await page.focus("#view_data");
  await page.keyboard.down("ArrowUp");
  await moves();
  await until("as fast as the limit", () => Math.abs(speed() - 0.2) < 0.02);
  await page.keyboard.up("ArrowUp");
  await stands();
});

test("the space bar and Escape stop the robot, wherever the focus is, and keys do not drive it then", limit,
  async () => {
    const page = await driving_page();
    for (const [stop, at] of [["Space", "#take"], ["Escape", "#limit"]]) {
      await page.focus("#view_data");
      await until("it moves", async () => {
        await server.let_run();
        await page.keyboard.up("KeyW");
        await page.keyboard.down("KeyW");
        return speed() > 0.1;
      });
      await page.focus(at);
      await page.keyboard.press(stop);
      await page.waitForFunction(() => document.body.dataset.stop === "stopped");
      await stands();
      await line(page, /^(Stopped|Stopping): the stick moves nothing$/);
      assert.equal(await page.getAttribute("body", "data-drive"), "mine");
    }
    await server.let_run();  // the key is still held: it does not drive on by itself
    await page.waitForFunction(() => document.body.dataset.stop === "running");
    await line(page, /^Let go, then drive again$/);
    assert.ok(speed() < 0.01);
    await page.keyboard.up("KeyW");
  });

// A gamepad, faked where the page asks for it.
const with_pad = (page) => page.evaluate(() => {
  clearInterval(window.trembling);
  window.pad = { index: 0, connected: true, timestamp: 1, axes: [0, 0] };
  navigator.getGamepads = () => [window.pad];
  window.pushed = (axes) => (window.pad = { ...window.pad, timestamp: performance.now(), axes });
  window.trembling = setInterval(() => window.pad && (window.pad.timestamp = performance.now()), 20);
});

test("a gamepad drives; unplugged, or frozen with its stick out, it has let go", limit, async () => {
  const page = await driving_page();
  await with_pad(page);
  for (const harm of [() => (window.pad = null), () => clearInterval(window.trembling)]) {
    await with_pad(page);
    await page.waitForTimeout(200);  // its stick is seen in the middle
    await page.evaluate(() => window.pushed([0, -1]));
    await moves();
    await page.evaluate(harm);
    await stands();
  }
  await page.waitForFunction(() => /does not answer/.test(document.getElementById("keys").textContent));
});

test("two pages: one drives, the other sees who, and takes over; the robot stands still between", limit,
  async () => {
    const first = await driving_page();
    const second = await page_of({ size: desk });
    await second.waitForFunction(() => /^Driven by page-\w+$/.test(
      document.getElementById("driver").textContent));
    await first.keyboard.down("KeyW");
    await moves();
    await second.click("#take");
    await is_mine(second, true);
    await is_mine(first, false);
    await line(first, /^page-\w+ took over$/);
    await stands();
    assert.ok(await first.evaluate(() => document.getElementById("stick").offsetParent === null));
    await first.keyboard.up("KeyW");
    await second.click("#take");  // lets go
    await nobody();
  });

const harms = {
  "loses the focus": (page) => page.evaluate(() => dispatchEvent(new Event("blur"))),
  "is hidden": (page) => page.evaluate(() => {
    Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  }),
  "stands still for a while": (page) => page.evaluate(() => {
    const end = performance.now() + 1500;
    while (performance.now() < end);
  }),
  "is closed": (page) => page.close(),
  "is cut off": (page) => page.context().setOffline(true),
  "is killed": async (page) => {
    const session = await page.context().newCDPSession(page);
    session.send("Page.crash").catch(() => {});
  },
};
for (const [what, harm] of Object.entries(harms)) {
  test(`a page that ${what} does not drive on`, limit, async () => {
    const page = await driving_page();
    await page.keyboard.down("KeyW");
    await moves();
    await harm(page);
    await stands();
    if (/focus|while/.test(what)) {
      await page.waitForTimeout(300);
      assert.equal(speed(), 0, "nor by itself later");
      await page.keyboard.up("KeyW");
      await page.keyboard.down("KeyW");
      await moves();
    }
  });
}

test("a hidden page asks for nothing but the state of the stop", limit, async () => {
  const page = await driving_page();
  const readers = (name) => client.published("/rowe/stats").at(-1)?.topics
    .find(({ topic }) => topic === name)?.subscribers;
  client.send({ op: "subscribe", topic: "/rowe/stats" });
  const all = () => ["/odom", "/rowe/stats", "/rowe/control/state", "/rowe/parameters"].map(readers);
  await until("it is counted", () => readers("/odom") === 2);
  await harms["is hidden"](page);
  await until("this test alone is left", () => all().join() === "1,1,1,0");
  await page.evaluate(() => {
    Object.defineProperty(document, "hidden", { get: () => false, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await page.waitForFunction(() => document.body.dataset.state === "live");
});
