// SPDX-License-Identifier: Apache-2.0
// usage: node tests/web/pictures.js [FOLDER]
//
// Takes the pictures of the page that docs/page.md shows, at three widths in both schemes, of a robot in a
// room that is scripted: they look alike whenever they are taken. FOLDER: docs/pictures, unless it is said.
// Needs tests/web/run --install, Chromium, and build/release/bin/rowe.
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { start_browser } from "./support/browser.js";
import { recorded } from "./support/recorded.js";
import { robot } from "./support/robot.js";
import { scenery } from "./support/scenery.js";
import { scripted_page } from "./support/scripted.js";

process.env.ROWE_BIN ??= fileURLToPath(new URL("../../build/release/bin/rowe", import.meta.url));
const folder = process.argv[2] ?? fileURLToPath(new URL("../../docs/pictures", import.meta.url));
const plot = "plot=/odom:speed,/power:volts";
const sizes = [[360, 740], [768, 1024], [1440, 900]];
const shows = { 360: ["overview", "drive", "plot", "data", "recording"], 768: ["drive"], 1440: ["overview"] };

// A recording in place of the robot, while it was stopped.
async function show_recording(page) {
  await page.setInputFiles("#pick",
    { name: "ang-01_2026-11-30T04-09-58Z.mcap", mimeType: "", buffer: await recorded() });
  await page.waitForFunction(() => document.body.dataset.state === "recording");
  await page.waitForFunction(() => /7 messages lost$/.test(document.getElementById("deck_says").textContent));
  await page.click("#next_mark");
}

mkdirSync(folder, { recursive: true });
const browser = await start_browser();
const server = await robot.start();
for (const [width, height] of sizes) {
  for (const scheme of ["light", "dark"]) {
    for (const view of shows[width]) {
      const { messages, services } = scenery();
      const shown = await scripted_page.open(browser, server.origin, messages,
        { services, scheme, size: { width, height },
          hash: `#view=${view === "recording" ? "overview" : view}&${plot}` });
      const { page } = shown;
      await page.waitForFunction(() => document.body.dataset.state === "live");
      if (view === "drive") await page.waitForFunction(() => document.body.dataset.drive !== "none");
      if (view === "recording") await show_recording(page);
      if (view === "data") await page.click("#rates [data-key='/power'] > button");
      await page.waitForTimeout(view === "plot" ? 12000 : 5000);
      writeFileSync(join(folder, `${width}-${view}-${scheme}.png`), await page.screenshot());
      await shown.close();
    }
  }
}
await browser.close();
await server.kill();
