// SPDX-License-Identifier: Apache-2.0
// Clients that can show no token, in Chromium: roslib as npm has it, and a WebSocket as other libraries open
// it. The robot's log-in gives the browser a cookie, and a token may be allowed in the URL.
import assert from "node:assert/strict";
import { after, afterEach, before, test } from "node:test";
import { artefact, close_pages, phone, start_browser } from "../support/browser.js";
import { load_roslib } from "../support/roslib_page.js";
import { set_up_robot } from "../support/set_up.js";
import { until, watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 180000 };
let browser, robot, url_token;

before(async () => {
  browser = await start_browser();
  robot = await set_up_robot.start();
  robot.ask_for_certificates();
  url_token = robot.token("screen", "observer", "--in-url");
  await robot.serve();
});
after(async () => {
  await browser?.close();
  robot?.end();
});
afterEach(() => close_pages(browser));

async function new_page() {
  const context = await browser.newContext({
    viewport: phone, ignoreHTTPSErrors: true, permissions: ["local-network-access"],
  });
  context.setDefaultTimeout(watchdog_ms);
  const page = await context.newPage();
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(String(error)));
  await page.goto(`${robot.origin}/healthz`); // the browser takes the certificate
  return page;
}

async function log_in(page, token) {
  await page.goto(`${robot.origin}/rowe/login`);
  await page.fill("input[name=token]", token);
  await page.click("form[action='/rowe/login'] button");
}

// How roslib ends up: "connection" or "error", and how much odometry it hears.
const odometry_of = (page, url) => page.evaluate((to) => new Promise((done) => {
  const ros = new window.roslib.Ros({ url: to });
  ros.on("error", () => done("error"));
  ros.on("connection", () => {
    const topic = new window.roslib.Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry" });
    topic.subscribe((message) => done(typeof message.pose.pose.position.x));
  });
}), url);

// A WebSocket that shows nothing but what the browser shows by itself.
const opens = (page, ...how) => page.evaluate((args) => new Promise((done) => {
  window.socket = new WebSocket(...args);
  window.socket.onclose = ({ code, reason }) => (window.ended = `${code} ${reason}`);
  window.socket.onopen = () => done(true);
  window.socket.onerror = () => done(false);
}), how);

test("after the log-in, roslib connects as it is", limit, async () => {
  const page = await new_page();
  await load_roslib(page, robot.origin);
  assert.equal(await odometry_of(page, robot.url), "error");
  await until("that is why",
    () => robot.server.stderr.includes("this endpoint needs a token"));
  await log_in(page, robot.tokens.driver);
  await page.waitForURL(`${robot.origin}/`);
  await load_roslib(page, robot.origin);
  assert.equal(await odometry_of(page, robot.url), "number");
  assert.equal(await page.evaluate(() => document.cookie), "", "no script sees the token");
  const [cookie] = await page.context().cookies();
  assert.equal(cookie.name, `__Host-rowe-${robot.port}`);
  const { httpOnly, secure, sameSite, path } = cookie;
  assert.deepEqual([httpOnly, secure, sameSite, path], [true, true, "Strict", "/"]);
  assert.deepEqual(page.faults, []);
});

test("after the log-in, the robot's own page asks for no token", limit, async () => {
  const page = await new_page();
  await log_in(page, robot.tokens.driver);
  await page.waitForFunction(() => document.body.dataset.state === "live");
  assert.equal(await page.evaluate(() => document.getElementById("who").hidden), true);
});

test("after the log-in, a library's WebSocket opens, with a subprotocol or without", limit, async () => {
  const page = await new_page();
  assert.equal(await opens(page, robot.url), false);
  await log_in(page, robot.tokens.observer);
  await page.waitForURL(`${robot.origin}/`);
  await page.goto(`${robot.origin}/healthz`);
  assert.equal(await opens(page, robot.url), true);
  assert.equal(await opens(page, robot.url, ["other.v1", "rowe.v1"]), true);
  await page.goto(`${robot.origin}/rowe/login`);
  await page.screenshot({ path: artefact("login.png") });
  await page.click("form[action='/rowe/logout'] button");
  await page.waitForURL(`${robot.origin}/rowe/login`);
  await until("the cookie is gone", async () => (await page.context().cookies()).length === 0);
  await page.goto(`${robot.origin}/healthz`);
  assert.equal(await opens(page, robot.url), false);
});

test("a wrong token gives no cookie, and is said", limit, async () => {
  const page = await new_page();
  await log_in(page, "x".repeat(43));
  await page.waitForFunction(() => document.body.textContent.includes("this token is not known here"));
  assert.deepEqual(await page.context().cookies(), []);
  await page.screenshot({ path: artefact("login_wrong.png") });
  await page.click("a");
  await page.waitForSelector("input[name=token]");
});

test("a page from elsewhere has nothing of the cookie", limit, async () => {
  const page = await new_page();
  await log_in(page, robot.tokens.driver);
  await page.waitForURL(`${robot.origin}/`);
  const elsewhere = "https://elsewhere.example";
  await page.route(`${elsewhere}/`, (route) => route.fulfill({
    contentType: "text/html",
    body: `<form action="${robot.origin}/rowe/logout" method="post"><button>go</button></form>`,
  }));
  await page.goto(`${elsewhere}/`);
  assert.equal(await opens(page, robot.url), false);
  await page.click("button");
  await page.waitForFunction(() => document.body.textContent.includes("is not allowed here"));
  assert.equal((await page.context().cookies(robot.origin)).length, 1, "nobody else logs one out");
});

test("a cookie ends with its token, and so do its connections", limit, async () => {
  const page = await new_page();
  const token = robot.token("guest", "observer");
  await until("the token holds", async () => {
    await log_in(page, token);
    return (await page.context().cookies()).length === 1;
  });
  assert.equal(await opens(page, robot.url), true);
  robot.remove("guest");
  await until("the connection ends", () => page.evaluate(() => window.ended));
  assert.equal(await page.evaluate(() => window.ended), "1008 token revoked");
  assert.equal(await opens(page, robot.url), false);
});

test("roslib connects by a token that may stand in the URL, and by no other", limit, async () => {
  const page = await new_page();
  await load_roslib(page, robot.origin);
  assert.equal(await odometry_of(page, `${robot.url}?token=${url_token}`), "number");
  assert.equal(await odometry_of(page, `${robot.url}?token=${robot.tokens.driver}`), "error");
});
