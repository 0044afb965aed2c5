// SPDX-License-Identifier: Apache-2.0
// In Node: prints a pose twice a second with its age, until Ctrl-C.
//
//     node watch.js ws://127.0.0.1:8080

import { connect } from "rowe";

// Node 22 has a WebSocket; for Node 18 to 21 it comes from `npm install ws`.
const WebSocket = globalThis.WebSocket ?? (await import("ws")).WebSocket;
const robot = connect(process.argv[2] ?? "ws://127.0.0.1:8080", { WebSocket, name: "watch" });
robot.on("open", () => console.log("connected"));
robot.on("closed", ({ code, reason }) => console.log(`not connected: ${code} ${reason}`));

const odometry = robot.subscribe("/odom", () => {}, { hz: 30 });
const timer = setInterval(() => {
  const { x, y } = odometry.last?.pose.pose.position ?? {};
  const age = Math.round(odometry.age_ms());
  if (x !== undefined) console.log(`x ${x.toFixed(2)}, y ${y.toFixed(2)}, ${age} ms old`);
}, 500);

process.on("SIGINT", () => {
  clearInterval(timer);
  robot.close();
});
