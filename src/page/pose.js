// SPDX-License-Identifier: Apache-2.0
// Reads a pose out of the messages that robots publish. Pure functions.
//
// Three shapes are known: nav_msgs/Odometry (pose.pose, twist.twist), geometry_msgs/PoseStamped (pose), and a
// flat object such as {stamp, x, y, heading, speed}, at the top or under `pose`. Lengths in metres, angles in
// radians, counter-clockwise from x. What a message does not say is NaN; so is null, which is how JSON
// carries NaN.

const number = (value) => (typeof value === "number" ? value : NaN);

// The first of `values` that is a number.
const first = (...values) => number(values.find((value) => typeof value === "number"));

// Heading of a quaternion: the angle of the body's x axis seen from above.
export function heading_of(quaternion) {
  const [x, y, z, w] = ["x", "y", "z", "w"].map((name) => number(quaternion[name]));
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

// What no robot reaches, in metres: an estimate that has gone astray.
export const far = 1e7;
const is_near = (value) => typeof value === "number" && Math.abs(value) <= far;
export const is_place = (x, y) => is_near(x) && is_near(y);

// {x, y, z, heading, speed, turn}, or null when the message holds no x and y, or places that nobody reaches.
export function pose_of(message) {
  if (message === null || typeof message !== "object") return null;
  const body = message.pose?.pose ?? message.pose ?? message;
  const place = body.position ?? body;
  if (!is_place(place?.x, place?.y)) return null;
  const twist = message.twist?.twist ?? message.twist;
  return {
    x: place.x,
    y: place.y,
    z: number(place.z),
    heading: body.orientation ? heading_of(body.orientation) : first(body.heading, body.theta, body.yaw),
    speed: first(twist?.linear?.x, message.speed, message.linear_velocity),
    turn: first(twist?.angular?.z, message.turn_rate, message.omega, message.angular_velocity),
  };
}

// The types whose topics hold poses without our having to look, in ROS 1 and ROS 2 spelling.
const odometry = /^nav_msgs\/(msg\/)?Odometry$/;
const pose = /^geometry_msgs\/(msg\/)?Pose(2D|Stamped|WithCovarianceStamped)?$/;
export const is_odometry = (type) => odometry.test(type);
export const is_pose_type = (type) => is_odometry(type) || pose.test(type);
