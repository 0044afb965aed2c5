// SPDX-License-Identifier: Apache-2.0
// roslib 1.4.1, unmodified, in Node: the last of the line for ROS 1, which most pages still use. Its actions
// and its tf are topics; their servers are other clients, as with rosbridge.
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, test } from "node:test";
import { robot } from "../support/robot.js";
import { asked, limit, listening, server, with_statuses } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import ROSLIB from "roslib1";

// Its action servers say their status for ever, and would keep this process alive.
const set_interval = globalThis.setInterval;
globalThis.setInterval = (...how) => set_interval(...how).unref();
const open = [];

after(() => open.forEach((ros) => ros.close()));

async function connected() {
  const ros = with_statuses(new ROSLIB.Ros({ url: server.url }));
  await new Promise((done, failed) => {
    ros.on("connection", done);
    ros.on("error", failed);
  });
  open.push(ros);
  return ros;
}
const listening_to = (ros, name, messageType, more) =>
  listening(new ROSLIB.Topic({ ros, name, messageType, ...more }));

test("topics and services are listed, with their types", limit, async () => {
  const ros = await connected();
  const provider = new ROSLIB.Service({ ros, name: "/listed", serviceType: "std_srvs/SetBool" });
  provider.advertise(() => true);
  const { topics, types } = await until("the topics", async () => {
    const all = await asked((done, failed) => ros.getTopics(done, failed));
    return all.topics.includes("/odom") && all;
  });
  assert.equal(types[topics.indexOf("/odom")], "nav_msgs/Odometry");
  assert.equal(await asked((done, failed) => ros.getTopicType("/odom", done, failed)), "nav_msgs/Odometry");
  await until("the service is listed", async () =>
    (await asked((done, failed) => ros.getServices(done, failed))).includes("/listed"));
  const type = await asked((done, failed) => ros.getServiceType("/listed", done, failed));
  assert.equal(type, "std_srvs/SetBool");
  provider.unadvertise();
});

test("parameters are listed, read and set", limit, async () => {
  const ros = await connected();
  const names = await asked((done, failed) => ros.getParams(done, failed));
  assert.ok(names.includes("/robot/speed_max"), names);
  const speed_max = new ROSLIB.Param({ ros, name: "/robot/speed_max" });
  assert.equal(await asked((done, failed) => speed_max.get(done, failed)), 1);
  await asked((done, failed) => speed_max.set(0.5, done, failed));
  assert.equal(await asked((done, failed) => speed_max.get(done, failed)), 0.5);
  await assert.rejects(asked((done, failed) => speed_max.set(7, done, failed)), /from 0 to 1 is wanted/);
});

test("odometry comes, throttled as asked", limit, async () => {
  const ros = await connected();
  const every = listening_to(ros, "/odom", "nav_msgs/Odometry");
  const other = await connected();
  const rare = listening_to(other, "/odom", "nav_msgs/Odometry", { throttle_rate: 100, queue_length: 1 });
  await until("much odometry", () => every.got.length > 200 && rare.got.length > 1);
  assert.ok(rare.got.length * 3 < every.got.length, `${rare.got.length} of ${every.got.length}`);
  assert.equal(rare.got[0].child_frame_id, "base_link");
  every.unsubscribe();
  rare.unsubscribe();
});

test("one page provides a service, and another calls it", limit, async () => {
  const [provider, caller] = [await connected(), await connected()];
  const name = "/add_two_ints";
  const provided = new ROSLIB.Service({ ros: provider, name, serviceType: "rospy_tutorials/AddTwoInts" });
  provided.advertise(({ a, b }, response) => {
    response.sum = a + b;
    return a >= 0;
  });
  const service = new ROSLIB.Service({ ros: caller, name, serviceType: "rospy_tutorials/AddTwoInts" });
  const call = (a, b) => asked((done, failed) =>
    service.callService(new ROSLIB.ServiceRequest({ a, b }), done, failed));
  const answer = await until("it is provided", () => call(38, 4).catch(() => null));
  assert.equal(answer.sum, 42);
  await assert.rejects(call(-1, 2));
  provided.unadvertise();
  await until("nobody provides it any more",
    () => call(1, 2).then(() => false, (error) => /does not exist/.test(error.message)));
});

