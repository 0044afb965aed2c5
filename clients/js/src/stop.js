// SPDX-License-Identifier: Apache-2.0
// The robot's stop, as it is asked for and told; no words and no elements. What it is comes from the robot
// alone: a press changes nothing here but what was asked.
//
// A guard's heartbeats answer the robot's ticks as they arrive, never a timer: browsers slow the timers of a
// page that nobody sees, and a heartbeat that does not follow a tick would prove nothing anyway.

import { moment, since_ms } from "./link.js";
import { emitter, robot_error } from "./wire.js";

const state_topic = "/rowe/stop/state";
const again_ms = 500;          // a stop is asked for so often until it is acknowledged
const answer_ms_max = 500;     // and is overdue from then on
const press_ms_max = 5000;     // who waits for it is told so then
const state_ms_max = 1000;     // an older state is not known to hold
const late_ms = 500;           // who has not connected by then is late

// Between two times that the robot spells in nanoseconds.
const between_ms = (from, to) => Number(BigInt(to) - BigInt(from)) / 1e6;

// Asks a service whose answer has a member `refused`, which becomes an error. Who knows no tick yet gets one
// with the refusal, and asks once more, if that is `wanted()` then.
export async function ask(wire, service, args, options, wanted = () => true) {
  const answer = await wire.call(service, args, options);
  if (!answer.refused) return answer;
  if (answer.refused === "tick" && !args.tick && answer.tick && wanted()) {
    return ask(wire, service, { ...args, tick: answer.tick }, options);
  }
  const error = new robot_error("refused", `${service}: refused: ${answer.refused}`, answer.refused);
  throw Object.assign(error, { answer });
}

export class stop extends emitter {
  #robot;
  #kept = null;      // the wire that may only stop, and see that: there only while the first is not
  #make_kept;
  #reserved;         // make it before anybody has pressed
  #seen = [];        // the subscriptions to the state, over either
  #missed = moment();
  #again = moment();
  configured = null; // whether the robot has a stop; null: not known yet
  state = null;      // as the robot told it last
  asked = null;      // the last press: {since, answer}, answer: {number, took_ms, own_ms}
  guarding = false;
  refused = null;    // why guarding ended, where the robot ended it

