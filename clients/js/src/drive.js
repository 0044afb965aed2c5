// SPDX-License-Identifier: Apache-2.0
// Driving one topic whose commands have a lease: at most one peer drives it at a time.
//
// A command holds only as long as somebody holds it: it is repeated twenty times a second, each time with the
// newest tick, by which the robot knows how old it is. One that lapsed does not come back by itself, whatever
// kept it: a stop, a page that stood still, a network that did. Control itself is kept by a heartbeat and
// lost with the connection; then nothing drives until a person has taken it anew.

import { moment, since_ms } from "./link.js";
import { ask } from "./stop.js";
import { emitter, robot_error } from "./wire.js";

const service = "/rowe/control";
const repeat_ms = 50;
const change_ms = 20;            // another command goes at once, but not more often than this
const beat_ms = 500;
const state_hz = 40;             // it comes twenty times a second, and whenever who drives changes
const tick_ms_max = 1000;        // one that is older is not sent with a request: the answer has a new one
const waiting_bytes_max = 1024;  // a command that would wait behind more is left out: the next one is newer

// The same message with every number 0. Numbers that are none are refused: JSON would make null of them,
// which a robot reads as NaN.
function zero_of(value, path) {
  if (typeof value === "boolean") return false;
  if (typeof value === "number") {
    if (Number.isFinite(value)) return 0;
    throw new TypeError(`${path} is ${value}: a command needs finite numbers`);
  }
  if (Array.isArray(value)) return value.map((each, at) => zero_of(each, `${path}[${at}]`));
  if (!value || typeof value !== "object") return value;
  const members = Object.entries(value);
  return Object.fromEntries(members.map(([name, each]) => [name, zero_of(each, `${path}.${name}`)]));
}

export class drive extends emitter {
  #robot;
  #args;
  #offs;
  #zero;
  #command = null;
  #alive;           // when that was set or sent last
  #number;          // of the stop, when it was set
  #sent = moment();
  #tick;            // the newest,
  #tick_came;       // and when it came
  #beaten;          // when control was asked for last
  #proven;          // when that request was sent to which the robot said yes last
  #proven_tick;     // of its answer
  #number_held;     // of this client's control: each driver has another one
  #asked = 0;       // counts requests and ends, so that an answer that comes after the end is known as such
  #asking = 0;      // requests without an answer yet
  held = false;     // this client drives
  driver = null;    // who does, by the name that the robot shows to all
  lease_ms = null;
  hold_ms = null;
  dropped = 0;      // commands that were not sent

