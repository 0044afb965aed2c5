// SPDX-License-Identifier: Apache-2.0
// The example page of clients/js with its modules, in a page that a browser believes to come from the robot:
// the browser's own interception answers with the files as they are.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { new_page } from "./browser.js";

const source = fileURLToPath(new URL("../../../clients/js/", import.meta.url));

// `module` is run in place of the example's, if it is there; `files` are more that the page may ask for.
export async function client_page(browser, origin, { module, files = {} } = {}) {
  const page = await new_page(browser);
  const html = readFileSync(join(source, "examples", "page.html"), "utf8");
  const own = `<!doctype html><title>own</title>
    <script type="importmap">{ "imports": { "rowe": "./rowe/rowe.js" } }</script>
    <script type="module">${module}</script>`;
  const body = module ? own : html;
  await page.route(`${origin}/**`, (route) => {
    const { pathname } = new URL(route.request().url());
    if (pathname === "/page.html") return route.fulfill({ contentType: "text/html", body });
    const script = { contentType: "text/javascript" };
    if (files[pathname]) return route.fulfill({ ...script, body: files[pathname] });
    if (!pathname.startsWith("/rowe/")) return route.fulfill({ status: 204 });
    return route.fulfill({ ...script, path: join(source, "src", pathname.replace("/rowe/", "")) });
  });
  await page.goto(`${origin}/page.html`);
  return page;
}