  // `make_kept()` makes the second wire.
  constructor(robot, name, make_kept, reserved) {
    super();
    this.#reserved = reserved;
    this.#robot = robot;
    this.#make_kept = make_kept;
    this.name = name;
    this.#watch(robot);
    robot.on("closed", () => this.emit("changed"));
    robot.on("turned", () => this.#turn());
  }

  // --- what is

  get known() { return this.#seen.some((one) => one.fresh(state_ms_max)); }
  get stopped() { return this.known ? this.state.state === "stopped" : null; }
  // Over places that are kept for the stop: nothing else works.
  get limited() { return this.#robot.state !== "open" && this.#kept?.state === "open"; }
  // Asked for and not acknowledged yet.
  get pending() { return this.asked?.answer === null; }
  get overdue() { return this.pending && since_ms(this.asked.since) > answer_ms_max; }

  // --- what a person asks

  // Asks until the robot acknowledges it, also after the time is over, and on the next connection. Who does
  // not wait for it need not catch anything.
  press({ source, reason, timeout_ms = press_ms_max } = {}) {
    if (!this.pending) this.asked = { since: moment(), answer: null };
    const { asked } = this;
    asked.words = { source, reason };
    const since = moment();
    const waits = new Promise((done, failed) => {
      const off = this.on("turned", (ended) => {
        if (asked.answer) done(asked.answer);
        else if (ended) failed(new robot_error("closed", "/rowe/stop: closed before it was acknowledged"));
        else if (this.configured === false)
          failed(new robot_error("refused", `/rowe/stop: ${asked.refused}`));
        else if (since_ms(since) < timeout_ms) return;
        else {
          const why = asked.refused ? `: ${asked.refused}` : "";
          failed(new robot_error("timed_out", `/rowe/stop: not acknowledged within ${timeout_ms} ms${why}`));
        }
        off();
      });
    });
    waits.catch(() => {});
    this.#ask();
    if (!this.#open) this.#second(true);
    this.emit("changed");
    return waits;
  }

  // Ends the stop `number`, the one that was shown.
  reset(number = this.state?.number, options) {
    return ask(this.#robot, "/rowe/stop/reset", { number, tick: this.state?.tick }, options);
  }

  // This client becomes a guard, until let_go(). Ends when the robot has taken the first heartbeat.
  async guard() {
    Object.assign(this, { guarding: true, refused: null });
    this.emit("changed");
    try {
      await this.#heartbeat();
    } catch (error) {
      this.#refuse(error.said ?? error.code);
      throw error;
    }
  }

  // Stops the robot if it moves.
  async let_go() {
    if (!this.guarding) return;
    this.guarding = false;
    this.emit("changed");
    await this.dismiss(this.name);
  }

  // A guard that is gone keeps the robot stopped until somebody says that it is not to be waited for.
  dismiss(guard) { return this.#heartbeat({ guard, resign: true }); }

  close() {
    this.#kept?.close();
    this.emit("turned", true);
  }

  // --- what comes and goes

  get #open() { return [this.#robot, this.#kept].find((each) => each?.state === "open"); }

  #watch(wire) {
    this.#seen.push(wire.subscribe(state_topic, (state) => this.#take(state)));
    wire.on("open", () => {
      if (this.pending) this.#ask();
      wire.call(state_topic).then((state) => this.#take(state), ({ said }) => {
        if (said?.endsWith?.("not exist")) this.configured = false;
        this.emit("changed");
      });
    });
  }

  #take(state) {
    if (typeof state?.state !== "string") return;
    this.configured = true;
    this.state = state;
    // What was acknowledged is told of that stop alone: not of the next one, nor of a robot that started
    // anew.
    const { answer } = this.asked ?? {};
    if (answer?.number === state.number) answer.shown = true;
    else if (answer && (answer.shown || state.state !== "stopped")) this.asked = null;
    this.#beat();
    this.emit("changed");
  }

  #ask() {
    const { asked } = this;
    this.#again = moment();
    this.#open?.call("/rowe/stop", asked.words).then(({ number, accepted_ns, observed_ns }) => {
      if (asked.answer || typeof observed_ns !== "string") return;
      asked.answer = { number, took_ms: since_ms(asked.since), own_ms: between_ms(accepted_ns, observed_ns) };
      this.emit("turned");
      this.emit("changed");
    }, ({ said }) => {
      asked.refused = said;  // it is asked for again: a robot that has just started has no stop yet
      if (!said?.endsWith?.("not exist") || since_ms(asked.since) < press_ms_max) return;
      this.configured = false;
      this.asked = null;
      this.emit("turned");
      this.emit("changed");
    });
  }

  #heartbeat(more) {
    return ask(this.#robot, "/rowe/stop/guard", { guard: this.name, tick: this.state?.tick ?? 0, ...more });
  }

  #beat() {
    if (!this.guarding || this.limited) return;
    this.#heartbeat().catch(({ code, said }) => {
      // A tick that was too old is followed by a newer one; a name that our lost connection still has comes
      // free. What else there is does not pass.
      if (code === "refused" && said !== "tick" && said !== "name") this.#refuse(said);
    });
  }

  #refuse(said) {
    if (!this.guarding) return;
    Object.assign(this, { guarding: false, refused: said });
    this.emit("changed");
  }

  // The first connection is refused, or lost, or late.
  get #down() { return this.#robot.state === "disconnected" || since_ms(this.#missed) >= late_ms; }

  // The second connection, if it is time for one.
  #second(hurry) {
    if (this.#robot.state === "open") {
      this.#kept?.close();
      this.#kept = null;
      this.#seen.length = 1;
      this.#missed = moment();
    } else if (this.#kept) {
      if (hurry) this.#kept.link.turn(true);
    } else if (hurry || this.pending || (this.#reserved && this.#down)) {
      this.#kept = this.#make_kept();
      this.#watch(this.#kept);
    }
  }

  #turn() {
    this.#second();
    if (this.pending && since_ms(this.#again) >= again_ms) {
      this.#ask();
      this.emit("changed");
    }
    this.emit("turned");
  }
}
