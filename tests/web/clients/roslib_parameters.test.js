// SPDX-License-Identifier: Apache-2.0
// roslib's Param: what a page reads and sets, and what it is told where that is refused.
import assert from "node:assert/strict";
import { test } from "node:test";
import { limit, ros } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import { Param, Service, Topic } from "roslib";

const param = (name) => new Param({ ros, name });
const get = (name) => new Promise((resolve, reject) => param(name).get(resolve, reject));
const set = (name, value) => new Promise((resolve, reject) => param(name).set(value, resolve, reject));

test("a parameter is read, set, and heard of", limit, async () => {
  const heard = [];
  const topic = new Topic({ ros, name: "/rowe/parameters", messageType: "" });
  topic.subscribe((message) => heard.push(message.values["/robot/speed_max"]));
  assert.equal(await get("/robot/speed_max"), 1);
  await until("the latched value comes", () => heard.includes(1));
  await set("/robot/speed_max", 0.25);
  assert.equal(await get("robot/speed_max"), 0.25);
  await until("the change is told", () => heard.includes(0.25));
  const speed = new Service({ ros, name: "/robot/set_speed", serviceType: "" });
  const asked = (request) => new Promise((resolve, reject) => speed.callService(request, resolve, reject));
  await until("the loop obeys it", async () => {
    try {
      await asked({ speed: 0.5 });
      return false;
    } catch (why) {
      return String(why).includes("/robot/speed_max");
    }
  });
  assert.deepEqual(await asked({ speed: 0.25 }), { speed: 0.25 });
});

test("what is refused calls the callback for failures, with the reason", limit, async () => {
  await assert.rejects(set("/robot/speed_max", 7), (why) => String(why).includes("from 0 to 1 is wanted"));
  await assert.rejects(set("/robot/speed_max", "fast"), (why) => String(why).includes('it is \\"fast\\"') ||
    String(why).includes('it is "fast"'));
  await assert.rejects(set("/nobodys", 7), (why) => String(why).includes("there is no such parameter"));
  await assert.rejects(get("/nobodys"), (why) => String(why).includes("there is no such parameter"));
  await assert.rejects(set("/rowe/limits/topics_max", 7), (why) => String(why).includes("read only"));
  await assert.rejects(new Promise((resolve, reject) => param("/robot/speed_max").delete(resolve, reject)),
    (why) => String(why).includes("nobody can delete it"));
  assert.ok((await get("/rowe/limits/connections_max")) > 0);
});

test("getParams lists them", limit, async () => {
  const names = await new Promise((resolve, reject) => ros.getParams(resolve, reject));
  assert.ok(names.includes("/robot/speed_max") && names.includes("/rowe/counters/messages_in"));
});
