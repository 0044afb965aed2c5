// SPDX-License-Identifier: Apache-2.0
// Whether people who cannot see the page, or not well, can use it: axe-core's rules on each view, in the
// states that matter, on a phone and on a desk, each in one of the two schemes.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { afterEach, test } from "node:test";
import { desk, phone } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { recorded } from "../support/recorded.js";
import { scenery, stop_state } from "../support/scenery.js";
import { scripted_page } from "../support/scripted.js";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const plot = "plot=/odom:speed,/power:volts";
let shown;
afterEach(() => shown?.close());

async function faults_of(page) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const places = (nodes) => nodes.map(({ target }) => target.join(" ")).join(", ");
  return violations.map(({ id, nodes }) => `${id}: ${places(nodes)}`);
}

const stopped = () => stop_state({ state: "stopped", cause: "request", source: "10.0.0.7:51000" });
const states = {
  live: { more: {}, is: "live" },
  stopped: { more: { "/rowe/stop/state": stopped }, is: "live" },
  stale: { more: {}, is: "stale", then: (robot) => delete robot.messages["/odom"] },
  recording: { more: {}, is: "recording", then: async ({ page }) => page.setInputFiles("#pick",
    { name: "run.mcap", mimeType: "", buffer: await recorded() }) },
};
const looks = {
  "a phone, light": { size: phone, scheme: "light" },
  "a desk, dark": { size: desk, scheme: "dark" },
};
for (const [where, look] of Object.entries(looks)) {
  for (const [name, { more, is, then }] of Object.entries(states)) {
    test(`${where}, ${name}: axe finds nothing in any view`, limit, async () => {
      const { messages, services } = scenery(more);
      const options = { hash: `#${plot}`, services, ...look };
      shown = await scripted_page.open(browser, server.origin, messages, options);
      const { page } = shown;
      await page.waitForFunction(() => document.body.dataset.state === "live");
      await page.locator("#view_drive").waitFor({ state: "visible" });
      await page.click("#view_data");
      await page.click("#rates [data-key='/power'] > button");
      await page.waitForFunction(() => document.querySelector("#rates .values > div"));
      await then?.(shown);
      await page.waitForFunction((wanted) => document.body.dataset.state === wanted, is);
      for (const view of ["data", "plot", "drive", "overview"]) {
        if (!await page.locator(`#view_${view}`).isVisible()) continue;
        await page.click(`#view_${view}`);
        assert.deepEqual(await faults_of(page), [], view);
      }
      assert.deepEqual(page.faults, []);
    });
  }
}

test("axe finds what is wrong", limit, async () => {
  const { messages, services } = scenery();
  shown = await scripted_page.open(browser, server.origin, messages, { services });
  await shown.page.waitForFunction(() => document.body.dataset.state === "live");
  await shown.page.evaluate(() => document.getElementById("follow").removeAttribute("aria-label"));
  assert.match((await faults_of(shown.page)).join(), /^button-name: #follow$/);
});
