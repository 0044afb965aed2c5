// SPDX-License-Identifier: Apache-2.0
// A page on a bad network stops reading, and the server keeps for it what it cannot send, until its memory is
// used up, or everybody else waits too (rosbridge_suite 192, 212, 765; ros-foxglove-bridge 116, 126). Large
// messages keep small ones from being sent (ros-foxglove-bridge 174).
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { rosbridge_client } from "../support/rosbridge.js";
import { all_of, ask, hub, listener, memory_of, publish, stalled } from "../support/reenact.js";

const limit = { timeout: 120000 };
let server;
before(async () => (server = await hub()));
after(() => server?.kill());

test("a reader that stops reading costs a healthy one nothing, and the server no memory", limit, async () => {
  const speaker = await rosbridge_client.connect(server.url);
  const healthy = await listener(server.url, "/camera");
  const bytes = 16000;
  await publish(speaker, "/camera", 200, [healthy], { bytes });
  const sick = [await stalled(server.url, "/camera"), await stalled(server.url, "/camera")];
  const before = memory_of(server);
  await publish(speaker, "/camera", 1500, [healthy], { bytes, from: 200 });  // 24 MB to each
  assert.equal(memory_of(server) - before, 0);
  assert.deepEqual(healthy.numbers["/camera"], all_of(1700));
  // It is the sick ones that lost, and it is counted.
  const { counters } = await ask(speaker, "/rowe/stats");
  const lost = Object.entries(counters).some(([name, value]) => value > 0 && /evicted|full|queue/.test(name));
  assert.ok(lost, JSON.stringify(counters));
  for (const one of [...sick, speaker.socket, healthy.socket]) one.terminate();
});

test("large messages beside poses lose no pose", limit, async () => {
  const speaker = await rosbridge_client.connect(server.url);
  const page = await listener(server.url, "/map", "/pose");
  const { limits } = await ask(speaker, "/rowe/stats");
  const largest = Math.min(limits.message_bytes_max, 10e6) - 300;
  const rounds = Math.max(5, Math.min(100, Math.floor(50e6 / largest)));
  for (let i = 0; i < rounds; i++) {
    speaker.send({ op: "publish", topic: "/map", msg: { number: i, data: "x".repeat(largest) } });
    await publish(speaker, "/pose", 5, [page], { from: i * 5 });
    await publish(speaker, "/map", 0, [page]);
  }
  await publish(speaker, "/map", 1, [page], { from: rounds });
  assert.deepEqual(page.numbers["/pose"], all_of(rounds * 5));
  assert.deepEqual(page.numbers["/map"], all_of(rounds + 1));
  for (const one of [speaker, page]) one.close();
});