test("an action's goal has feedback and a result, and can be cancelled", limit, async () => {
  const [at_server, at_client] = [await connected(), await connected()];
  const actionName = "actionlib_tutorials/FibonacciAction";
  const action = new ROSLIB.SimpleActionServer({ ros: at_server, serverName: "/fibonacci", actionName });
  action.on("goal", ({ order }) => {
    action.sendFeedback({ sequence: [0, 1] });
    if (order > 0) action.setSucceeded({ sequence: Array.from({ length: order }, (_, i) => i) });
  });
  action.on("cancel", () => action.setPreempted());
  const client = new ROSLIB.ActionClient({ ros: at_client, serverName: "/fibonacci", actionName });
  // Its status topic says that the server is there.
  const heard = listening_to(at_client, "/fibonacci/status", "actionlib_msgs/GoalStatusArray");
  await until("the server's status", () => heard.got.length > 0);

  const goal = new ROSLIB.Goal({ actionClient: client, goalMessage: { order: 5 } });
  const feedback = [];
  goal.on("feedback", (one) => feedback.push(one));
  const done = once(goal, "result");
  goal.send();
  const [result] = await done;
  assert.deepEqual(result.sequence, [0, 1, 2, 3, 4]);
  assert.deepEqual(feedback, [{ sequence: [0, 1] }]);

  const endless = new ROSLIB.Goal({ actionClient: client, goalMessage: { order: 0 } });
  const begun = once(endless, "feedback");
  const ended = once(endless, "result");
  endless.send();
  await begun;
  // Goal.cancel() sends the id only, and the action server of a page reads the stamp as well: rosbridge,
  // which knows the type, fills it in. rowe hands a peer's message on as it is.
  client.cancelTopic.publish({ id: endless.goalID, stamp: { secs: 0, nsecs: 0 } });
  await ended;
  assert.equal(endless.status.status, 2); // preempted
  client.dispose();
});

test("a tf client hears transforms of a republisher that is a peer", limit, async () => {
  const [at_server, at_client] = [await connected(), await connected()];
  const actionName = "tf2_web_republisher/TFSubscriptionAction";
  const republisher = new ROSLIB.SimpleActionServer({
    ros: at_server, serverName: "/tf2_web_republisher", actionName,
  });
  const wanted = [];
  republisher.on("goal", (goal) => {
    wanted.push(goal);
    republisher.sendFeedback({
      transforms: goal.source_frames.map((child_frame_id) => ({
        header: { frame_id: goal.target_frame },
        child_frame_id,
        transform: { translation: { x: 1.5, y: -2, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } },
      })),
    });
  });
  republisher.on("cancel", () => republisher.setPreempted());
  const ready = listening_to(at_client, "/tf2_web_republisher/status", "actionlib_msgs/GoalStatusArray");
  await until("the republisher's status", () => ready.got.length > 0);
  const tf = new ROSLIB.TFClient({ ros: at_client, fixedFrame: "/map", rate: 10, angularThres: 0.01 });
  const got = [];
  tf.subscribe("base_link", (transform) => got.push(transform));
  await until("a transform", () => got.length > 0);
  assert.equal(got[0].translation.x, 1.5);
  assert.equal(got[0].rotation.w, 1);
  assert.equal(wanted[0].target_frame, "/map");
  tf.dispose();
});

test("a page that connects again has its subscriptions and advertisements again", limit, async () => {
  const mine = await robot.start();
  const ros = new ROSLIB.Ros({ url: mine.url });
  open.push(ros);
  ros.on("error", () => {});
  ros.on("close", () => setTimeout(() => ros.connect(mine.url), 50)); // as pages do
  const topic = listening_to(ros, "/odom", "nav_msgs/Odometry");
  const said = new ROSLIB.Topic({ ros, name: "/said", messageType: "std_msgs/String" });
  said.advertise();
  await until("odometry", () => topic.got.length > 10);
  for (let i = 0; i < 3; i++) {
    await mine.kill();
    topic.got.length = 0;
    await mine.restart();
    await until("odometry again", () => topic.got.length > 10);
  }
  await until("it is listed again", async () =>
    (await asked((done, failed) => ros.getTopics(done, failed))).topics.includes("/said"));
  ros.removeAllListeners("close");
  ros.close();
  await mine.kill();
});

test("roslib 1.4.1 is told of nothing that is wrong", limit, () => {
  assert.deepEqual(open.flatMap(({ statuses }) => statuses ?? []), []);
});
