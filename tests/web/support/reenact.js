// SPDX-License-Identifier: Apache-2.0
// What the reenacted reports have in common. Bounds are counts, never times: who publishes waits until those
// who read well have read, so that a busy machine is only slow, and whatever is missing was lost.

import { once } from "node:events";
import { readFileSync } from "node:fs";
import { WebSocket } from "ws";
import { robot } from "./robot.js";
import { rosbridge_client } from "./rosbridge.js";
import { until } from "./watchdog.js";

// A hub without a robot.
export const hub = (...how) => robot.start("--name", "hub", ...how);

// Bytes that the program has got for itself; its limits are taken when it starts, so this must not grow.
export function memory_of({ child: { pid } }) {
  const [, kilobytes] = readFileSync(`/proc/${pid}/status`, "ascii").match(/^VmData:\s+(\d+) kB/m);
  return Number(kilobytes) * 1024;
}

// The answer of one of the endpoint's own services.
export async function ask(client, service, args = {}) {
  const id = `ask-${client.received.length}-${Math.random()}`;
  client.send({ op: "call_service", id, service, args });
  const answer = await client.first(`the answer of ${service}`, (message) => message.id === id);
  return answer.values;
}

// A socket that has asked for a topic and reads nothing from then on.
export async function stalled(url, topic) {
  const socket = new WebSocket(url);
  socket.on("error", () => {});
  await once(socket, "open");
  socket.send(JSON.stringify({ op: "subscribe", topic, type: "std_msgs/String" }));
  socket.pause();
  return socket;
}

// A client that checks as it reads: `numbers` of each topic, in the order in which they came.
export async function listener(url, ...topics) {
  const client = await rosbridge_client.connect(url);
  client.numbers = Object.fromEntries(topics.map((topic) => [topic, []]));
  client.socket.removeAllListeners("message");
  client.socket.on("message", (data) => {
    const message = JSON.parse(data);
    if (message.op === "publish") client.numbers[message.topic]?.push(message.msg.number);
    else client.received.push(message);
  });
  for (const topic of topics) client.send({ op: "subscribe", topic, type: "std_msgs/String" });
  await ask(client, "/rosapi/topics"); // so the subscriptions have been read
  return client;
}

export const has = (client, topic, count) => client.numbers[topic].length >= count;

// Publishes `count` numbered messages on `topic`, `burst` at a time, and waits after each burst until all of
// `readers` have it. Returns how many each of them has of it.
export async function publish(speaker, topic, count, readers, { burst = 8, bytes = 100, from = 0 } = {}) {
  const padding = "x".repeat(bytes);
  for (let number = from; number < from + count; ) {
    for (let i = 0; i < burst && number < from + count; i++, number++) {
      speaker.send({ op: "publish", topic, msg: { number, data: padding } });
    }
    await until(`all have ${number} of ${topic}`, () => readers.every((one) => has(one, topic, number)));
  }
}

// 0, 1, 2 ...
export const all_of = (count) => Array.from({ length: count }, (_, i) => i);
