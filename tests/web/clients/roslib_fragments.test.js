// SPDX-License-Identifier: Apache-2.0
// rosbridge's fragments: roslib 2, unmodified, puts together what it asked for, and a plain WebSocket sees
// how they come, and sends some.
import assert from "node:assert/strict";
import { once } from "node:events";
import { test } from "node:test";
import { Topic } from "roslib";
import { WebSocket } from "ws";
import { limit, ros, server } from "../support/roslib.js";
import { until } from "../support/watchdog.js";

const map = (bytes) => ({ data: "aé€😀\"\\\n".repeat(bytes / 14) });

async function plain() {
  const socket = new WebSocket(server.url);
  socket.got = [];
  socket.on("message", (text) => socket.got.push(JSON.parse(text)));
  socket.say = (message) => socket.send(JSON.stringify(message));
  await once(socket, "open");
  return socket;
}
// A text in fragments of so many characters, of which none is cut.
function* cut(text, size, total = (count) => count) {
  const characters = [...text];
  const count = Math.ceil(characters.length / size);
  for (let num = 0; num !== count; ++num) {
    const data = characters.slice(num * size, (num + 1) * size).join("");
    yield { op: "fragment", id: "cut", data, num, total: total(count) };
  }
}

test("roslib 2 hears a map in fragments, and other messages between them", limit, async () => {
  const [maps, others] = [[], []];
  const topics = [["/fragments/map", maps], ["/fragments/other", others]].map(([name, into]) => {
    const topic = new Topic({ ros, name, messageType: "std_msgs/String" });
    topic.subscribe((message) => into.push(message));
    return topic;
  });
  ros.callOnConnection({ op: "subscribe", id: "sized", topic: "/fragments/map", fragment_size: 1000 });
  const speaker = await plain();
  await until("both are heard", () => {
    speaker.say({ op: "publish", topic: "/fragments/map", msg: map(140) });
    speaker.say({ op: "publish", topic: "/fragments/other", msg: { data: "x" } });
    return maps.length > 0 && others.length > 0;
  });
  for (const bytes of [2000, 50_000, 600_000]) {
    speaker.say({ op: "publish", topic: "/fragments/map", msg: map(bytes) });
    await until("the map comes", () => maps.at(-1).data.length === map(bytes).data.length);
    assert.deepEqual(maps.at(-1), map(bytes));
  }
  topics.forEach((topic) => topic.unsubscribe());
  speaker.close();
});

test("fragments have the size that was asked for, their count, and one id", limit, async () => {
  const [listener, speaker] = [await plain(), await plain()];
  listener.say({ op: "subscribe", topic: "/fragments/plain", fragment_size: 5000 });
  await until("it subscribes", () => {
    speaker.say({ op: "publish", topic: "/fragments/plain", msg: { data: "short" } });
    return listener.got.length > 0;
  });
  listener.got.length = 0;
  const message = { op: "publish", topic: "/fragments/plain", msg: map(300_000) };
  speaker.say(message);
  const fragments = () => listener.got.filter(({ op }) => op === "fragment");
  await until("all come", () => fragments().length > 0 && fragments().length === fragments()[0].total);
  for (const [i, { id, num, total, data }] of fragments().entries()) {
    assert.equal(num, i);
    assert.equal(id, fragments()[0].id);
    assert.equal(total, fragments().length);
    assert.ok(Buffer.byteLength(data) <= 5000);
  }
  assert.deepEqual(JSON.parse(fragments().map(({ data }) => data).join("")), message);
  listener.say({ op: "subscribe", topic: "/fragments/plain", fragment_size: 0 });
  await until("it is refused", () => listener.got.some(({ op, msg }) => op === "status" &&
    /fragment_size" must be at least 256; it is 0/.test(msg)));
  listener.close();
  speaker.close();
});

test("a message that comes in fragments counts as any other, with others between them", limit, async () => {
  const [listener, speaker] = [await plain(), await plain()];
  listener.say({ op: "subscribe", topic: "/fragments/in" });
  listener.say({ op: "subscribe", topic: "/fragments/between" });
  await until("it subscribes", () => {
    speaker.say({ op: "publish", topic: "/fragments/between", msg: {} });
    return listener.got.length > 0;
  });
  for (const total of [(count) => count, (count) => count + 0.625]) {
    const message = { op: "publish", topic: "/fragments/in", msg: map(400_000) };
    for (const one of cut(JSON.stringify(message), 20_000, total)) {
      speaker.say(one);
      speaker.say({ op: "publish", topic: "/fragments/between", msg: { num: one.num } });
    }
    await until("it comes", () => listener.got.some(({ topic }) => topic === "/fragments/in"));
    assert.deepEqual(listener.got.find(({ topic }) => topic === "/fragments/in"), message);
    assert.ok(listener.got.some(({ msg }) => msg.num === 3));
    listener.got.length = 0;
  }
  const call = { op: "call_service", id: "topics", service: "/rosapi/topics" };
  for (const one of cut(JSON.stringify(call), 9)) speaker.say(one);
  await until("the call is answered", () => speaker.got.some(({ id }) => id === "topics"));
  assert.deepEqual(speaker.got.filter(({ op }) => op === "status"), []);
  listener.close();
  speaker.close();
});
