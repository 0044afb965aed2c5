// SPDX-License-Identifier: Apache-2.0
// A service that never answers keeps all others (rosbridge_suite 650, 705, 905). Answers at a high rate come
// without their end (rosbridge_suite 1087).
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, before, test } from "node:test";
import { Ros, Service } from "roslib";
import { rosbridge_client } from "../support/rosbridge.js";
import { ask, hub } from "../support/reenact.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
let server;
before(async () => (server = await hub()));
after(() => server?.kill());

// Provides services: `answers` maps names to functions of the arguments; undefined: no answer, ever.
async function provider(answers) {
  const client = await rosbridge_client.connect(server.url);
  client.asked = 0;
  client.socket.on("message", (data) => {
    const { op, id, service, args } = JSON.parse(data);
    if (op !== "call_service") return;
    client.asked += 1;
    const values = answers[service](args);
    if (values) client.send({ op: "service_response", id, service, values, result: true });
  });
  for (const service of Object.keys(answers)) {
    client.send({ op: "advertise_service", service, type: "std_srvs/Trigger" });
  }
  await ask(client, "/rosapi/services");
  return client;
}

async function page() {
  const ros = new Ros({ url: server.url });
  await once(ros, "connection");
  ros.call = (name, args, timeout) => new Promise((done, failed) => {
    const service = new Service({ ros, name, serviceType: "std_srvs/Trigger" });
    service.callService(args, done, (why) => failed(new Error(why)), timeout);
  });
  return ros;
}

test("calls that are never answered keep no other call, of the same page or of another", limit, async () => {
  const busy = await provider({ "/hang": () => undefined, "/quick": ({ n }) => ({ n }) });
  const [one, other] = [await page(), await page()];
  for (let i = 0; i < 20; i++) one.call("/hang", {}, 1000).catch(() => {}); // roslib itself never ends them
  await until("they have all been asked", () => busy.asked >= 20);
  for (let n = 0; n < 100; n++) {
    for (const ros of [one, other]) assert.deepEqual(await ros.call("/quick", { n }), { n });
  }
  // Who asked for too many is told, and that is all.
  const more = Array.from({ length: 40 }, () => one.call("/hang", {}, 1).catch((why) => why));
  assert.ok((await Promise.all(more)).every((why) => why instanceof Error));
  assert.deepEqual(await other.call("/quick", { n: 7 }), { n: 7 });
  one.close();
  busy.close();
  const is_gone = () => other.call("/quick", {}).then(() => false, (why) => /exist/.test(why.message));
  await until("the provider is gone", is_gone);
  other.close();
});

test("answers at a high rate are whole, and there is one for each call", limit, async () => {
  const calls = 3000;
  const window = 16;
  const there = await provider({ "/echo": (args) => args });
  const client = await rosbridge_client.connect(server.url);
  let answered = 0;
  let sent = 0;
  const waiting = new Set();
  const send = () => {
    const padding = "\u00e9\"\\/".repeat(sent % 250);
    client.send({ op: "call_service", id: `c${sent}`, service: "/echo", args: { n: sent, padding } });
    waiting.add(`c${sent}`);
    sent += 1;
  };
  client.socket.on("message", (data) => {
    const { op, id, values, result } = JSON.parse(data); // throws, were it cut
    if (op !== "service_response") return;
    assert.ok(result, `${id}: ${values}`);
    assert.ok(waiting.delete(id), id);
    const n = Number(id.slice(1));
    assert.deepEqual(values, { n, padding: "\u00e9\"\\/".repeat(n % 250) });
    answered += 1;
    if (sent < calls) send();
  });
  while (sent < window) send();
  await until("all answers", () => answered === calls);
  for (const each of [there, client]) each.close();
});
