// SPDX-License-Identifier: Apache-2.0
// roslib in Node, connected to a demo robot of its own while the tests of the file that imports this run.

import { once } from "node:events";
import { after, before } from "node:test";
import { Ros } from "roslib";
import { robot } from "./robot.js";

export const limit = { timeout: 60000 };
export let server; // both are there when the first test begins
export let ros;

before(async () => {
  server = await robot.start();
  ros = new Ros({ url: server.url });
  await once(ros, "connection");
});
after(() => {
  ros?.close();
  server?.kill();
});
