// SPDX-License-Identifier: Apache-2.0
// Services and roslib 2.1.0, unmodified, in Chromium: a page that asks, a page that answers, and what is left
// of it all when the robot has been away.
import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import { close_pages } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { rowe, until_connected } from "../support/program.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { roslib_page } from "../support/roslib_page.js";
import { until } from "../support/watchdog.js";

afterEach(() => close_pages(browser));

// A page connected to the robot, with `frames`: all that went over its sockets, {sent} or {received}.
async function connected_page() {
  const page = await roslib_page(browser, server.origin);
  page.frames = [];
  page.on("websocket", (socket) => {
    const keep = (way) => ({ payload }) => page.frames.push({ [way]: JSON.parse(payload) });
    socket.on("framesent", keep("sent"));
    socket.on("framereceived", keep("received"));
  });
  await page.evaluate((url) => new Promise((done, failed) => {
    const ros = new window.roslib.Ros({ url });
    window.ros = ros;
    window.call = (name, args) => new Promise((answered) => {
      const service = new window.roslib.Service({ ros, name, serviceType: "demo/Any" });
      service.callService(args, (values) => answered({ values }), (failure) => answered({ failure }));
    });
    ros.on("connection", done);
    ros.on("error", () => failed(new Error("roslib cannot connect")));
  }).then(() => true), server.url);
  return page;
}

const call = (page, ...of) => page.evaluate((args) => window.call(...args), of);

// The page provides `name`: {"a","b"} gives {"sum"}, and with a member "no" it fails, "never" it is silent.
const provide = (page, name) => page.evaluate((of) => {
  window.answers = (request) => {
    if (request.never) return new Promise(() => {});
    if (request.no) throw new Error("the page says no");
    return { sum: request.a + request.b };
  };
  window.mine = new window.roslib.Service({ ros: window.ros, name: of, serviceType: "demo/Add" });
  return window.mine.advertiseAsync(window.answers);
}, name);
const provided = (name) => until(`${name} is provided`, async () => {
  const { code } = await rowe("call", server.url, name, '{"a":0,"b":0}');
  return code === 0;
});

test("a page calls the robot's service", limit, async () => {
  const page = await connected_page();
  assert.deepEqual(await call(page, "/robot/set_speed", { speed: 0.5 }), { values: { speed: 0.5 } });
  assert.deepEqual(await call(page, "robot/set_speed", { speed: 0.25 }), { values: { speed: 0.25 } });
  assert.deepEqual(await call(page, "/robot/set_speed", { speed: 5 }),
    { failure: "the speed is out of range: 0 to 1 m/s" });
  const { failure } = await call(page, "/robot/set_speed", { speed: "fast" });
  assert.match(failure, /"speed" must be a number/);
  assert.deepEqual(await call(page, "/nobody/home", {}),
    { failure: "Service /nobody/home does not exist" });
  assert.deepEqual(page.faults, []);
});

test("what one page provides is called by a program, another page and a plain client", limit, async () => {
  const page = await connected_page();
  const other = await connected_page();
  const plain = await rosbridge_client.connect(server.url);
  await provide(page, "/page/add");
  await provided("/page/add");

  const said = await rowe("call", server.url, "/page/add", '{"a":38,"b":4}');
  assert.deepEqual([said.code, said.stdout], [0, '{"sum":42}\n'], said.stderr);
  const sum = await rowe("call", server.url, "/page/add", '{"a":38,"b":5}', "--plain");
  assert.deepEqual([sum.code, JSON.parse(sum.stdout)], [0, { sum: 43 }], sum.stderr);
  assert.deepEqual(await call(other, "/page/add", { a: 1, b: 2 }), { values: { sum: 3 } });
  plain.send({ op: "call_service", id: 7, service: "/page/add", args: { a: 1, b: 1 } });
  const answer = await plain.first("the answer", ({ id }) => id === 7);
  assert.deepEqual(answer,
    { op: "service_response", id: 7, service: "/page/add", result: true, values: { sum: 2 } });

  assert.match((await call(other, "/page/add", { no: true })).failure, /the page says no/);
  const refused = await rowe("call", server.url, "/page/add", '{"no":true}');
  assert.equal(refused.code, 1);
  assert.match(refused.stderr, /the page says no/);
  const silent = await until_connected(
    (time) => rowe("call", server.url, "/page/add", '{"never":true}', "--timeout", time));
  assert.equal(silent.code, 4);

  // Each call was asked once, and none of them by another name.
  const asked = page.frames.map(({ received }) => received).filter((each) => each?.op === "call_service");
  assert.equal(new Set(asked.map(({ id }) => id)).size, asked.length);
  assert.deepEqual([...new Set(asked.map(({ service }) => service))], ["/page/add"]);
  assert.deepEqual([...page.faults, ...other.faults], []);
  plain.close();
});

