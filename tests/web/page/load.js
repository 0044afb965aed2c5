// SPDX-License-Identifier: Apache-2.0
// Gives Node the page's scripts as the modules that they are: beside them stands no package.json that says
// so, hence the copy, with the client where they find it.

import { cpSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const source = fileURLToPath(new URL("../../../src/page/", import.meta.url));
const client = fileURLToPath(new URL("../../../clients/js/src/", import.meta.url));
const copy = mkdtempSync(join(tmpdir(), "rowe-page-"));
process.on("exit", () => rmSync(copy, { recursive: true, force: true }));
cpSync(source, join(copy, "src/page"), { recursive: true });
cpSync(client, join(copy, "clients/js/src"), { recursive: true });
writeFileSync(join(copy, "package.json"), '{ "type": "module" }');

export const load = (name) => import(pathToFileURL(join(copy, "src/page", name)));
