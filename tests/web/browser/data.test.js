// SPDX-License-Identifier: Apache-2.0
// The view of data in Chromium, of the demo robot: values, parameters and services with forms, and peers; and
// of a robot with roles, of which each sees what it may.
import assert from "node:assert/strict";
import { mkdtemp, readdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, test } from "node:test";
import { close_pages, desk, new_page } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { program, rowe } from "../support/program.js";
import { set_up_robot } from "../support/set_up.js";
import { until } from "../support/watchdog.js";

let roles;
before(async () => {
  roles = await set_up_robot.start();
  await roles.serve();
});
after(() => roles?.end());
afterEach(() => close_pages(browser));

async function page_of(origin = server.origin, fragment = "#view=data", more = {}) {
  const page = await new_page(browser, { size: desk, ...more });
  await page.goto(`${origin}/${fragment}`);
  await page.waitForFunction(() => document.body.dataset.state === "live");
  await page.click("#view_data");
  return page;
}
const speed_max = "#parameters [data-key='/robot/speed_max']";
const of_robot = async () => JSON.parse((await rowe("call", server.url, "/rosapi/get_param",
  '{"name":"/robot/speed_max"}')).stdout).value;

test("a parameter is set by its form, or refused in the robot's words", limit, async () => {
  const page = await page_of();
  const form = page.locator(speed_max);
  await form.waitFor();
  assert.ok(await form.locator("button").isHidden(), "nothing is changed yet");
  await form.locator("input").fill("0.7");
  await form.locator("button").click();
  await until("it is set", async () => (await of_robot()) === "0.7");
  await form.locator("button").waitFor({ state: "hidden" });
  await form.locator("input").fill("70");
  await form.locator("button").click();
  await until("words", async () => /speed_max/.test(await form.locator("p").textContent()));
  assert.equal(await of_robot(), "0.7");
  await form.locator("input").fill("fast");
  await form.locator("button").click();
  await until("words", async () => /this is not a number$/.test(await form.locator("p").textContent()));
  await form.locator("input").fill("1");
  await form.locator("button").click();
  await until("it is set", async () => (await of_robot()) === "1");
});

test("a service is called with a form of its type; its answer or refusal is shown", limit, async () => {
  const page = await page_of();
  const form = page.locator("#services [data-key='/robot/set_speed']");
  await form.waitFor();
  await form.locator("input").fill("0.25");
  await form.locator("button").click();
  await until("an answer", async () => /"speed": 0.25/.test(await form.locator("pre").textContent()));
  await form.locator("input").fill("25");
  await form.locator("button").click();
  await until("a refusal", async () => /out of range/.test(await form.locator("pre").textContent()));
});

test("a key has the robot's black box write; a robot without one shows none", limit, async () => {
  const none = await page_of();
  await until("services", async () => (await none.locator("#services .row").count()) > 0);
  assert.ok(await none.locator("#keep").isHidden());
  const folder = await mkdtemp(join(tmpdir(), "rowe-"));
  const serving = program.rowe("serve", "--demo", "--port", "0", "--black-box", folder,
    "--black-box-after", "0 s");
  try {
    const [, origin] = await serving.line(/^rowe serves (http:\/\/\S+)\/ /);
    const page = await page_of(origin);
    await page.locator("#keep").waitFor();
    await page.locator("#keep").click();
    await until("words", async () => /It writes/.test(await page.locator("#black_box_says").textContent()));
    await until("a file", async () => (await readdir(folder)).some((name) => /-asked_.*\.mcap$/.test(name)));
    assert.deepEqual(page.faults, []);
  } finally {
    await serving.end("SIGTERM");
    await rm(folder, { recursive: true });
  }
});

test("this page is among the peers, and the loop among the loops", limit, async () => {
  const page = await page_of();
  await until("peers", async () => (await page.locator("#peers tr").count()) > 0);
  assert.match(await page.locator("#peers").textContent(), /127\.0\.0\.1rosbridge/);
  await until("a loop of 1 kHz, and its bound", async () =>
    /^robot(\d+\.\d{1,3}|\d+){4}8000$/.test(await page.locator("#loops").textContent()));
  assert.deepEqual(page.faults, []);
});

test("who may not set a parameter sees its value alone", limit, async () => {
  for (const [role, may] of [["driver", false], ["supervisor", true]]) {
    const page = await page_of(roles.origin, `#token=${roles.tokens[role]}`, { trusting: true });
    const form = page.locator(speed_max);
    await form.waitFor();
    assert.equal(await form.locator("input").inputValue(), "1");
    if (may) await page.waitForFunction((at) => !document.querySelector(`${at} input`).readOnly, speed_max);
    else assert.ok(await form.locator("input").evaluate(({ readOnly }) => readOnly));
  }
});
