// SPDX-License-Identifier: Apache-2.0
// The robot's stop, as this page asks for it and is told of it; no words and no elements. What it is comes
// from the robot alone: a press changes nothing here but what was asked.
//
// A guard's heartbeats answer the robot's ticks as they arrive, never a timer: browsers slow the timers of a
// page that nobody sees, and a heartbeat that does not follow a tick would prove nothing anyway.

import { moment, since_ms } from "./link.js";

const state_topic = "/rowe/stop/state";
const again_ms = 250;          // a stop is asked for so often until it is acknowledged
const answer_ms_max = 500;     // and is called not acknowledged from then on
const state_ms_max = 1000;     // an older state is not known to hold

// Between two times that the robot spells in nanoseconds.
const between_ms = (from, to) => Number(BigInt(to) - BigInt(from)) / 1e6;

export class stop {
  // `robot` is the link, `name` this page's as a guard; `kept` the link that may only stop, and see that.
  constructor(robot, name, kept = null) {
    Object.assign(this, {
      robot, name, kept,
      configured: null,  // whether the robot has a stop; null: not known yet
      state: null,       // as the robot told it last
      heard: null,       // when
      began: null,       // the calendar's time at which its present number began
      asked: null,       // the last press: {since, sent, taken, answer}, answer: {number, took_ms, own_ms}
      guarding: false,   // this page has been told to guard
      hidden: false,     // and let go since nobody saw it
      refused: null,     // what the robot did not do as asked last: reset_tick, guard_role and so on
    });
    this.calls = new Map();  // what to do with answers to come, by their id
    this.calls_made = 0;
  }

  // --- what is

  // Over which it is asked, and whether that is for the stop alone.
  get link() { return this.limited ? this.kept : this.robot; }
  get limited() { return this.robot.state !== "open" && this.kept?.state === "open"; }
  get known() { return this.state !== null && since_ms(this.heard) < state_ms_max; }
  get stopped() { return this.state?.state === "stopped"; }
  get guards() { return this.state?.guards ?? []; }
  // Asked for and not acknowledged yet.
  get pending() { return this.asked !== null && this.asked.answer === null; }
  get overdue() { return this.pending && performance.now() - this.asked.since > answer_ms_max; }

  // --- what a person asks

  press() {
    if (!this.pending) this.asked = { since: performance.now(), taken: false, answer: null };
    this.refused = null;
    this.#ask();
    if (this.link.state !== "open") this.kept?.turn(true);
  }

  // Ends the stop `number`, the one that was shown.
  reset(number) {
    this.refused = null;
    this.#call("/rowe/stop/reset", { number, tick: this.state.tick }, ({ refused }) => {
      this.refused = refused ? `reset_${refused}` : null;
    });
  }

  guard() {
    Object.assign(this, { guarding: true, hidden: false, refused: null });
    this.#beat();
  }

  // Stops the robot if it moves.
  let_go() {
    if (this.guarding) this.dismiss(this.name);
    this.guarding = false;
  }

  // A guard that is gone keeps the robot stopped until somebody says that it is not to be waited for.
  dismiss(guard) {
    this.#call("/rowe/stop/guard", { guard, tick: this.state?.tick ?? 0, resign: true }, ({ refused }) => {
      this.refused = refused ? `${refused === "role" ? "dismiss" : "guard"}_${refused}` : null;
    });
  }

  // Nobody sees this page any more.
  hide() {
    if (!this.guarding) return;
    this.let_go();
    this.hidden = true;
  }

  // --- what comes

  opened() {
    this.calls.clear();
    this.link.send({ op: "subscribe", id: "stop", topic: state_topic });
    this.#call(state_topic, {}, (state) => this.#take(state));
    if (this.pending) this.#ask();
  }

  received(message) {
    if (message.op === "publish" && message.topic === state_topic) return this.#take(message.msg);
    const then = this.calls.get(message.id);
    if (message.op !== "service_response" || !then) return;
    this.calls.delete(message.id);
    if (message.result !== false) then(message.values ?? {});
    else if (message.service?.endsWith(state_topic)) this.configured = false;
    else if (message.service?.endsWith("/rowe/stop/guard")) then({ refused: "service" });
  }

  // To be called a few times a second.
  turn() {
    if (this.pending && performance.now() - this.asked.sent >= again_ms) this.#ask();
  }

  #take(state) {
    if (typeof state?.state !== "string") return;
    this.configured = true;
    if (state.number !== this.state?.number || state.state !== this.state.state) {
      this.began = Date.now() - (state.since_ms ?? 0);
      this.refused = null;
    }
    this.state = state;
    this.heard = moment();
    this.#forget_acknowledged();
    if (this.guarding) this.#beat();
  }

  // What was acknowledged is told of that stop alone: not of the next one, nor of a robot that started anew.
  #forget_acknowledged() {
    const { answer } = this.asked ?? {};
    if (!answer) return;
    if (answer.number === this.state.number) answer.shown = true;
    else if (answer.shown || !this.stopped) this.asked = null;
  }

  // --- what goes

  #call(service, args, then) {
    if (this.link.state !== "open") return;
    const id = `stop-${(this.calls_made += 1)}`;
    this.calls.set(id, then);
    this.link.send({ op: "call_service", id, service, args });
  }

  #ask() {
    const { asked } = this;
    asked.sent = performance.now();
    this.#call("/rowe/stop", {}, (answer) => {
      asked.taken = true;
      if (asked.answer !== null || typeof answer.observed_ns !== "string") return;
      const own_ms = between_ms(answer.accepted_ns, answer.observed_ns);
      asked.answer = { number: answer.number, took_ms: performance.now() - asked.since, own_ms };
    });
  }

  #beat() {
    if (!this.state || this.limited) return;
    this.#call("/rowe/stop/guard", { guard: this.name, tick: this.state.tick }, ({ refused }) => {
      // A tick that was too old is followed by a newer one; a name that our lost connection still has comes
      // free. What else there is does not pass.
      if (!refused || refused === "tick" || refused === "name" || !this.guarding) return;
      this.guarding = false;
      this.refused = `guard_${refused}`;
    });
  }
}
