// SPDX-License-Identifier: Apache-2.0
// roslib 1.4.1, unmodified, in Chromium, as a script of the page: what most robots' pages are made with.
import assert from "node:assert/strict";
import { fileURLToPath } from "node:url";
import { before, test } from "node:test";
import { new_page } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { until } from "../support/watchdog.js";

const script = fileURLToPath(new URL("../node_modules/roslib1/build/roslib.min.js", import.meta.url));
let page;

before(async () => {
  page = await new_page(browser);
  const body = "<!doctype html><title>roslib 1</title>";
  await page.route(`${server.origin}/page`, (route) => route.fulfill({ contentType: "text/html", body }));
  await page.route(`${server.origin}/favicon.ico`, (route) => route.fulfill({ status: 204 }));
  await page.goto(`${server.origin}/page`);
  await page.addScriptTag({ path: script });
  await page.evaluate((url) => new Promise((done, failed) => {
    window.ros = new window.ROSLIB.Ros({ url });
    window.ros.on("connection", () => done());
    window.ros.on("error", () => failed(new Error("roslib cannot connect")));
  }), server.url);
});

test("a page shows odometry, and says where to go", limit, async () => {
  await page.evaluate(() => {
    const { ros } = window;
    window.odometry = [];
    window.chatter = [];
    new window.ROSLIB.Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry" })
      .subscribe(({ pose }) => window.odometry.push(pose.pose.position.x));
    window.topic = new window.ROSLIB.Topic({ ros, name: "/chatter", messageType: "std_msgs/String" });
    window.topic.subscribe(({ data }) => window.chatter.push(data));
  });
  await until("odometry", async () => (await page.evaluate(() => window.odometry.length)) > 20);
  assert.ok(await page.evaluate(() => window.odometry.every(Number.isFinite)));
  await until("it hears itself", async () => {
    await page.evaluate(() => window.topic.publish(new window.ROSLIB.Message({ data: "h\u00e9" })));
    return (await page.evaluate(() => window.chatter.length)) > 0;
  });
  assert.equal(await page.evaluate(() => window.chatter[0]), "h\u00e9");
});

test("roslib finds nothing to complain about", limit, async () => assert.deepEqual(page.faults, []));
