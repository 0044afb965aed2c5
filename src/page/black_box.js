// SPDX-License-Identifier: Apache-2.0
// The key that has the robot's black boxes write what led here. It is shown where there is one, to who may.

import { element, write } from "./dom.js";
import { text } from "./text.js";

const service = "/rowe/record";

export class black_box {
  #robot;
  #rights;
  #there = false;

  constructor(robot, rights) {
    this.#robot = robot;
    this.#rights = rights;
    robot.on("open", () => write(element("black_box_says"), ""));
    element("keep").onclick = () => this.#keep();
  }

  // Whether there is one; a robot that is opened again may have another one.
  async ask() {
    if (!this.#rights.has("call", service)) return;
    try {
      const { black_boxes } = await this.#robot.call(service, { write: false });
      this.#there = black_boxes > 0;
    } catch {
      this.#there = false;  // a robot that knows none
    }
    this.show();
  }

  // Also when rights have become known.
  show() {
    element("keep").closest("section").hidden = !this.#there || !this.#rights.has("call", service);
  }

  async #keep() {
    const says = element("black_box_says");
    write(says, "");
    try {
      const { black_boxes } = await this.#robot.call(service, { cause: text.kept_by_page });
      write(says, black_boxes > 0 ? text.kept : text.not_kept);
    } catch (error) {
      write(says, String(error.said ?? error.message));
    }
  }
}
