// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.js";

const { heading_of, is_pose_type, pose_of } = await load("pose.js");

const yaw = (angle) => ({ x: 0, y: 0, z: Math.sin(angle / 2), w: Math.cos(angle / 2) });
const near = (value, wanted) => assert.ok(Math.abs(value - wanted) < 1e-9, `${value} is not ${wanted}`);

test("the heading of a quaternion is its rotation about z", () => {
  for (const angle of [-3, -1, 0, 0.5, 3]) near(heading_of(yaw(angle)), angle);
});

test("a pitch leaves the heading alone", () => {
  const [h, p] = [0.7, 0.3];  // heading, then pitch about the body's y axis
  const [ch, sh, cp, sp] = [Math.cos(h / 2), Math.sin(h / 2), Math.cos(p / 2), Math.sin(p / 2)];
  near(heading_of({ w: ch * cp, x: -sh * sp, y: ch * sp, z: sh * cp }), h);
});

test("nav_msgs/Odometry is read", () => {
  const pose = pose_of({
    pose: { pose: { position: { x: 1, y: -2, z: 0.5 }, orientation: yaw(1.2) } },
    twist: { twist: { linear: { x: 0.8, y: 0, z: 0 }, angular: { x: 0, y: 0, z: -0.4 } } },
  });
  near(pose.heading, 1.2);
  delete pose.heading;
  assert.deepEqual(pose, { x: 1, y: -2, z: 0.5, speed: 0.8, turn: -0.4 });
});

test("geometry_msgs/PoseStamped is read, its speeds unknown", () => {
  const pose = pose_of({ header: {}, pose: { position: { x: 1, y: 2, z: 3 }, orientation: yaw(-2) } });
  near(pose.heading, -2);
  assert.equal(pose.z, 3);
  assert.ok(Number.isNaN(pose.speed) && Number.isNaN(pose.turn));
});

test("a flat struct is read", () => {
  const pose = pose_of({ stamp: 12.5, x: 1, y: 2, heading: 0.1, speed: 0.9 });
  assert.deepEqual([pose.x, pose.y, pose.heading, pose.speed], [1, 2, 0.1, 0.9]);
  assert.ok(Number.isNaN(pose.z));
});

test("x and y under pose are read", () => {
  assert.equal(pose_of({ pose: { x: 1, y: 2, theta: 3 } }).heading, 3);
});

test("what holds no x and y is no pose", () => {
  const others = [
    null, 3, "x", [], {}, { x: 1 }, { x: "1", y: "2" }, { x: null, y: null }, { pose: null },
    { pose: { position: null } },
  ];
  for (const message of others) {
    assert.equal(pose_of(message), null, JSON.stringify(message));
  }
});

test("pose types are known in both spellings of ROS, and nothing else is", () => {
  for (const type of ["nav_msgs/Odometry", "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"]) {
    assert.ok(is_pose_type(type), type);
  }
  for (const type of ["", undefined, "std_msgs/String", "my_nav_msgs/Odometry", "nav_msgs/OdometryX"]) {
    assert.ok(!is_pose_type(type), type);
  }
});

test("a place that no robot reaches is no pose", () => {
  for (const x of [1e15, -1e8, Infinity, NaN]) assert.equal(pose_of({ x, y: 0 }), null, `${x}`);
  assert.equal(pose_of({ x: 1e6, y: -1e6 }).x, 1e6);
});
