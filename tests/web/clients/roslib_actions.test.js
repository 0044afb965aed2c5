// SPDX-License-Identifier: Apache-2.0
// roslib's Action in both roles: one page provides an action, another sends goals.
import assert from "node:assert/strict";
import { test } from "node:test";
import { another, asked, limit, ros } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import { Action } from "roslib";

const actionType = "example_interfaces/action/Fibonacci";

// Provides the action, and keeps the goals that came and those that were taken back.
function provided(by, name, execute) {
  const action = new Action({ ros: by, name, actionType });
  action.goals = [];
  action.cancelled = [];
  action.advertise(
    (args, id) => {
      action.goals.push(id);
      execute(action, args, id);
    },
    (id) => {
      action.cancelled.push(id);
      action.setCanceled(id, { sequence: [] });
    },
  );
  return action;
}
// Sends a goal; `end` is its result, or rejects.
function sent(by, name, args) {
  const goal = { feedback: [] };
  goal.end = new Promise((done, failed) => {
    const action = new Action({ ros: by, name, actionType });
    const heard = (one) => goal.feedback.push(one);
    goal.id = action.sendGoal(args, done, heard, (why) => failed(new Error(why)));
    goal.cancel = () => action.cancelGoal(goal.id);
  });
  goal.end.catch(() => {}); // it is looked at later
  return goal;
}
const is_there = (by, name) => until("the action is there", async () =>
  (await asked((...callbacks) => by.getActionServers(...callbacks))).includes(name));

test("a goal has feedback and a result", limit, async () => {
  const provider = await another();
  const action = provided(provider, "/count", (it, { order }, id) => {
    for (let i = 1; i <= 3; i++) it.sendFeedback(id, { sequence: Array(i).fill(order) });
    it.setSucceeded(id, { sequence: [0, 1, 1, 2, 3] });
  });
  await is_there(ros, "/count");
  const goal = sent(ros, "/count", { order: 5 });
  assert.deepEqual(await goal.end, { sequence: [0, 1, 1, 2, 3] });
  assert.deepEqual(goal.feedback.map(({ sequence }) => sequence), [[5], [5, 5], [5, 5, 5]]);
  action.unadvertise();
  await assert.rejects(sent(ros, "/count", {}).end, /Action \/count does not exist/);
  provider.close();
});

test("a goal that fails says how", limit, async () => {
  const provider = await another();
  provided(provider, "/fails", (it, _, id) => it.setFailed(id));
  await is_there(ros, "/fails");
  await assert.rejects(sent(ros, "/fails", {}).end, /aborted/i);
  provider.close();
});

test("a goal is taken back by who sent it, and by nobody else", limit, async () => {
  const [provider, other] = [await another(), await another()];
  const action = provided(provider, "/endless", (it, _, id) => it.sendFeedback(id, { sequence: [] }));
  await is_there(ros, "/endless");
  const goal = sent(ros, "/endless", {});
  await until("it has begun", () => goal.feedback.length === 1);
  new Action({ ros: other, name: "/endless", actionType }).cancelGoal(goal.id);
  const mine = sent(other, "/endless", {});
  await until("another has begun", () => mine.feedback.length === 1);
  assert.deepEqual(action.cancelled, []);
  goal.cancel();
  await assert.rejects(goal.end, /cancel/i);
  assert.deepEqual(action.cancelled, [action.goals[0]]);
  other.close(); // whoever leaves wants nothing any more
  await until("the other goal is taken back", () => action.cancelled.length === 2);
  assert.equal(action.cancelled[1], action.goals[1]);
  provider.close();
});

test("a goal ends when its provider leaves", limit, async () => {
  const provider = await another();
  provided(provider, "/leaves", () => provider.close());
  await is_there(ros, "/leaves");
  await assert.rejects(sent(ros, "/leaves", {}).end);
});
