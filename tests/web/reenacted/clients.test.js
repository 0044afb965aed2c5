// SPDX-License-Identifier: Apache-2.0
// Many pages are opened at once, reload, lose their network and come again, and the server stands still or
// grows (rosbridge_suite 165, 243, 403, 425, 720, 783, 803, 989). A page that subscribes and unsubscribes
// quickly gets messages twice or for ever, or ends the server (rosbridge_suite 947; rws 20).
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, before, test } from "node:test";
import { WebSocket } from "ws";
import { Ros, Topic } from "roslib";
import { rosbridge_client } from "../support/rosbridge.js";
import { all_of, ask, hub, listener, memory_of, publish } from "../support/reenact.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
let server;
before(async () => (server = await hub()));
after(() => server?.kill());

test("thirty pages that come at once get all of four topics", limit, async () => {
  const speaker = await rosbridge_client.connect(server.url);
  const topics = ["/a", "/b", "/c", "/d"];
  const pages = await Promise.all(Array.from({ length: 30 }, async () => {
    const ros = new Ros({ url: server.url });
    ros.numbers = Object.fromEntries(topics.map((topic) => [topic, []]));
    await once(ros, "connection");
    for (const name of topics) {
      new Topic({ ros, name, messageType: "std_msgs/String" })
        .subscribe(({ number }) => ros.numbers[name].push(number));
    }
    await new Promise((done, failed) => ros.getTopics(done, failed)); // the subscriptions have been read
    return ros;
  }));
  await Promise.all(topics.map((topic) => publish(speaker, topic, 100, pages, { burst: 4 })));
  for (const { numbers } of pages) {
    for (const topic of topics) assert.deepEqual(numbers[topic], all_of(100));
  }
  for (const page of pages) page.close();
  speaker.close();
});

// Connects, subscribes, and leaves without a word: with the first message, or before it.
async function pass_by(url, stays) {
  const socket = new WebSocket(url);
  socket.on("error", () => {});
  await once(socket, "open");
  for (const topic of ["/kept", "/steady"]) {
    socket.send(JSON.stringify({ op: "subscribe", topic, type: "std_msgs/String" }));
  }
  if (stays) await once(socket, "message");
  socket.terminate();
}

test("a storm of pages that come and go costs one that stays nothing", limit, async () => {
  const speaker = await rosbridge_client.connect(server.url);
  speaker.send({ op: "advertise", topic: "/kept", type: "std_msgs/String", latch: true });
  speaker.send({ op: "publish", topic: "/kept", msg: { data: "kept" }, latch: true });
  const steady = await listener(server.url, "/steady");
  let sent = 0;
  const storm = async (waves) => {
    for (let wave = 0; wave < waves; wave++) {
      const passing = Array.from({ length: 16 }, (_, i) => pass_by(server.url, i % 2 === 0));
      await publish(speaker, "/steady", 50, [steady], { from: sent });
      sent += 50;
      await Promise.all(passing);
    }
    await until("they are gone", async () => (await ask(speaker, "/rowe/stats")).peers === 2);
  };
  await storm(4);
  const before = memory_of(server);
  await storm(20);
  assert.equal(memory_of(server) - before, 0);
  assert.deepEqual(steady.numbers["/steady"], all_of(sent));
  for (const one of [speaker, steady]) one.close();
});

test("a page that subscribes and unsubscribes quickly gets each message once, or none", limit, async () => {
  const speaker = await rosbridge_client.connect(server.url);
  const page = await listener(server.url);
  page.numbers = { "/flipped": [] };
  const flip = (times, op = "unsubscribe") => {
    for (let i = 0; i < times; i++) {
      const id = `flip-${i}`;
      page.send({ op: "subscribe", id, topic: "/flipped", type: "std_msgs/String", throttle_rate: i % 3 });
      if (i + 1 < times || op === "unsubscribe") page.send({ op: "unsubscribe", id, topic: "/flipped" });
    }
  };
  for (let i = 0; i < 10; i++) {
    flip(50);
    await ask(page, "/rosapi/topics");
  }
  const nobody = await rosbridge_client.connect(server.url);
  nobody.send({ op: "publish", topic: "/flipped", msg: { number: -1 } });
  await ask(nobody, "/rosapi/topics");
  await ask(page, "/rosapi/topics"); // what was sent to it is there
  assert.deepEqual(page.numbers["/flipped"], []);
  page.send({ op: "subscribe", id: "last", topic: "/flipped", type: "std_msgs/String" });
  await ask(page, "/rosapi/topics");
  await publish(speaker, "/flipped", 100, [page]);
  assert.deepEqual(page.numbers["/flipped"], all_of(100));
  // Two subscriptions of one connection, and one of them goes.
  page.send({ op: "subscribe", id: "second", topic: "/flipped", type: "std_msgs/String" });
  page.send({ op: "unsubscribe", id: "second", topic: "/flipped" });
  await ask(page, "/rosapi/topics");
  await publish(speaker, "/flipped", 100, [page], { from: 100 });
  assert.deepEqual(page.numbers["/flipped"], all_of(200));
  for (const one of [speaker, page, nobody]) one.close();
});
