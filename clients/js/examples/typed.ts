// SPDX-License-Identifier: Apache-2.0
// In TypeScript, with the types of one robot: `rowe types ws://127.0.0.1:8080 > robot.ts`.

import { connect, robot_error } from "rowe";
import type { services, topics } from "./robot.js";

const robot = await connect<topics, services>("ws://127.0.0.1:8080").opened();

robot.subscribe("/odom", ({ pose }, odometry) => {
  console.log(pose.pose.position.x.toFixed(2), odometry.age_ms());
}, { hz: 10 });

try {
  const { speed } = await robot.call("/robot/set_speed", { speed: 0.5 }, { timeout_ms: 1000 });
  console.log(`the speed is ${speed} m/s now`);
} catch (error) {
  if (error instanceof robot_error) console.log(error.code, error.said);
}

const base = robot.drive("/cmd_vel", { name: "typed.ts" });
base.on("lost", ({ reason, driver }) => console.log(`does not drive any more: ${reason} ${driver ?? ""}`));
await base.take();
base.set({ linear: { x: 0.2, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } });
setTimeout(() => base.release().finally(() => robot.close()), 1000);
