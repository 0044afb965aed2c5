// SPDX-License-Identifier: Apache-2.0
// roslib's Param: what a page reads and sets, and what it is told where that is refused.
import assert from "node:assert/strict";
import { test } from "node:test";
import { asked, limit, ros } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import { Param, Service, Topic } from "roslib";

const param = (name) => new Param({ ros, name });
const get = (name) => asked((...callbacks) => param(name).get(...callbacks));
const set = (name, value) => asked((...callbacks) => param(name).set(value, ...callbacks));
const rejects = (what, why) => assert.rejects(what, (told) => String(told).includes(why));

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
  const called = (request) => asked((...callbacks) => speed.callService(request, ...callbacks));
  await until("the loop obeys it", () =>
    called({ speed: 0.5 }).then(() => false, (why) => String(why).includes("/robot/speed_max")));
  assert.deepEqual(await called({ speed: 0.25 }), { speed: 0.25 });
});

test("what is refused calls the callback for failures, with the reason", limit, async () => {
  await rejects(set("/robot/speed_max", 7), "from 0 to 1 is wanted");
  await assert.rejects(set("/robot/speed_max", "fast"), (why) => String(why).includes('it is \\"fast\\"') ||
    String(why).includes('it is "fast"'));
  await rejects(set("/nobodys", 7), "there is no such parameter");
  await rejects(get("/nobodys"), "there is no such parameter");
  await rejects(set("/rowe/limits/topics_max", 7), "read-only");
  await rejects(asked((...callbacks) => param("/robot/speed_max").delete(...callbacks)),
    "nobody can delete it");
  assert.ok((await get("/rowe/limits/connections_max")) > 0);
});

test("getParams lists them", limit, async () => {
  const names = await asked((...callbacks) => ros.getParams(...callbacks));
  assert.ok(names.includes("/robot/speed_max") && names.includes("/rowe/counters/messages_in"));
});
