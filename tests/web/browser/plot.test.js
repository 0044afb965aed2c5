// SPDX-License-Identifier: Apache-2.0
// An HTML file of `rowe plot`, opened as a file: it draws what it has, and asks nobody for anything.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { artefact, close_pages, desk, new_page, start_browser } from "../support/browser.js";
import { program } from "../support/program.js";

const limit = { timeout: 180000 };
const folder = mkdtempSync(join(tmpdir(), "rowe-plot-"));
let browser;

// Ten seconds at 50 Hz with a pause, and a stop of one second.
function* lines() {
  for (let i = 0; i < 500; ++i) {
    const time = 1764475798 + i / 50;
    if (i < 300 || i >= 400) {
      yield { topic: "/odom", time, msg: { x: Math.sin(i / 40), y: Math.cos(i / 40), speed: i % 50 } };
    }
    if (i % 10 === 0) {
      const state = i >= 200 && i < 250 ? "stopped" : "running";
      const msg = { state, number: 3, cause: "request", source: "joystick" };
      yield { topic: "/rowe/stop/state", time, msg };
    }
    if (i === 120) yield { topic: "/rowe/record/lost", time, msg: { topic: "/odom", messages: 7 } };
  }
}

async function plot(name, ...options) {
  const out = join(folder, name);
  const run = program.rowe("plot", join(folder, "run.jsonl"), "-o", out, ...options);
  assert.equal(await run.end(), 0, run.stderr);
  return pathToFileURL(out).href;
}

before(async () => {
  writeFileSync(join(folder, "run.jsonl"), [...lines()].map((line) => `${JSON.stringify(line)}\n`).join(""));
  browser = await start_browser();
});
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true });
});
afterEach(() => close_pages(browser));

// How many pixels of a lane's lines have a colour of the style; a line's edges have others.
const pixels_of = (page, lane, variable) => page.evaluate(([index, name]) => {
  const at = document.querySelectorAll(".lane")[index];
  const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  probe.fillStyle = getComputedStyle(at).getPropertyValue(name).trim();
  probe.fillRect(0, 0, 1, 1);
  const wanted = probe.getImageData(0, 0, 1, 1).data.join();
  let count = 0;
  for (const canvas of at.querySelectorAll("canvas")) {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    for (let i = 0; i < data.length; i += 4) if (data.slice(i, i + 4).join() === wanted) ++count;
  }
  return count;
}, [lane, variable]);

// The labels of a lane's axis of time.
const times_of = (page, lane) =>
  page.locator(".lane").nth(lane).locator(".dygraph-axis-label-x").allTextContents();

for (const scheme of ["light", "dark"]) {
  test(`it draws each field in its colour, and what happened (${scheme})`, limit, async () => {
    const page = await new_page(browser, { size: desk, scheme });
    const url = await plot("a.html", "--field", "/odom:x,y", "--field", "/odom:speed");
    await page.goto(url);
    assert.equal(await page.locator(".lane").count(), 2);
    assert.deepEqual(await page.locator("li code").allTextContents(), ["/odom:x", "/odom:y", "/odom:speed"]);
    for (const [lane, variable] of [[0, "--accent"], [0, "--two"], [1, "--accent"]]) {
      assert.ok(await pixels_of(page, lane, variable) > 100, `${variable} in lane ${lane}`);
    }
    assert.equal(await pixels_of(page, 1, "--two"), 0);
    for (const variable of ["--stop", "--quiet", "--warn"]) {
      assert.ok(await pixels_of(page, 0, variable) > 5, variable);
    }
    assert.deepEqual(await page.locator("#marks span").allTextContents(),
      ["stop 3 at 4 s, for 1.000 s: request by joystick", "1 gap", "7 messages lost"]);
    assert.match(await page.textContent("#foot"), /^s since 20/);
    const colour_of_labels = await page.evaluate(() =>
      getComputedStyle(document.querySelector(".dygraph-axis-label")).color);
    assert.equal(colour_of_labels, scheme === "light" ? "rgb(84, 93, 104)" : "rgb(154, 165, 177)");
    await page.screenshot({ path: artefact(`plot_${scheme}.png`) });
    assert.deepEqual(page.faults, []);
    assert.deepEqual(page.asked, [url]);
  });
}

test("a line is broken where nothing came", limit, async () => {
  const page = await new_page(browser, { size: desk });
  await page.goto(await plot("b.html", "--field", "/odom:x"));
  const drawn = await page.evaluate(() => {
    const [canvas] = document.querySelectorAll(".lane canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const wanted = [0x0a, 0x58, 0xc2].join();
    const columns = new Set();
    for (let i = 0; i < data.length; i += 4) {
      if (data.slice(i, i + 3).join() === wanted) columns.add((i / 4) % canvas.width / canvas.width);
    }
    return [...columns];
  });
  assert.ok(drawn.some((x) => x < 0.6) && drawn.some((x) => x > 0.85));
  assert.ok(!drawn.some((x) => x > 0.66 && x < 0.8), "nothing is drawn in the gap");
});

test("who zooms into one lane zooms into all, and the pointer reads the values", limit, async () => {
  const page = await new_page(browser, { size: desk });
  await page.goto(await plot("c.html", "--field", "/odom:x,y", "--field", "/odom:speed"));
  const before_it = await times_of(page, 1);
  const { x, y, width, height } = await page.locator(".lane").first().boundingBox();
  await page.mouse.move(x + width * 0.3, y + height / 2);
  assert.match(await page.locator("li b").first().textContent(), /^-?\d\.\d+$/);
  await page.mouse.down();
  await page.mouse.move(x + width * 0.5, y + height / 2, { steps: 5 });
  await page.mouse.up();
  await page.waitForFunction((old) => {
    const labels = [...document.querySelectorAll(".lane")].at(-1).querySelectorAll(".dygraph-axis-label-x");
    return [...labels].map((each) => each.textContent).join() !== old;
  }, before_it.join());
  assert.deepEqual(await times_of(page, 1), await times_of(page, 0));
  assert.notDeepEqual(await times_of(page, 1), before_it);
  assert.deepEqual(page.faults, []);
});

test("names and titles are texts, whatever is in them", limit, async () => {
  const page = await new_page(browser, { size: desk });
  const title = "</script><img src=x onerror=alert(1)>";
  await page.goto(await plot("d.html", "--field", "/odom:x", "--title", title));
  assert.equal(await page.textContent("h1"), title);
  assert.equal(await page.title(), title);
  assert.equal(await page.locator("img").count(), 0);
  assert.deepEqual(page.faults, []);
});

test("with --dark it is dark in the light, too", limit, async () => {
  const page = await new_page(browser, { size: desk });
  await page.goto(await plot("e.html", "--field", "/odom:x", "--dark"));
  const ground = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  assert.equal(ground, "rgb(11, 14, 17)");
  await page.screenshot({ path: artefact("plot_forced_dark.png") });
});
