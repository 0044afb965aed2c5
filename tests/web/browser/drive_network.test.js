// SPDX-License-Identifier: Apache-2.0
// Driving on the page, in Chromium, through a network that stalls and breaks, and of a robot that restarts.
import assert from "node:assert/strict";
import { after, afterEach, before, test } from "node:test";
import { close_pages, desk, start_browser } from "../support/browser.js";
import { driving, is_mine, line } from "../support/driving.js";
import { relay } from "../support/relay.js";
import { robot } from "../support/robot.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 180000 };
let browser, server, network, seat;

before(async () => {
  browser = await start_browser();
  network = await relay.start();
  server = await robot.start("--demo", "--allow-host", network.host);
  network.port = server.port;
  seat = await driving.watch(browser, server, `http://${network.host}`);
});
after(async () => {
  seat?.end();
  await browser?.close();
  network?.end();
  await server?.kill();
});
afterEach(() => close_pages(browser));

const state_is = (page, state) =>
  page.waitForFunction((wanted) => document.body.dataset.state === wanted, state);

test("behind a stall of the network the robot stands still, and what comes out of it does not move it " +
  "(duckietown 200)", limit, async () => {
  const page = await seat.driving_page({ size: desk });
  await seat.holds(page);
  network.hold();
  await seat.stands();
  await page.waitForTimeout(1000);  // commands that are repeated meanwhile wait in the network
  const before = seat.client.published("/odom").length;
  network.flow();
  await until("the robot has said more", () => seat.client.published("/odom").length > before + 20);
  const speeds = seat.client.published("/odom").slice(before).map(({ twist }) => twist.twist.linear.x);
  assert.deepEqual(speeds.filter((each) => each !== 0), []);
  await state_is(page, "live");
});

test("a cut connection ends control; the page comes back, says so, and drives if asked", limit, async () => {
  const page = await seat.driving_page({ size: desk });
  await seat.holds(page);
  network.cut();
  await seat.stands();
  await seat.nobody();
  await state_is(page, "live");
  await line(page, /^The connection was lost, and control with it$/);
  await is_mine(page, false);
  assert.equal(seat.speed(), 0, "the key is still held");
  await page.keyboard.up("KeyW");
  await page.click("#take");
  await is_mine(page, true);
  await seat.holds(page);
});

test("a robot that restarts is not driven by what was held before", limit, async () => {
  const page = await seat.driving_page({ size: desk });
  await seat.holds(page);
  await server.kill();
  await state_is(page, "disconnected");
  await server.restart();
  await seat.look();
  await state_is(page, "live");
  await seat.nobody();
  await is_mine(page, false);
  await page.keyboard.up("KeyW");
  await page.click("#take");
  await is_mine(page, true);
});
