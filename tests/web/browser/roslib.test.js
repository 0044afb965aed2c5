// SPDX-License-Identifier: Apache-2.0
// roslib 2.1.0, unmodified, in Chromium: what a robot's web page does today must work when only its URL is
// changed.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { browser, limit, server } from "../support/demo.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { roslib_page } from "../support/roslib_page.js";
import { until } from "../support/watchdog.js";

let page;

before(async () => {
  page = await roslib_page(browser, server.origin);
  // Connections and topics by name, in the page.
  await page.evaluate((url) => {
    window.open_ros = (name) => new Promise((done, failed) => {
      const ros = new window.roslib.Ros({ url });
      window[name] = ros;
      ros.on("connection", done);
      ros.on("error", () => failed(new Error("roslib cannot connect")));
    }).then(() => true);
    window.topic_of = (name, ros, topic, messageType) => {
      window[name] = new window.roslib.Topic({ ros: window[ros], name: topic, messageType });
      window[`${name}_got`] = [];
    };
    window.listen = (name) => window[name].subscribe((message) => window[`${name}_got`].push(message));
  }, server.url);
});

const open = (name) => page.evaluate((of) => window.open_ros(of), name);
const make_topic = (...of) => page.evaluate((args) => window.topic_of(...args), of);
const listen = (name) => page.evaluate((of) => window.listen(of), name);
const got = (name) => page.evaluate((of) => window[`${of}_got`], name);
const publish = (...of) => page.evaluate(([name, data]) => window[name].publish({ data }), of);

test("a subscriber of /odom gets odometry with numbers in it", limit, async () => {
  await open("watcher");
  await make_topic("odom", "watcher", "/odom", "nav_msgs/Odometry");
  await listen("odom");
  const messages = await until("odometry", async () => {
    const all = await got("odom");
    return all.length > 20 && all;
  });
  const numbers = ({ pose: { pose: { position, orientation } }, twist: { twist } }) => [
    position.x, position.y, orientation.z, orientation.w, twist.linear.x, twist.angular.z,
  ];
  for (const message of messages) {
    for (const value of numbers(message)) assert.ok(Number.isFinite(value), JSON.stringify(message));
  }
  const places = new Set(messages.map((message) => message.pose.pose.position.x));
  assert.ok(places.size > 1, "the robot stands still");
  await page.evaluate(() => {
    window.odom.unsubscribe();
    window.watcher.close();
  });
});

test("what one page publishes reaches another and a plain client, until it unsubscribes", limit, async () => {
  await open("speaker");
  await open("listener");
  for (const [name, ros] of [["said", "speaker"], ["heard", "listener"]]) {
    await make_topic(name, ros, "/chatter", "std_msgs/String");
  }
  const plain = await rosbridge_client.connect(server.url);
  plain.send({ op: "subscribe", id: "p", topic: "/chatter", type: "std_msgs/String" });
  await listen("heard");
  await page.evaluate(() => window.said.advertise());

  // Said again and again, since a message may overtake the other connections' subscriptions.
  await until("both hear the speaker", async () => {
    await publish("said", "hello \u00e9\u{1f916}");
    return (await got("heard")).length > 0 && plain.published("/chatter").length > 0;
  });
  assert.deepEqual((await got("heard"))[0], { data: "hello \u00e9\u{1f916}" });
  assert.deepEqual(plain.published("/chatter")[0], { data: "hello \u00e9\u{1f916}" });

  // The listener's own message behind its unsubscribe shows, when it arrives, that the latter has been read.
  await page.evaluate(() => {
    window.heard.unsubscribe();
    window.heard.advertise();
  });
  await publish("heard", "gone");
  await plain.first("the listener's last message", ({ msg }) => msg?.data === "gone");
  const before = (await got("heard")).length;
  await publish("said", "late");
  await plain.first("what was said late", ({ msg }) => msg?.data === "late");
  assert.equal((await got("heard")).length, before);
  assert.deepEqual((await got("heard")).filter(({ data }) => data === "late"), []);
  plain.close();
});

test("roslib finds nothing to complain about", limit, async () => assert.deepEqual(page.faults, []));
