// SPDX-License-Identifier: Apache-2.0
// roslib as npm has it, in a page that a browser believes to come from the robot: the files of node_modules
// are answered by the browser's own interception, so there is no bundler, no second origin, and not a byte is
// changed. Where each package keeps what a browser can load is what an import map is for. (roslib ships one
// that names a CDN.)

import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { new_page } from "./browser.js";

const modules = fileURLToPath(new URL("../node_modules/", import.meta.url));

const imports = {
  roslib: "roslib/dist/RosLib.js",
  eventemitter3: "eventemitter3/dist/eventemitter3.esm.js",
  uuid: "uuid/dist/index.js",
  bson: "bson/lib/bson.mjs",
  cbor2: "cbor2/lib/index.js",
  "@cto.af/wtf8": "@cto.af/wtf8/lib/index.js",
  "fast-png": "fast-png/lib/index.js",
  fflate: "fflate/esm/browser.js",
  iobuffer: "iobuffer/lib/iobuffer.js",
};

const addresses = Object.entries(imports).map(([name, file]) => [name, `/node_modules/${file}`]);
const map = JSON.stringify({ imports: Object.fromEntries(addresses) });
const html = `<!doctype html><title>roslib</title><script type="importmap">${map}</script>
<script type="module">window.roslib = await import("roslib");</script>`;

// A page in which `window.roslib` is the module.
export const roslib_page = async (browser, origin) => load_roslib(await new_page(browser), origin);

// The same in a page that is there already.
export async function load_roslib(page, origin) {
  await page.route(`${origin}/roslib`, (route) => route.fulfill({ contentType: "text/html", body: html }));
  await page.route(`${origin}/node_modules/**`, (route) => {
    const file = new URL(route.request().url()).pathname.replace("/node_modules/", "");
    return route.fulfill({ contentType: "text/javascript", path: join(modules, file) });
  });
  await page.route(`${origin}/favicon.ico`, (route) => route.fulfill({ status: 204 }));
  await page.goto(`${origin}/roslib`);
  await page.waitForFunction(() => window.roslib);
  return page;
}
