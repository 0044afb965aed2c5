// SPDX-License-Identifier: Apache-2.0
// What roslib asks of a server about topics, services, nodes and types.
import assert from "node:assert/strict";
import { test } from "node:test";
import { limit, ros } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import { Service, Topic } from "roslib";

const asked = (method, ...rest) => new Promise((resolve, reject) => ros[method](...rest, resolve, reject));

test("nodes, and what they do", limit, async () => {
  new Topic({ ros, name: "/heard_by_a_page", messageType: "std_msgs/String" }).subscribe(() => {});
  let nodes = [];
  await until("the page's subscription is there", async () => {
    nodes = await asked("getNodes");
    const details = await Promise.all(nodes.map((node) => asked("getNodeDetails", node)));
    return details.some(({ subscribing }) => subscribing.includes("/heard_by_a_page")) &&
      details.some(({ publishing, services }) =>
        publishing.includes("/odom") && services.includes("/robot/set_speed"));
  });
  assert.equal(nodes.length, 2);
});

test("topics and services, by name and by type", limit, async () => {
  assert.ok((await asked("getTopics")).topics.includes("/odom"));
  assert.ok((await asked("getServices")).includes("/robot/set_speed"));
  assert.deepEqual(await asked("getTopicsForType", "nav_msgs/Odometry"), ["/odom"]);
  assert.deepEqual(await asked("getTopicsForType", "nav_msgs/msg/Odometry"), ["/odom"]);
  assert.deepEqual(await asked("getServicesForType", "none/None"), []);
  assert.equal(await asked("getTopicType", "/odom"), "nav_msgs/Odometry");
  assert.deepEqual(await asked("getActionServers"), []);
  assert.ok((await asked("getTopicsAndRawTypes")).topics.includes("/odom"));
});

test("a message's details are decoded to what a message looks like", limit, async () => {
  const details = await asked("getMessageDetails", "nav_msgs/Odometry");
  assert.equal(details[0].type, "nav_msgs/Odometry");
  const decoded = ros.decodeTypeDefs(details);
  assert.equal(decoded.child_frame_id, "string");
  assert.deepEqual(decoded.pose.pose.position, { x: "float64", y: "float64", z: "float64" });
  assert.deepEqual(decoded.pose.covariance, ["float64"]);
  assert.equal(details.find((one) => one.type === "geometry_msgs/PoseWithCovariance").fieldarraylen[1], 36);
});

test("the time is that of the robot's wall clock", limit, async () => {
  const service = new Service({ ros, name: "/rosapi/get_time", serviceType: "rosapi/GetTime" });
  const { time } = await new Promise((resolve, reject) => service.callService({}, resolve, reject));
  assert.ok(Math.abs(time.secs - Date.now() / 1000) < 60 && time.sec === time.secs);
});
