// SPDX-License-Identifier: Apache-2.0
// A clock and sockets of our own for the client: time passes when a test says so, and the robot says what a
// test says.

import { afterEach, beforeEach } from "node:test";

const real = { setTimeout, clearTimeout, setInterval, clearInterval, setImmediate };
const real_now = Date.now;
const real_performance = globalThis.performance;

// What was asked for by promises has happened when this has.
export const settled = () => new Promise((done) => real.setImmediate(done));

const performance_is = (value) =>
  Object.defineProperty(globalThis, "performance", { value, configurable: true, writable: true });

export class fake_clock {
  constructor() { Object.assign(this, { monotonic: 1000, calendar: 5e11, timers: new Map(), made: 0 }); }

  install() {
    performance_is({ now: () => this.monotonic });
    Date.now = () => this.calendar;
    const add = (fn, ms, every) => {
      this.timers.set((this.made += 1), { fn, at: this.monotonic + ms, every });
      return this.made;
    };
    globalThis.setTimeout = (fn, ms = 0) => add(fn, ms);
    globalThis.setInterval = (fn, ms) => add(fn, ms, ms);
    globalThis.clearTimeout = globalThis.clearInterval = (id) => this.timers.delete(id);
  }

  static remove() {
    Object.assign(globalThis, real);
    Date.now = real_now;
    performance_is(real_performance);
  }

  // Lets time pass, and each timer go off in its turn; promises settle between them.
  async pass(ms) {
    const end = this.monotonic + ms;
    for (;;) {
      await settled();
      const [id, timer] = [...this.timers].sort(([, a], [, b]) => a.at - b.at)[0] ?? [];
      if (!timer || timer.at > end) break;
      this.#move(timer.at);
      if (timer.every) timer.at += timer.every;
      else this.timers.delete(id);
      timer.fn();
    }
    this.#move(end);
    await settled();
  }

  // A phone that slept, a page that stood still: no timer went off meanwhile.
  skip(ms) {
    this.#move(this.monotonic + ms);
    for (const timer of this.timers.values()) timer.at = Math.max(timer.at, this.monotonic);
  }

  #move(to) {
    this.calendar += to - this.monotonic;
    this.monotonic = to;
  }
}

export class fake_socket {
  static made = [];
  static get last() { return fake_socket.made.at(-1); }

  sent = [];
  closed = false;
  bufferedAmount = 0;
  constructor(url, protocols) {
    Object.assign(this, { url, protocols });
    fake_socket.made.push(this);
  }
  send(text) { this.sent.push(JSON.parse(text)); }
  close() { this.closed = true; }

  open() { this.onopen?.(); }
  say(message) { this.onmessage?.({ data: JSON.stringify(message) }); }
  end(code = 1006, reason = "") { this.onclose?.({ code, reason }); }

  publish(topic, msg) { this.say({ op: "publish", topic, msg }); }
  of(op) { return this.sent.filter((each) => each.op === op); }
  calls(service) { return this.of("call_service").filter((each) => each.service === service); }
  published(topic) { return this.of("publish").filter((each) => each.topic === topic); }
  answer(call, values, result = true) {
    this.say({ op: "service_response", id: call.id, service: call.service, values, result });
    return settled();
  }
}

// For a file of tests: a clock and no sockets before each of them.
export function fakes() {
  const clock = new fake_clock();
  beforeEach(() => {
    Object.assign(clock, new fake_clock());
    clock.install();
    fake_socket.made = [];
  });
  afterEach(() => fake_clock.remove());
  return clock;
}
