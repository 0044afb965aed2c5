// SPDX-License-Identifier: Apache-2.0
// What a person sees whose browser meets the robot's certificate: without its root a warning, and a way on;
// with its root the page at once. The pictures are those of docs/network.md.
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { chromium } from "playwright-core";
import { artefact, flags, phone, whole } from "../support/browser.js";
import { set_up_robot } from "../support/set_up.js";
import { watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 180000 };
const no_certutil = spawnSync("certutil", ["-H"]).error !== undefined && !process.env.ROWE_COMPLETE;
const with_root = { ...limit, skip: no_certutil && "certutil is not installed (libnss3-tools)" };
let robot, homes;

before(async () => {
  robot = await set_up_robot.start();
  await robot.serve();
  homes = mkdtempSync(join(tmpdir(), "rowe-home-"));
});
after(() => {
  robot?.end();
  if (homes) rmSync(homes, { recursive: true, force: true });
});

// The browser of a person whose home is this: Chromium looks for roots there.
async function at_home(name, use) {
  const home = join(homes, name);
  mkdirSync(home, { recursive: true });
  const env = { ...process.env, HOME: home };
  const browser = await chromium.launch({ executablePath: whole, headless: true, args: flags, env });
  try {
    const context = await browser.newContext({
      viewport: phone, isMobile: true, hasTouch: true, deviceScaleFactor: 1,
    });
    context.setDefaultTimeout(watchdog_ms);
    await use(await context.newPage());
  } finally {
    await browser.close();
  }
}
const link = () => `${robot.origin}/#token=${robot.tokens.driver}`;
const is_live = (page) => page.waitForFunction(() => document.body.dataset.state === "live");

test("without the root the browser warns, and lets one go on; then the page drives", limit, async () => {
  await at_home("stranger", async (page) => {
    await assert.rejects(page.goto(link()), /ERR_CERT_AUTHORITY_INVALID/);
    await page.waitForSelector("#details-button");
    await page.screenshot({ path: artefact("certificate_warning.png") });
    await page.click("#details-button");
    await page.waitForSelector("#proceed-link");
    await page.screenshot({ path: artefact("certificate_proceed.png") });
    await page.click("#proceed-link");
    await is_live(page);
  });
});

test("with the root in its store the browser opens the page at once", with_root, async () => {
  const store = join(homes, "owner", ".pki", "nssdb");
  mkdirSync(store, { recursive: true });
  const certutil = (...words) => execFileSync("certutil", [...words, "-d", `sql:${store}`]);
  certutil("-N", "--empty-password");
  certutil("-A", "-n", "bot", "-t", "C,,", "-i", join(robot.folder, "ca.crt"));
  await at_home("owner", async (page) => {
    await page.goto(link());
    await is_live(page);
    assert.equal(await page.evaluate(() => isSecureContext), true);
    await page.screenshot({ path: artefact("certificate_trusted.png") });
  });
});
