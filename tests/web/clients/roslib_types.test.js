// SPDX-License-Identifier: Apache-2.0
// roslib's getMessageDetails and its like, of types that the demo robot has by schemas.
import assert from "node:assert/strict";
import { test } from "node:test";
import { limit, ros } from "../support/roslib.js";

test("a message's details are decoded to what a message looks like", limit, async () => {
  const details = await new Promise((resolve, reject) => {
    ros.getMessageDetails("nav_msgs/Odometry", resolve, reject);
  });
  assert.equal(details[0].type, "nav_msgs/Odometry");
  const decoded = ros.decodeTypeDefs(details);
  assert.equal(decoded.child_frame_id, "string");
  assert.deepEqual(decoded.pose.pose.position, { x: "float64", y: "float64", z: "float64" });
  assert.deepEqual(decoded.pose.covariance, ["float64"]);
  assert.equal(details.find((one) => one.type === "geometry_msgs/PoseWithCovariance").fieldarraylen[1], 36);
});

test("a type inside of a message has details, too", limit, async () => {
  const details = await new Promise((resolve, reject) => {
    ros.getMessageDetails("geometry_msgs/Twist", resolve, reject);
  });
  assert.deepEqual(details.map(({ type }) => type), ["geometry_msgs/Twist", "geometry_msgs/Vector3"]);
});

test("a type that nobody has is refused by its name", limit, () => assert.rejects(
  new Promise((resolve, reject) => ros.getMessageDetails("no/Such", resolve, reject)),
  (why) => String(why).includes("no/Such"),
));
