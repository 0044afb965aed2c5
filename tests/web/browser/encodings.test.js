// SPDX-License-Identifier: Apache-2.0
// roslib 2.1.0, unmodified, in Chromium, with the `compression` that its topics can ask for: it decodes CBOR
// by cbor2, PNG by fast-png; and the browser itself draws the PNG, as roslib 1 reads it.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { browser, server } from "../support/demo.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { roslib_page } from "../support/roslib_page.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
let page;

before(async () => (page = await roslib_page(browser, server.origin)));

// What a topic's subscriber gets, said as JSON; typed arrays by their names. Each has its own connection:
// roslib gives what is still on its way when one unsubscribes to the topic's next subscriber.
const listen = (...what) => page.evaluate(([url, topic, messageType, how, key]) =>
  new Promise((done, failed) => {
    const ros = new window.roslib.Ros({ url });
    ros.on("error", () => failed(new Error("roslib cannot connect")));
    ros.on("connection", () => {
      window[key] = [];
      window[`${key}_ros`] = ros;
      new window.roslib.Topic({ ros, name: topic, messageType, compression: how })
        .subscribe((message) => window[key].push(message));
      done(true);
    });
  }), [server.url, ...what]);
const got = (key, count) => until(key, () => page.evaluate(([name, n]) => {
  if (window[name].length < n) return false;
  return window[name].map((one) => JSON.parse(JSON.stringify(one, (_, value) =>
    (ArrayBuffer.isView(value) ? { [value.constructor.name]: [...value].map(Number) }
      : typeof value === "bigint" ? `${value}n` : value))));
}, [key, count]));
const leave = (key) => page.evaluate((name) => window[`${name}_ros`].close(), key);

test("odometry in CBOR has typed arrays, and the same numbers as JSON", limit, async () => {
  await listen("/odom", "nav_msgs/Odometry", "cbor", "in_cbor");
  const all = await got("in_cbor", 20);
  await leave("in_cbor");
  for (const { header, pose, twist } of all) {
    assert.equal(typeof header.frame_id, "string");
    assert.ok(Number.isFinite(pose.pose.position.x) && Number.isFinite(twist.twist.angular.z));
    assert.equal(pose.covariance.Float64Array?.length, 36, JSON.stringify(pose));
  }
});

test("odometry in PNG is what JSON says", limit, async () => {
  await listen("/odom", "nav_msgs/Odometry", "png", "in_png");
  const all = await got("in_png", 10);
  await leave("in_png");
  for (const { pose } of all) {
    assert.ok(Number.isFinite(pose.pose.position.x));
    assert.equal(pose.covariance.length, 36);
  }
});

test("odometry as ROS 1 serialises it has its bytes and the time", limit, async () => {
  await listen("/odom", "nav_msgs/Odometry", "cbor-raw", "in_ros");
  const [first] = await got("in_ros", 5);
  await leave("in_ros");
  assert.ok(Math.abs(first.secs - Date.now() / 1000) < 60, `${first.secs} s`);
  assert.ok(first.nsecs >= 0 && first.nsecs < 1e9);
  const bytes = Uint8Array.from(first.bytes.Uint8Array);
  const view = new DataView(bytes.buffer);
  const text = (at) => new TextDecoder().decode(bytes.subarray(at + 4, at + 4 + view.getUint32(at, true)));
  const frame = text(12);
  const child = text(16 + frame.length);
  const at = 20 + frame.length + child.length;
  assert.equal(bytes.length, at + 85 * 8);
  assert.ok(frame.length > 0 && child.length > 0);
  const { x, w } = { x: view.getFloat64(at, true), w: view.getFloat64(at + 48, true) };
  assert.ok(Number.isFinite(x) && Math.abs(w) <= 1);
});

test("what another peer publishes keeps its digits in CBOR and in PNG", limit, async () => {
  await listen("/relayed", "test/Any", "cbor", "relayed_cbor");
  const plain = await rosbridge_client.connect(server.url);
  const raw = await rosbridge_client.connect(server.url);
  raw.send({ op: "subscribe", topic: "/relayed", compression: "png" });
  const many = [...Array(40).keys()];
  const said = { text: "ö \u{1d11e} \"/\"", deep: [[1, -2.5, null], true], many, tiny: 5e-324 };
  const again = setInterval(() => plain.send({ op: "publish", topic: "/relayed", msg: said }), 50);
  try {
    const [first] = await got("relayed_cbor", 1);
    assert.deepEqual(first, said);
    // As roslib 1 does: the browser draws it, and each byte of the pixels is a character.
    const { data } = await raw.first("a PNG", (message) => message.op === "png");
    const drawn = await page.evaluate((base64) => new Promise((done) => {
      const image = new Image();
      image.onload = () => {
        const canvas = document.createElement("canvas");
        const context = canvas.getContext("2d");
        canvas.width = image.width;
        canvas.height = image.height;
        context.imageSmoothingEnabled = false;
        context.drawImage(image, 0, 0);
        const pixels = context.getImageData(0, 0, image.width, image.height).data;
        let text = "";
        for (let i = 0; i < pixels.length; i += 4) text += String.fromCharCode(...pixels.slice(i, i + 3));
        done(text);
      };
      image.src = `data:image/png;base64,${base64}`;
    }), data);
    assert.deepEqual(JSON.parse(drawn), { op: "publish", topic: "/relayed", msg: said });
  } finally {
    clearInterval(again);
    plain.close();
    raw.close();
    await leave("relayed_cbor");
  }
});