// roslib does not connect again by itself: pages do, and it then sends what its topics had asked for, and
// whatever was said in between. Services it does not advertise again: pages do that as well.
test("everything works again when the robot was away, and nothing is answered twice", limit, async () => {
  const page = await connected_page();
  await provide(page, "/page/again");
  await provided("/page/again");
  await page.evaluate((url) => {
    const { ros } = window;
    window.losses = 0;
    ros.on("close", () => {
      window.losses += 1;
      setTimeout(() => ros.connect(url), 100);
    });
    ros.on("connection", () => window.mine.advertiseAsync(window.answers));
    ros.on("error", () => {});  // nobody listens yet
    const odom = new window.roslib.Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry" });
    window.odometry = 0;
    odom.subscribe(() => (window.odometry += 1));
  }, server.url);
  const odometry = () => page.evaluate(() => window.odometry);
  await until("odometry", async () => (await odometry()) > 10);

  await server.pause();  // so that it is asked and does not answer
  await page.evaluate(() => {
    window.ends = { lost: [], offline: [] };
    window.call("/robot/set_speed", { speed: 0.125 }).then((end) => window.ends.lost.push(end));
  });
  await until("the call has left the page", () =>
    page.frames.some(({ sent }) => sent?.op === "call_service" && sent.args.speed === 0.125));
  await server.kill();
  await until("the page has noticed", () => page.evaluate(() => window.losses > 0));
  await page.evaluate(() => {
    window.call("/robot/set_speed", { speed: 0.375 }).then((end) => window.ends.offline.push(end));
  });
  const seen = await odometry();
  await server.restart();
  await until("odometry again", async () => (await odometry()) > seen + 10);
  await provided("/page/again");
  const answer = await rowe("call", server.url, "/page/again", '{"a":38,"b":4}');
  assert.deepEqual([answer.code, answer.stdout], [0, '{"sum":42}\n'], answer.stderr);
  await until("what was asked in between is answered",
    () => page.evaluate(() => window.ends.offline.length > 0));

  // A call behind them shows that all answers are here.
  assert.deepEqual(await call(page, "/robot/set_speed", { speed: 0.5 }), { values: { speed: 0.5 } });
  const { lost, offline } = await page.evaluate(() => window.ends);
  // A robot can be reached a moment before it provides its services.
  const early = { failure: "Service /robot/set_speed does not exist" };
  assert.deepEqual(offline, [offline[0].failure ? early : { values: { speed: 0.375 } }]);
  assert.deepEqual(lost, []);  // roslib neither says it again nor ends it
  const times = (way, wanted) => page.frames.map((each) => each[way]).filter((m) => m && wanted(m)).length;
  const asked = (speed) => (m) => m.op === "call_service" && m.args.speed === speed;
  assert.deepEqual([0.125, 0.375].map((speed) => times("sent", asked(speed))), [1, 1]);
  const id_of = (speed) => page.frames.find(({ sent }) => sent && asked(speed)(sent)).sent.id;
  const answered = (speed) => (m) => m.op === "service_response" && m.id === id_of(speed);
  assert.deepEqual([0.125, 0.375].map((speed) => times("received", answered(speed))), [0, 1]);
  const subscribed = page.frames.filter(({ sent }) => sent?.op === "subscribe").length;
  assert.equal(subscribed, 2);
});
