// SPDX-License-Identifier: Apache-2.0
// A browser, and a demo robot that serves its page, while the tests of the file that imports this run. They
// are there when it has been imported: a before() of that file would not wait for one of this.

import { after } from "node:test";
import { start_browser } from "./browser.js";
import { robot } from "./robot.js";

export const limit = { timeout: 180000 };
export let browser;
export let server;

after(async () => {
  await browser?.close();
  await server?.kill();
});
browser = await start_browser();
server = await robot.start();
