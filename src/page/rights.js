// SPDX-License-Identifier: Apache-2.0
// What this page's role may do. Nobody is shown a control that only says no.
//
// The robot tells no role its rights, so they are found out by asking, once per connection, in ways that do
// nothing: a reset of stop number -1, which there never is, and a guard without a name are refused in any
// case, and with "role" where the right is missing, which the robot looks at first. /rowe/control without an
// action answers who may call it. Whether one may publish on the driven topic, or take control over, is only
// seen when one tries: then the control goes, and the refusal stays.

const asked_for = {
  reset: ["/rowe/stop/reset", { number: -1, tick: 0 }],
  guard: ["/rowe/stop/guard", { guard: "", tick: 0 }],
};

export class rights {
  #robot;
  #topic = null;
  #has = new Map();  // by name: what is known

  constructor(robot) {
    this.#robot = robot;
    robot.on("open", () => this.#ask_all());
    robot.on("closed", () => this.#has.clear());
  }

  // Known to have it.
  has(right) { return this.#has.get(right) === true; }
  // Not known to lack it.
  may(right) { return this.#has.get(right) !== false; }

  lacks(right) { this.#has.set(right, false); }

  // The topic that can be driven, once one is known.
  drives(topic) {
    if (topic === this.#topic) return;
    this.#topic = topic;
    this.#ask_control();
  }

  #ask_all() {
    for (const right of Object.keys(asked_for)) {
      const [service, args] = asked_for[right];
      this.#ask(right, service, args);
    }
    this.#ask_control();
  }

  #ask_control() {
    if (this.#topic) this.#ask("drive", "/rowe/control", { topic: this.#topic });
  }

  async #ask(right, service, args) {
    try {
      const { refused } = await this.#robot.call(service, args);
      this.#has.set(right, refused !== "role");
    } catch ({ code }) {
      if (code === "refused") this.lacks(right);
    }
  }
}
