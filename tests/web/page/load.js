// SPDX-License-Identifier: Apache-2.0
// Gives Node the page's scripts as the modules that browsers take them for, with the client where the robot
// serves it: beside them stands no package.json that says so, hence the copy.

import { cpSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const source = fileURLToPath(new URL("../../../src/page/", import.meta.url));
const client = fileURLToPath(new URL("../../../clients/js/src/", import.meta.url));
const copy = mkdtempSync(join(tmpdir(), "rowe-page-"));
process.on("exit", () => rmSync(copy, { recursive: true, force: true }));
cpSync(source, copy, { recursive: true });
cpSync(client, join(copy, "client"), { recursive: true });
writeFileSync(join(copy, "package.json"), '{ "type": "module" }');

export const load = (name) => import(pathToFileURL(join(copy, name)));
