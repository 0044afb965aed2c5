// SPDX-License-Identifier: Apache-2.0
// The demo robot without its figure of eight, and what one sees of it from outside: whether it moves, and who
// drives.

import { rosbridge_client } from "./rosbridge.js";
import { robot } from "./robot.js";
import { until } from "./watchdog.js";

const still = 0.01;  // m/s

export class driven_robot extends robot {
  static async start(...how) {
    const made = new driven_robot();
    Object.assign(made, await robot.start("--demo", ...how));
    await made.watch();
    return made;
  }

  // To be called again when the robot has restarted.
  async watch() {
    this.watcher?.close();
    Object.assign(this, { speed: null, control: null });
    this.watcher = await rosbridge_client.connect(this.url);
    this.watcher.socket.on("message", (data) => {
      this.watcher.received = [];
      const { topic, msg } = JSON.parse(data);
      if (topic === "/odom") this.speed = msg.twist.twist.linear.x;
      if (topic === "/rowe/control/state") this.control = msg.topics[0];
    });
    this.watcher.send({ op: "subscribe", topic: "/odom", throttle_rate: 20 });
    this.watcher.send({ op: "subscribe", topic: "/rowe/control/state" });
    const args = { name: "/robot/autopilot", value: "false" };
    this.watcher.send({ op: "call_service", service: "/rosapi/set_param", args });
    await this.let_run();
    await this.stands();
  }

  get driver() { return this.control?.driver ?? null; }
  moves() { return until("it moves", () => Math.abs(this.speed) > 0.1); }
  stands() { return until("it stands still", () => this.speed !== null && Math.abs(this.speed) < still); }

  async end() {
    this.watcher.close();
    await this.kill();
  }
}
