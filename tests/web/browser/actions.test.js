// SPDX-License-Identifier: Apache-2.0
// roslib 2.1.0's Action, unmodified, in Chromium: one page provides an action, and another, in a browser
// context of its own, sends it goals. Each test has connections of its own.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { browser, server } from "../support/demo.js";
import { roslib_page } from "../support/roslib_page.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
const actionType = "example_interfaces/action/Fibonacci";
let provider;
let asker;

before(async () => {
  [provider, asker] = [await roslib_page(browser, server.origin), await roslib_page(browser, server.origin)];
});

const connect = (page) => page.evaluate((url) => new Promise((done, failed) => {
  window.ros = new window.roslib.Ros({ url });
  window.ros.on("error", () => failed(new Error("roslib cannot connect")));
  window.ros.on("connection", () => done(true));
}), server.url);
const disconnect = (page) => page.evaluate(() => window.ros.close());

// The provider's page counts to `order`, says how far it is, and is done; of a negative one it has no end.
async function provide(name) {
  await connect(provider);
  await provider.evaluate(([action, type]) => {
    window.goals = [];
    window.cancelled = [];
    window.action = new window.roslib.Action({ ros: window.ros, name: action, actionType: type });
    window.action.advertise(({ order }, id) => {
      window.goals.push(id);
      const sequence = [];
      for (let i = 0; i < order; i++) {
        sequence.push(i);
        window.action.sendFeedback(id, { sequence });
      }
      if (order < 0) window.action.sendFeedback(id, { sequence: [order] });
      else if (order === 0) window.action.setFailed(id);
      else window.action.setSucceeded(id, { sequence });
    }, (id) => {
      window.cancelled.push(id);
      window.action.setCanceled(id, { sequence: [-1] });
    });
  }, [name, actionType]);
  await connect(asker);
  await until("the action is listed", () => asker.evaluate((action) => new Promise((done, failed) =>
    window.ros.getActionServers((all) => done(all.includes(action)), failed)), name));
}
// Sends a goal from the asker's page; what is said of it is kept there.
const send = (name, order) => asker.evaluate(([action, type, n]) => {
  window.goal = { feedback: [], result: null, failure: null };
  window.sent = new window.roslib.Action({ ros: window.ros, name: action, actionType: type });
  window.goal.id = window.sent.sendGoal({ order: n }, (result) => (window.goal.result = result),
    (feedback) => window.goal.feedback.push(feedback), (failure) => (window.goal.failure = String(failure)));
}, [name, actionType, order]);
const goal = () => asker.evaluate(() => window.goal);
const ended = () => until("the goal's end", async () => {
  const now = await goal();
  return (now.result || now.failure !== null) && now;
});

test("a page's goal has the feedback and the result of another page", limit, async () => {
  await provide("/count");
  await send("/count", 3);
  const { feedback, result, failure } = await ended();
  assert.equal(failure, null);
  assert.deepEqual(result, { sequence: [0, 1, 2] });
  assert.deepEqual(feedback.map(({ sequence }) => sequence), [[0], [0, 1], [0, 1, 2]]);
  await send("/count", 0);
  assert.match((await ended()).failure, /aborted/i);
  await disconnect(provider);
  await disconnect(asker);
});

test("a page takes its goal back", limit, async () => {
  await provide("/endless");
  await send("/endless", -1);
  await until("feedback", async () => (await goal()).feedback.length === 1);
  await asker.evaluate(() => window.sent.cancelGoal(window.goal.id));
  assert.match((await ended()).failure, /cancel/i);
  assert.deepEqual(...await provider.evaluate(() => [window.cancelled, window.goals]));
  await disconnect(provider);
  await disconnect(asker);
});

test("a page whose provider is closed hears the end of its goal", limit, async () => {
  await provide("/leaves");
  await send("/leaves", -1);
  await until("feedback", async () => (await goal()).feedback.length === 1);
  await disconnect(provider);
  assert.notEqual((await ended()).failure, "");
  await send("/leaves", 1);
  assert.match((await ended()).failure, /Action \/leaves does not exist/);
  await disconnect(asker);
});

test("a provider hears that the page which sent a goal is closed", limit, async () => {
  await provide("/unwanted");
  await send("/unwanted", -1);
  await until("feedback", async () => (await goal()).feedback.length === 1);
  await disconnect(asker);
  await until("it is taken back", () => provider.evaluate(() => window.cancelled.length === 1));
  await disconnect(provider);
});

test("roslib finds nothing to complain about", limit, () =>
  assert.deepEqual([...provider.faults, ...asker.faults], []));
