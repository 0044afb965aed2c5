// SPDX-License-Identifier: Apache-2.0
// What this page's role may do, as the robot says by /rowe/rights. Nobody is shown a control that only says
// no. Whatever part of the page wants to know of a right is asked for from then on, on each connection.

const asked_max = 64;  // in one call
const again_ms = 1000;

const key_of = (right, name) => (name === undefined ? right : `${right} ${name}`);

export class rights {
  #robot;
  #wanted = new Map();  // key → {right, name}
  #known = new Map();   // key → whether it is allowed
  #unasked = [];
  changed = () => {};

  constructor(robot) {
    this.#robot = robot;
    robot.on("open", () => {
      this.#known.clear();
      this.#unasked = [...this.#wanted.keys()];
      this.#ask();
    });
    robot.on("closed", () => this.#known.clear());
  }

  // Known to have it. `right` and `name` as in /rowe/rights.
  has(right, name) {
    const key = key_of(right, name);
    if (!this.#wanted.has(key)) {
      this.#wanted.set(key, { right, name });
      this.#unasked.push(key);
      queueMicrotask(() => this.#ask());
    }
    return this.#known.get(key) === true;
  }

  // It was refused.
  lacks(right, name) { this.#known.set(key_of(right, name), false); }

  async #ask() {
    while (this.#robot.state === "open" && this.#unasked.length > 0) {
      const keys = this.#unasked.splice(0, asked_max);
      const asked = keys.map((key) => this.#wanted.get(key));
      try {
        const { allowed } = await this.#robot.call("/rowe/rights", { asked });
        keys.forEach((key, at) => this.#known.set(key, allowed?.[at] === true));
      } catch ({ code }) {
        if (code === "closed" || code === "lost") return;  // the next connection asks for all
        this.#unasked.unshift(...keys);
        setTimeout(() => this.#ask(), again_ms);
        return;
      }
    }
    this.changed();
  }
}
