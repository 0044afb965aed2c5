// SPDX-License-Identifier: Apache-2.0
// Driving on the page, in Chromium, of the demo robot: stick, keys, gamepad; two pages that want the same
// robot; and whatever may happen to a page while somebody drives by it. What is seen of the robot is what it
// does, by its odometry, and who drives it, by its own word. What users of others reported is named.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { after, afterEach, before, test } from "node:test";
import { artefact, close_pages, desk, phone } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { driving, is_mine, line } from "../support/driving.js";
import { until } from "../support/watchdog.js";

let seat, client;
before(async () => {
  seat = await driving.watch(browser, server);
  ({ client } = seat);
});
after(() => seat?.end());
afterEach(() => close_pages(browser));

// The stick, by touch events as a phone makes them.
async function touch(page, type, forward = 0) {
  const { x, y, width, height } = await page.locator("#stick").boundingBox();
  const session = (page.session ??= await page.context().newCDPSession(page));
  const points = { x: x + width / 2, y: y + height / 2 - forward * (height / 3) };
  const touchPoints = /End|Cancel/.test(type) ? [] : [points];
  await session.send("Input.dispatchTouchEvent", { type, touchPoints });
}

async function push(page, forward) {
  const out = async () => {
    await touch(page, "touchStart");
    await touch(page, "touchMove", forward);
  };
  await out();
  await seat.moves(forward, async () => {
    await touch(page, "touchEnd");
    await out();
  });
}

test("a stick held still drives on (ArloBot 181), let go it stands (teleop_tools 45)", limit, async () => {
  const page = await seat.driving_page({ size: phone });
  await push(page, 1);
  await line(page, /^0\.50 m\/s, /);
  const sent = client.published("/odom").length;
  await until("it goes on", () => client.published("/odom").length > sent + 50);
  assert.ok(seat.speed() > 0.1, "commands repeat while it is held still");
  writeFileSync(artefact("driving.png"), await page.screenshot());
  await touch(page, "touchEnd");
  await seat.stands();
  await line(page, /^Standstill/);
  await push(page, -1);
  await touch(page, "touchCancel");
  await seat.stands();
});

test("keys drive while they are held; the limit is the slider's", limit, async () => {
  const page = await seat.driving_page({ size: desk });
  await page.locator("#limit").fill("0.2");
  await page.keyboard.press("KeyW", { delay: 120 });  // letters drive there, too; arrows move the slider
  await page.focus("#view_data");
  await seat.holds(page, "ArrowUp");
  await until("as fast as the limit", () => Math.abs(seat.speed() - 0.2) < 0.02);
  await page.keyboard.up("ArrowUp");
  await seat.stands();
});

test("a hand that is out when control is taken, or its view comes back, must let go", limit, async () => {
  const page = await seat.driving_page({ size: phone });  // a desk shows the stick in all views
  await page.click("#take");  // lets go
  await is_mine(page, false);
  await page.keyboard.down("KeyW");
  await page.click("#take");
  await is_mine(page, true);
  const still = async () => {
    await page.waitForTimeout(300);
    assert.equal(seat.speed(), 0);
  };
  await seat.stands();
  await still();
  await page.keyboard.up("KeyW");
  await page.focus("#view_data");
  await seat.holds(page);
  await page.click("#view_data");
  await seat.stands();
  await page.click("#view_drive");
  await still();
  await page.keyboard.up("KeyW");
  await seat.holds(page);
  await page.mouse.click(200, 300, { button: "right" });  // its menu would get the end of the key
  await seat.stands();
});

test("the limit never rises by itself", limit, async () => {
  const page = await seat.driving_page({ size: desk });
  await page.locator("#limit").fill("0.3");
  const most = Number(await page.getAttribute("#limit", "max"));
  const set = (value) => client.send({ op: "call_service", id: "p", service: "/rosapi/set_param",
    args: { name: "/robot/speed_max", value: String(value) } });
  set(most / 2);
  await page.waitForFunction((wanted) => Number(document.getElementById("limit").max) === wanted, most / 2);
  set(most);
  await page.waitForFunction((wanted) => Number(document.getElementById("limit").max) === wanted, most);
  assert.equal(await page.inputValue("#limit"), "0.3");
});

test("the space bar and Escape stop the robot, wherever the focus is, and keys do not drive it then", limit,
  async () => {
    const page = await seat.driving_page({ size: desk });
    for (const [stop, at] of [["Space", "#take"], ["Escape", "#limit"]]) {
      await page.focus("#view_data");
      await until("it moves", async () => {
        await server.let_run();
        await page.keyboard.up("KeyW");
        await page.keyboard.down("KeyW");
        return seat.speed() > 0.1;
      });
      await page.focus(at);
      await page.keyboard.press(stop);
      await page.waitForFunction(() => document.body.dataset.stop === "stopped");
      await seat.stands();
      await line(page, /^(Stopped|Stopping): the stick moves nothing$/);
      assert.equal(await page.getAttribute("body", "data-drive"), "mine");
    }
    await server.let_run();  // the key is still held: it does not drive on by itself
    await page.waitForFunction(() => document.body.dataset.stop === "running");
    await line(page, /^Let go, then drive again$/);
    assert.ok(seat.speed() < 0.01);
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

test("a gamepad unplugged, or frozen with its stick out, lets go (joystick_drivers 92)", limit, async () => {
  const page = await seat.driving_page({ size: desk });
  await with_pad(page);
  for (const harm of [() => (window.pad = null), () => clearInterval(window.trembling)]) {
    await with_pad(page);
    await page.waitForTimeout(200);  // its stick is seen in the middle
    const pushed = (forward) => page.evaluate((axis) => window.pushed([0, -axis]), forward);
    await pushed(1);
    await seat.moves(1, async () => {
      await pushed(0);
      await page.waitForTimeout(200);
      await pushed(1);
    });
    await page.evaluate(harm);
    await seat.stands();
  }
  await page.waitForFunction(() => /does not answer/.test(document.getElementById("keys").textContent));
});

test("two pages: one drives, the other sees who, and takes over; the robot stands still between", limit,
  async () => {
    const first = await seat.driving_page({ size: desk });
    const second = await seat.page_of({ size: desk });
    await second.waitForFunction(() => /^Driven by page-\w+$/.test(
      document.getElementById("driver").textContent));
    await seat.holds(first);
    await second.click("#take");
    await is_mine(second, true);
    await is_mine(first, false);
    await line(first, /^page-\w+ took over$/);
    await seat.stands();
    assert.ok(await first.evaluate(() => document.getElementById("stick").offsetParent === null));
    await first.keyboard.up("KeyW");
    await second.click("#take");  // lets go
    await seat.nobody();
  });

const harms = {
  "loses the focus": (page) => page.evaluate(() => dispatchEvent(new Event("blur"))),
  "is frozen": async (page) => {
    const session = await page.context().newCDPSession(page);
    await session.send("Debugger.enable");
    await session.send("Debugger.pause");
    await seat.stands();
    await session.send("Debugger.resume");
  },
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
  test(`a page that ${what} does not drive on (turtlebot_apps 55, teleop_twist_joy 25)`, limit, async () => {
    const page = await seat.driving_page({ size: desk });
    await seat.holds(page);
    await harm(page);
    await seat.stands();
    if (/focus|while|frozen/.test(what)) {
      await page.waitForTimeout(300);
      assert.equal(seat.speed(), 0, "nor by itself later");
      await page.keyboard.up("KeyW");
      await seat.holds(page);
    }
  });
}

test("a hidden page asks for nothing but the state of the stop", limit, async () => {
  const page = await seat.driving_page({ size: desk });
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
