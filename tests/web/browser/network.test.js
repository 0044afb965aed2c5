// SPDX-License-Identifier: Apache-2.0
// A robot on a network, as a phone meets it: https, the link of `rowe setup` with a token in its fragment,
// the page that asks for one, and a token that is taken back. Chromium is told to take the certificate here;
// certificate.test.js has what a person sees who is asked.
import assert from "node:assert/strict";
import { after, afterEach, before, test } from "node:test";
import { artefact, close_pages, new_page, start_browser } from "../support/browser.js";
import { set_up_robot } from "../support/set_up.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 180000 };
let browser, robot, tokens;

before(async () => {
  browser = await start_browser();
  robot = await set_up_robot.start();
  ({ tokens } = robot);
  await robot.serve();
});
after(async () => {
  await browser?.close();
  robot?.end();
});
afterEach(() => close_pages(browser));

async function opened(fragment = "") {
  const page = await new_page(browser, { trusting: true });
  await page.goto(`${robot.origin}/${fragment}`);
  return page;
}
const state_is = (page, name) =>
  page.waitForFunction((wanted) => document.body.dataset.state === wanted, name);

test("the link of the set-up makes the page live, and its token is in no request", limit, async () => {
  const page = await opened(`#token=${tokens.supervisor}`);
  await state_is(page, "live");
  assert.equal(await page.evaluate(() => location.hash), "");
  assert.ok(page.asked.some((url) => url.startsWith("wss://")));
  assert.ok(page.asked.every((url) => !url.includes(tokens.supervisor)), "an address has the token");
  await page.screenshot({ path: artefact("network_live.png") });
  await page.reload(); // the tab still knows it
  await state_is(page, "live");
});

test("without a token the page asks for one, and says when it is wrong", limit, async () => {
  const page = await opened();
  const form = page.locator("#who");
  await form.waitFor({ state: "visible" });
  await page.screenshot({ path: artefact("network_asks.png") });
  await page.fill("#token", "x".repeat(43));
  await page.click("#who button");
  await page.waitForFunction(() => document.getElementById("who_says").textContent.includes("does not know"));
  await page.waitForTimeout(3000); // it is refused again and again meanwhile
  assert.match(await page.textContent("#who_says"), /does not know this token/);
  await page.fill("#token", tokens.driver);
  await page.click("#who button");
  await state_is(page, "live");
  await form.waitFor({ state: "hidden" });
});

// A control that says no is shown to nobody.
const seen = async (page, ids) => {
  const look = async (id) => [id, await page.locator(`#${id}`).isVisible()];
  const all = await Promise.all(ids.map(look));
  return all.filter(([, visible]) => visible).map(([id]) => id);
};
const controls = ["stop", "view_drive", "guard", "reset"];

test("each role stops the robot; a supervisor alone resets it, observers do not drive", limit, async () => {
  const pages = {};
  for (const role of ["observer", "driver", "supervisor"]) {
    pages[role] = await opened(`#token=${tokens[role]}`);
    await pages[role].waitForFunction(() => /^(running|stopped)$/.test(document.body.dataset.stop));
  }
  const drives = (page) => page.locator("#view_drive").waitFor({ state: "visible" });
  await Promise.all([drives(pages.driver), drives(pages.supervisor)]);
  await pages.observer.click("#stop");
  for (const page of Object.values(pages)) {
    await page.waitForFunction(() => document.body.dataset.stop === "stopped");
  }
  await pages.supervisor.locator("#reset").waitFor({ state: "visible" });
  assert.deepEqual(await seen(pages.observer, controls), ["stop"]);
  assert.deepEqual(await seen(pages.driver, controls), ["stop", "view_drive"]);
  assert.equal(await pages.driver.textContent("#stop_says"), "A supervisor resets it");
  await until("the reset", async () => {
    const { supervisor } = pages;
    const pointer = { pointerId: 1, button: 0, isPrimary: true };
    await supervisor.locator("#reset").dispatchEvent("pointerdown", pointer);
    await supervisor.waitForFunction(() => document.getElementById("reset").dataset.held !== "true");
    await supervisor.locator("#reset").dispatchEvent("pointerup", pointer);
    return (await supervisor.getAttribute("body", "data-stop")) === "running";
  });
});

test("a token that is taken back ends the page's connection, and the page asks again", limit, async () => {
  const token = robot.token("guest", "observer");
  const page = await opened();
  await page.locator("#who").waitFor({ state: "visible" });
  await until("the token holds", async () => {
    await page.fill("#token", token);
    await page.click("#who button");
    await page.waitForTimeout(1000);
    return page.evaluate(() => document.body.dataset.state === "live");
  });
  robot.remove("guest");
  await page.locator("#who").waitFor({ state: "visible" });
  assert.match(await page.textContent("#who_says"), /does not know this token, or no longer knows it/);
});
