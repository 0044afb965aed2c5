// SPDX-License-Identifier: Apache-2.0
// rosbridge's fragments: roslib 2, unmodified, puts together what it asked for.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Topic } from "roslib";
import { rosbridge_client } from "../support/rosbridge.js";
import { limit, listening, ros, server } from "../support/roslib.js";
import { until } from "../support/watchdog.js";

const map = (bytes) => ({ data: "aé€😀\"\\\n".repeat(bytes / 14) });

test("roslib 2 hears a map in fragments, and other messages between them", limit, async () => {
  const [maps, others] = ["/fragments/map", "/fragments/other"].map((name) =>
    listening(new Topic({ ros, name, messageType: "std_msgs/String" })));
  ros.callOnConnection({ op: "subscribe", id: "sized", topic: "/fragments/map", fragment_size: 1000 });
  const speaker = await rosbridge_client.connect(server.url);
  const say = (topic, msg) => speaker.send({ op: "publish", topic, msg });
  await until("both are heard", () => {
    say("/fragments/map", map(140));
    say("/fragments/other", { data: "x" });
    return maps.got.length > 0 && others.got.length > 0;
  });
  for (const bytes of [2000, 50_000, 600_000]) {
    say("/fragments/map", map(bytes));
    await until("the map comes", () => maps.got.at(-1).data.length === map(bytes).data.length);
    assert.deepEqual(maps.got.at(-1), map(bytes));
  }
  speaker.close();
});
