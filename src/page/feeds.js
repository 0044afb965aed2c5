// SPDX-License-Identifier: Apache-2.0
// What the page asks the robot for. All of it is thinned at the robot, to what a person can see; what is not
// seen is not asked for, and a hidden page asks for nothing but the state of the stop, which the client
// keeps.

import { moment, since_ms } from "../../clients/js/src/link.js";

const usual = { queue_length: 1 };  // the newest value, never a row of old ones

class feed {
  #owner;
  #of = null;
  #asked = null;

  constructor(owner, topic, fn, hz, ways) {
    this.#owner = owner;
    Object.assign(this, { topic, fn, hz, ways });
  }

  get period_ms() { return 1000 / this.hz; }
  // Since the last value; without any, on this connection or since the page is seen, it is infinite.
  get age_ms() { return this.#of?.age_ms() ?? Infinity; }
  // Whether the last value is of this connection, and not older than `ms_max`.
  fresh(ms_max = 3 * this.period_ms) { return this.#of?.fresh(ms_max) ?? false; }
  // Since it was asked for, at this rate.
  get asked_ms() { return this.#asked ? since_ms(this.#asked) : 0; }
  get refused() { return this.#of?.refused ?? null; }

  // Another rate, from now on; 0: nothing.
  at(hz) {
    if (hz === this.hz) return;
    this.hz = hz;
    this.pause();
    this.#owner.start(this);
  }

  start(robot) {
    if (this.#of || !this.hz) return;
    const { hz, topic, fn, ways } = this;
    this.#asked = moment();
    this.#of = robot.subscribe(topic, (msg) => fn(msg, this), { hz, ...usual, ...ways });
  }

  pause() {
    this.#of?.unsubscribe();
    this.#of = null;
  }

  end() {
    this.pause();
    this.#owner.forget(this);
  }
}

export class feeds {
  #robot;
  #all = new Set();

  // `page` as document.
  constructor(robot, page) {
    this.#robot = robot;
    this.page = page;
    page.addEventListener("visibilitychange", () => this.#look());
  }

  // Calls fn(message, feed) at most `hz` times a second, until end(). `ways`: more of the client's options.
  want(topic, fn, hz, ways = {}) {
    const made = new feed(this, topic, fn, hz, ways);
    this.#all.add(made);
    this.start(made);
    return made;
  }

  start(one) {
    if (!this.page.hidden) one.start(this.#robot);
  }

  forget(one) { this.#all.delete(one); }

  #look() {
    for (const one of this.#all) this.page.hidden ? one.pause() : one.start(this.#robot);
  }
}
