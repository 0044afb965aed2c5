// SPDX-License-Identifier: Apache-2.0
// roslib in Node, connected to a demo robot of its own while the tests of the file that imports this run.

import { once } from "node:events";
import { after, before } from "node:test";
import { Ros } from "roslib";
import { robot } from "./robot.js";

export const limit = { timeout: 120000 };
export let server; // both are there when the first test begins
export let ros;

before(async () => {
  server = await robot.start();
  ros = await another();
});
after(() => {
  ros?.close();
  server?.kill();
});

export async function another() {
  const made = new Ros({ url: server.url });
  await once(made, "connection");
  return made;
}

// Of a function that takes two callbacks.
export const asked = (ask) =>
  new Promise((done, failed) => ask(done, (why) => failed(new Error(String(why)))));

// What a server reports: the events' names have the requests' ids.
export function with_statuses(made) {
  made.statuses = [];
  const emit = made.emit.bind(made);
  made.emit = (name, ...rest) => {
    if (String(name).startsWith("status")) made.statuses.push(rest[0]);
    return emit(name, ...rest);
  };
  return made;
}

// Subscribes; `got` has what came.
export function listening(topic) {
  topic.got = [];
  topic.subscribe((message) => topic.got.push(message));
  return topic;
}
