// SPDX-License-Identifier: Apache-2.0
// What the page asks for: of the robot, or of a recording that stands in its place. All of it is thinned
// there, to what a person can see; what is not seen is not asked for, and a hidden page asks for nothing but
// the state of the stop, which the client keeps.
//
// A source has subscribe(topic, fn, options), which gives {unsubscribe, age_ms(), fresh(ms_max), refused:
// words or null, at_ms: of the last value}; now_ms, the time up to which it shows; and clock_ms(at_ms), what
// the robot's clock shows then.

import { moment, since_ms } from "../../clients/js/src/link.js";
import { text } from "./text.js";

const usual = { queue_length: 1 };  // the newest value, never a row of old ones

// The robot itself, now. `time` as robot_clock.
export class live_source {
  #robot;
  #time;

  constructor(robot, time) {
    this.#robot = robot;
    this.#time = time;
  }

  // By the time here, which does not jump when the robot's becomes known.
  get now_ms() { return Date.now(); }
  clock_ms(at_ms) { return this.#time.at(at_ms); }

  subscribe(topic, fn, options) {
    let at_ms = null;
    const of = this.#robot.subscribe(topic, (msg) => {
      at_ms = Date.now();
      fn(msg);
    }, options);
    return {
      unsubscribe: () => of.unsubscribe(),
      age_ms: () => of.age_ms(),
      fresh: (ms_max) => of.fresh(ms_max),
      get refused() { return of.refused && text.says(of.refused); },
      get at_ms() { return at_ms; },
    };
  }
}

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
  // Why nothing comes, in words.
  get refused() { return this.#of?.refused ?? null; }
  // When the last value was said, by the time of the source.
  get at_ms() { return this.#of?.at_ms ?? this.#owner.now_ms; }

  // Another rate, from now on; 0: nothing.
  at(hz) {
    if (hz === this.hz) return;
    this.hz = hz;
    this.pause();
    this.#owner.start(this);
  }

  start(source) {
    if (this.#of || !this.hz) return;
    const { hz, topic, fn, ways } = this;
    this.#asked = moment();
    this.#of = source.subscribe(topic, (msg) => fn(msg, this), { hz, ...usual, ...ways });
  }

  // What a source has of the time before is wanted anew.
  again() {
    this.pause();
    this.jumped();
    this.#owner.start(this);
  }

  // What comes does not go on from what came.
  jumped() { this.ways.jumped?.(); }

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
  #source;
  #all = new Set();

  // `page` as document.
  constructor(source, page) {
    this.#source = source;
    this.page = page;
    page.addEventListener("visibilitychange", () => this.#look());
  }

  get now_ms() { return this.#source.now_ms; }
  // Whether it gives what came before, too.
  get knows_past() { return this.#source.knows_past ?? false; }
  clock_ms(at_ms) { return this.#source.clock_ms(at_ms); }

  // All that is wanted comes from another source from now on.
  from(source) {
    for (const one of this.#all) one.pause();
    this.#source = source;
    for (const one of [...this.#all]) {
      one.jumped();
      if (this.#all.has(one)) this.start(one);
    }
  }

  // Calls fn(message, feed) at most `hz` times a second, until end(). `ways`: more of the client's options;
  // `past_ms`: so much of what came before is wanted as well, where it is known; jumped() is called when what
  // comes does not go on from what came.
  want(topic, fn, hz, ways = {}) {
    const made = new feed(this, topic, fn, hz, ways);
    this.#all.add(made);
    this.start(made);
    return made;
  }

  start(one) {
    if (!this.page.hidden) one.start(this.#source);
  }

  forget(one) { this.#all.delete(one); }

  #look() {
    for (const one of this.#all) this.page.hidden ? one.pause() : one.start(this.#source);
  }
}
