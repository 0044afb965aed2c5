// SPDX-License-Identifier: Apache-2.0
// docs/examples/plain.html, which `rowe serve --web` serves: a page without a library, with a token where the
// robot has identities. And what scripts get beside it.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { after, afterEach, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { close_pages, desk, new_page, start_browser } from "../support/browser.js";
import { robot } from "../support/robot.js";
import { set_up_robot } from "../support/set_up.js";

const limit = { timeout: 180000 };
const examples = fileURLToPath(new URL("../../../docs/examples", import.meta.url));
let browser, open, guarded;

before(async () => {
  browser = await start_browser();
  open = await robot.start("--demo", "--web", examples);
  guarded = await set_up_robot.start();
  await guarded.serve("--web", examples);
});
after(async () => {
  await browser?.close();
  await open?.kill();
  guarded?.end();
});
afterEach(() => close_pages(browser));

const curl = (...words) => execFileSync("curl", ["--silent", "--show-error", ...words], { encoding: "utf8" });
const state_is = (page, pattern) => page.waitForFunction(
  (source) => new RegExp(source).test(document.getElementById("state").textContent), pattern.source);
const value_of = async (page) => {
  await page.waitForFunction(() => document.getElementById("value").textContent !== "");
  return JSON.parse(await page.textContent("#value"));
};

test("the page has forty lines", () => {
  assert.ok(readFileSync(`${examples}/plain.html`, "utf8").split("\n").length - 1 <= 40);
});

test("it shows the values of a topic as they come", limit, async () => {
  const page = await new_page(browser);
  await page.goto(`${open.origin}/plain.html#topic=/odom`);
  await state_is(page, /^connected$/);
  const first = await value_of(page);
  assert.equal(typeof first.pose, "object", JSON.stringify(first));
  const before = await page.textContent("#value");
  await page.waitForFunction((was) => document.getElementById("value").textContent !== was, before);
  assert.deepEqual(page.faults, []);
  assert.ok(page.asked.every((url) => new URL(url).host === new URL(open.origin).host), page.asked);
});

test("its button stops the robot, and says so where it cannot", limit, async () => {
  const page = await new_page(browser);
  await page.goto(`${open.origin}/plain.html`);
  await state_is(page, /^connected$/);
  await page.click("#stop");
  await state_is(page, /"state":"stopped"/);
  const stopped = JSON.parse(curl(`${open.origin}/api/v1/topics/rowe/stop/state`));
  assert.equal(stopped.state, "stopped");
  assert.match(stopped.source, /plain\.html/);
  await open.kill();
  await state_is(page, /^not connected/);
  await page.click("#stop");
  assert.match(await page.textContent("#state"), /NOT STOPPED/);
  await open.restart();
  await state_is(page, /^connected$/);
});

test("with a token in its address it is let in, and shows what its role may see", limit, async () => {
  const page = await new_page(browser, { size: desk, trusting: true });
  await page.goto(`${guarded.origin}/plain.html#topic=/odom&token=${guarded.tokens.observer}`);
  await state_is(page, /^connected$/);
  assert.equal(typeof (await value_of(page)).pose, "object");
  assert.ok(page.asked.every((url) => !url.includes(guarded.tokens.observer)), "an address has the token");
  await page.goto("about:blank");
  await page.goto(`${guarded.origin}/plain.html#topic=/odom`);
  await state_is(page, /^not connected/);
});

test("curl gets the newest value at once", limit, () => {
  const value = JSON.parse(curl("--fail", `${open.origin}/api/v1/topics/odom`));
  assert.equal(typeof value.pose, "object");
  const [head, body] = curl("--fail", "--include", `${open.origin}/api/v1/topics/%2Fodom`).split("\r\n\r\n");
  assert.match(head, /^HTTP\/1.1 200 /);
  assert.match(head, /content-type: application\/json/);
  assert.ok(Number(head.match(/rowe-age-ms: (\d+)/)[1]) >= 0);
  assert.equal(typeof JSON.parse(body).pose, "object");
  const stats = JSON.parse(curl("--fail", `${open.origin}/api/v1/stats`));
  assert.ok(stats.topics.some((one) => one.topic === "/odom" && one.messages > 0));
  assert.throws(() => curl("--fail", `${open.origin}/api/v1/topics/nothing`), /404/);
  assert.throws(() => curl("--fail", "-H", "Origin: null", `${open.origin}/api/v1/topics/odom`), /403/);
});

test("curl needs a token where the robot has identities", limit, () => {
  const url = `${guarded.origin}/api/v1/topics/odom`;
  const trusted = ["--fail", "--cacert", `${guarded.folder}/ca.pem`];
  assert.throws(() => curl(...trusted, url), /401/);
  const value = JSON.parse(curl(...trusted, "-H", `Authorization: Bearer ${guarded.tokens.observer}`, url));
  assert.equal(typeof value.pose, "object");
});