  constructor(robot, topic, { name = robot.name, zero } = {}) {
    super();
    this.topic = topic.startsWith("/") ? topic : `/${topic}`;
    this.#robot = robot;
    this.#args = { topic: this.topic, name };
    this.#zero = zero;
    const state = robot.subscribe("/rowe/control/state", (said) => this.#take(said), { hz: state_hz });
    this.#offs = [
      () => state.unsubscribe(),
      robot.on("turned", () => this.#turn()),
      robot.on("closed", () => this.#closed()),
    ];
  }

  // --- what a person asks

  take() { return this.#control("take"); }
  take_over() { return this.#control("take_over"); }

  // The robot stands still, and others may drive.
  async release() {
    if (!this.held && !this.#asking) return;
    this.halt();
    this.#ended();
    await ask(this.#robot, service, { ...this.#args, action: "release" });
  }

  get commanding() { return this.#command !== null; }

  // Holds this command until the next one, or halt(). False: nothing was sent, since this client does not
  // drive, the robot is stopped, nobody sees this page, or the network does not move.
  set(msg) {
    const zero = zero_of(msg, "command");
    const { stop } = this.#robot;
    if (!this.held || stop.pending || stop.stopped || globalThis.document?.hidden) {
      this.dropped += 1;
      return false;
    }
    this.#zero ??= zero;
    this.#command = JSON.parse(JSON.stringify(msg));  // who sent it may go on writing to it
    this.#alive = moment();
    this.#number = stop.state?.number;
    return since_ms(this.#sent) < change_ms || this.#send(this.#command, waiting_bytes_max);
  }

  // Commands to stand still, at once and once, and keeps control.
  halt() {
    this.#command = null;
    return this.held && this.#zero !== undefined && this.#send(this.#zero);
  }

  // For good.
  close() {
    for (const off of this.#offs) off();
    const released = this.release();
    this.emit("closed");
    return released;
  }

  // --- what comes and goes

  #send(msg, bytes_max) {
    const sent = this.#robot.publish(this.topic, msg, { tick: this.#tick }, bytes_max);
    if (sent) this.#sent = this.#alive = moment();
    else this.dropped += 1;
    return sent;
  }

  async #control(action, beat) {
    const mine = beat ? this.#asked : (this.#asked += 1);
    const since = this.#beaten = moment();
    const fresh = this.#tick_came && since_ms(this.#tick_came) < tick_ms_max;
    const request = { ...this.#args, action, tick: fresh ? this.#tick : undefined };
    this.#asking += 1;
    let answer;
    try {
      answer = await ask(this.#robot, service, request, {}, () => mine === this.#asked);
      if (mine !== this.#asked) throw new robot_error("closed", `${service}: released before the answer`);
    } finally {
      this.#asking -= 1;
    }
    const { driver, number, lease_ms, hold_ms, tick } = answer;
    Object.assign(this, { held: true, driver, lease_ms, hold_ms });
    this.#number_held = number;
    this.#note(this.#proven_tick = tick);
    this.#proven = since;
    if (!beat) this.emit("changed");
    return answer;
  }

  #note(tick) {
    if (tick <= this.#tick) return;
    this.#tick = tick;
    this.#tick_came = moment();
  }

  #take({ tick, topics }) {
    const before_answer = this.held && tick < this.#proven_tick;
    this.#note(tick);
    const one = topics?.find(({ topic }) => topic === this.topic);
    if (!one || before_answer) return;
    const { driver, number, lease_ms, hold_ms } = one;
    const same = driver === this.driver;
    Object.assign(this, { driver, lease_ms, hold_ms });
    if (!this.held) return same || this.emit("changed");
    if (driver === null) this.#lost("expired");
    else if (number !== this.#number_held) this.#lost("taken_over");
  }

  #turn() {
    if (!this.held) return;
    const { stop } = this.#robot;
    if (this.commanding) {
      const number = stop.state?.number;
      this.#number ??= number;
      // The robot counts a command's age from its tick: with an old one nothing is in force any more.
      const lapsed = [this.#alive, this.#tick_came].some((then) => since_ms(then) > this.lease_ms);
      if (lapsed || stop.pending || stop.stopped || number !== this.#number) {
        this.#command = null;
        this.emit("changed");
      } else if (since_ms(this.#sent) >= repeat_ms / 2) {
        this.#send(this.#command, waiting_bytes_max);
      }
    }
    if (since_ms(this.#proven) > this.hold_ms) return this.#lost("expired");
    if (since_ms(this.#beaten) < beat_ms) return;
    const mine = this.#asked;
    this.#control("take", true).catch(({ code, said, answer }) => {
      if (code !== "refused" || mine !== this.#asked) return;  // what is not answered expires
      this.driver = answer?.driver ?? null;
      this.#lost(said === "driven" || said === "pause" ? "taken_over" : "refused", said);
    });
  }

  #closed() {
    this.driver = null;
    this.#tick = this.#tick_came = undefined;
    this.#asked += 1;
    this.#lost("closed");
  }

  #ended() {
    this.held = false;
    this.#command = null;
    this.#asked += 1;
    this.emit("changed");
  }

  // A heartbeat that is on its way must not take control again: hence the release.
  #lost(reason, said = null) {
    if (!this.held) return false;
    this.#ended();
    ask(this.#robot, service, { ...this.#args, action: "release" }).catch(() => {});
    this.emit("lost", { reason, driver: this.driver, said });
    return true;
  }
}
