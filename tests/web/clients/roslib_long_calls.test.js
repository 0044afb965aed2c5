// SPDX-License-Identifier: Apache-2.0
// Calls between roslib 2 clients whose arguments and answers are far longer than message_bytes_max, as a map
// server's are, and what others notice of them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Service, Topic } from "roslib";
import { another, asked, limit, listening, ros } from "../support/roslib.js";
import { until } from "../support/watchdog.js";

const map = (bytes) => ({
  info: { width: 1000, resolution: 0.05, frame: "map \"é€😀\"" },
  data: Array.from({ length: bytes / 4 }, (_, i) => (i * 7) % 101),
});

const called = (by, name, request) => asked((...callbacks) =>
  new Service({ ros: by, name, serviceType: "nav_msgs/GetMap" }).callService(request, ...callbacks));

async function provided(name, answer) {
  const by = await another();
  const requests = [];
  const service = new Service({ ros: by, name, serviceType: "nav_msgs/GetMap" });
  service.advertise((request, response) => {
    requests.push(request);
    Object.assign(response, answer(request));
    return true;
  });
  await until("the service is there", async () =>
    (await asked((...callbacks) => ros.getServices(...callbacks))).includes(name));
  return { by, requests };
}

test("a map of 900 kB is asked for and comes", limit, async () => {
  const whole = map(900_000);
  const { by, requests } = await provided("/long/static_map", () => ({ map: whole }));
  assert.deepEqual(await called(ros, "/long/static_map", {}), { map: whole });
  // roslib 2 answers as many as are asked at once, each once.
  const many = await Promise.all([1, 2, 3].map((n) => called(ros, "/long/static_map", { n })));
  for (const one of many) assert.deepEqual(one, { map: whole });
  assert.equal(requests.length, 4);
  by.close();
});

test("arguments of 700 kB are given, and what is short goes on meanwhile", limit, async () => {
  const { by, requests } = await provided("/long/set_map", ({ map: { data } }) => ({ cells: data.length }));
  const topic = listening(new Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry" }));
  await until("odometry comes", () => topic.got.length > 0);
  const whole = map(700_000);
  for (let i = 0; i !== 5; ++i) {
    const before = topic.got.length;
    assert.deepEqual(await called(ros, "/long/set_map", { map: whole }), { cells: whole.data.length });
    assert.deepEqual(requests[i], { map: whole });
    await until("odometry goes on", () => topic.got.length > before);
  }
  topic.unsubscribe();
  by.close();
});

test("an answer beyond long_message_bytes_max ends who gives it, and the call fails", limit, async () => {
  const { by } = await provided("/long/too_long", () => ({ data: "x".repeat(3_000_000) }));
  await assert.rejects(called(ros, "/long/too_long", {}), (why) => /went away/.test(why));
  by.close();
});

test("only peers' services are given long arguments", limit, async () => {
  await assert.rejects(called(ros, "/rosapi/topic_type", { topic: "x".repeat(100_000) }),
    (why) => /100\d\d\d bytes exceeds the limit message_bytes_max of \d+: only calls between/.test(why));
});
