// SPDX-License-Identifier: Apache-2.0
// roslib 2.1.0's Action, unmodified, in Chromium: one page provides an action, and another, in a browser
// context of its own, sends it goals. How goals are taken back and end with a peer: clients/roslib_actions.
import assert from "node:assert/strict";
import { before, test } from "node:test";
import { browser, server } from "../support/demo.js";
import { roslib_page } from "../support/roslib_page.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
const names = ["/count", "example_interfaces/action/Fibonacci"];
let provider;
let asker;

before(async () => {
  [provider, asker] = [await roslib_page(browser, server.origin), await roslib_page(browser, server.origin)];
  for (const page of [provider, asker]) {
    await page.evaluate((url) => new Promise((done, failed) => {
      window.ros = new window.roslib.Ros({ url });
      window.ros.on("error", () => failed(new Error("roslib cannot connect")));
      window.ros.on("connection", () => done(true));
    }), server.url);
  }
});

// Sends a goal from the asker's page, and waits for what becomes of it.
const sent = (order) => asker.evaluate(([[name, actionType], n]) => new Promise((done) => {
  const feedback = [];
  new window.roslib.Action({ ros: window.ros, name, actionType }).sendGoal({ order: n },
    (result) => done({ feedback, result }), (one) => feedback.push(one),
    (failure) => done({ feedback, failure: String(failure) }));
}), [names, order]);

test("a page's goal has the feedback and the result of another page", limit, async () => {
  await provider.evaluate(([name, actionType]) => {
    const action = new window.roslib.Action({ ros: window.ros, name, actionType });
    action.advertise(({ order }, id) => {
      const sequence = [];
      for (let i = 0; i < order; i++) {
        sequence.push(i);
        action.sendFeedback(id, { sequence });
      }
      if (order === 0) action.setFailed(id);
      else action.setSucceeded(id, { sequence });
    }, () => {});
  }, names);
  await until("the action is listed", () => asker.evaluate(([name]) => new Promise((done, failed) =>
    window.ros.getActionServers((all) => done(all.includes(name)), failed)), names));
  const { feedback, result } = await sent(3);
  assert.deepEqual(result, { sequence: [0, 1, 2] });
  assert.deepEqual(feedback.map(({ sequence }) => sequence), [[0], [0, 1], [0, 1, 2]]);
  assert.match((await sent(0)).failure, /aborted/i);
});

test("roslib finds nothing to complain about", limit, () =>
  assert.deepEqual([...provider.faults, ...asker.faults], []));
