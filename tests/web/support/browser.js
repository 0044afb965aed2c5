// SPDX-License-Identifier: Apache-2.0
// A headless Chromium with a profile of its own, and pages that remember what went wrong in them.

import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { watchdog_ms } from "./watchdog.js";

export const phone = { width: 360, height: 740 };
export const desk = { width: 1280, height: 800 };

// Chromium refuses its sandbox to root; the rest keeps it from talking to anybody but the robot.
export const flags = [
  "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync",
];

// Chromium itself, and what is quicker to use where nobody looks: the same engine without its windows.
export const whole = process.env.CHROMIUM ?? "/usr/bin/chromium";
const program = process.env.CHROMIUM_HEADLESS ?? whole;
export const start_browser = () =>
  chromium.launch({ executablePath: program, headless: true, args: flags });

// A new page with `faults` (console errors and exceptions) and `asked` (every address asked for, sockets
// included). One that is `trusting` takes whatever certificate it is shown.
export async function new_page(browser, { size = phone, scheme = "light", trusting = false } = {}) {
  const context = await browser.newContext({
    viewport: size, colorScheme: scheme, isMobile: size === phone, hasTouch: size === phone,
    deviceScaleFactor: size === phone ? 2 : 1, ignoreHTTPSErrors: trusting,
    permissions: ["local-network-access"],  // for pages that the tests answer themselves
  });
  context.setDefaultTimeout(watchdog_ms);
  const page = await context.newPage();
  page.faults = [];
  page.asked = [];
  page.on("console", (line) => line.type() === "error" && page.faults.push(line.text()));
  page.on("pageerror", (error) => page.faults.push(String(error)));
  page.on("request", (request) => page.asked.push(request.url()));
  page.on("websocket", (socket) => page.asked.push(socket.url()));
  return page;
}

// For afterEach() of who has no page that stays.
export async function close_pages(browser) {
  for (const context of browser.contexts()) await context.close();
}

export const artefact = (name) => {
  const folder = process.env.ROWE_ARTEFACTS ?? "artefacts";
  mkdirSync(folder, { recursive: true });
  return join(folder, name);
};
