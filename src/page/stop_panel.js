// SPDX-License-Identifier: Apache-2.0
// What is seen of the robot's stop, and the hands on it: STOP acts as it is pressed, the reset only once it
// was held for a while, since letting a robot go is to be meant. What is shown is what the robot told, never
// what a press should have done; what it told last is not known to hold once it is silent.

import { draw, element, mark, write } from "./dom.js";
import { clock } from "./numbers.js";
import { causes, latch, refusals, text } from "./text.js";
import { moment, since_ms } from "../../clients/js/src/link.js";

const hold_ms = 2000;
const stood_still_ms = 500;
const aim_ms = 500;               // a button that has just come is where a hand meant something else
const unknown_ms_max = 1000;    // nothing is shown for so long while it is not known whether there is a stop
const alarm_ms = [200, 100, 200, 100, 400];

const narrow = matchMedia("(max-width: 699px)");

const is_press_key = ({ key }) => key === " " || key === "Enter";
// Where a blank is a blank, or presses what has the focus.
const takes_blanks = (at) => at?.closest?.("input, textarea, select, button, summary, a") ?? false;

export class stop_panel {
  #robot;
  #of;
  #rights;
  #time;
  #hold = null;       // {number, timer, since}: the reset is held
  #alarmed = false;   // the device has shaken for this press
  #told = null;       // {state, number, began, at}: what the robot said last, and when, by the clock here
  #refused = null;    // the last refusal, until something else is asked for
  #guarded = false;   // this page guarded when it was looked at last
  #guard_came = moment();
  #shown = moment();
  driving = () => false;
  alone = () => true;  // what is shown beside it is the same robot, now

  // `time` as robot_clock.
  constructor(robot, rights, time) {
    this.#robot = robot;
    this.#of = robot.stop;
    this.#rights = rights;
    this.#time = time;
    this.#of.on("changed", () => this.#take());
    const press = element("stop");
    press.onpointerdown = (event) => event.button === 0 && this.#press();
    press.onclick = (event) => event.detail === 0 && this.#press();  // keys, and what stands for them
    element("guard").onclick = () => this.#guard();
    element("dismiss").onclick = (event) => this.#act("dismiss", () => this.#of.dismiss(event.target.value));
    const reset = element("reset");
    reset.onpointerdown = (event) => event.button === 0 && this.#begin_hold();
    reset.onkeydown = (event) => {
      if (!is_press_key(event)) return;
      event.preventDefault();
      if (!event.repeat) this.#begin_hold();
    };
    reset.onkeyup = (event) => is_press_key(event) && this.#end_hold();
    for (const end of ["pointerup", "pointerleave", "pointercancel", "blur"]) {
      reset.addEventListener(end, () => this.#end_hold());
    }
    reset.oncontextmenu = (event) => event.preventDefault();  // a finger that rests is no question
    addEventListener("keydown", (event) => this.#key(event), true);
  }

  // Escape stops always. The space bar does, too, unless it types or presses something; while this page
  // drives it stops in any case.
  #key(event) {
    const space = event.key === " " && (this.driving() || !takes_blanks(event.target));
    if (event.key !== "Escape" && !space) return;
    event.preventDefault();
    if (!event.repeat) this.#press();
  }

  // blank, none, unreachable, unknown, running or stopped.
  get state() {
    const of = this.#of;
    const early = this.#robot.link.attempt === 0 && performance.now() < unknown_ms_max;
    if (of.configured === null && early) return "blank";
    if (of.configured === false) return "none";
    if (this.#robot.state !== "open" && !of.limited) return "unreachable";
    if (!of.known) return "unknown";
    return of.stopped ? "stopped" : "running";
  }
  get stopped() { return this.state === "stopped"; }

  // What keeps a person from driving; null: nothing.
  get keeps() {
    const { state } = this;
    if (state === "none" || state === "blank") return null;
    if (this.#of.pending) return "stopping";
    return state === "running" ? null : state === "stopped" ? "stopped" : "unknown";
  }

  #take() {
    const of = this.#of;
    if (of.state) {
      const { state, number, since_ms: lasts_ms } = of.state;
      const same = this.#told?.number === number && this.#told.state === state;
      this.#told = { state, number, at: Date.now(), began: same ? this.#told.began : Date.now() - lasts_ms };
    }
    if (this.#guarded && !of.guarding && document.hidden) this.#refused = text.guard_hidden;
    this.#guarded = of.guarding;
  }

  // Writes what is known now.
  show() {
    const { state } = this;
    this.#shown = moment();
    mark(document.body, "data-stop", state);
    if (state === "blank" || state === "none") return;
    const of = this.#of;
    if (this.#hold && (state !== "stopped" || of.state.number !== this.#hold.number)) this.#end_hold();
    const shown = of.pending && state !== "unreachable" ? "stopping" : (latch[state] && state) || "unknown";
    mark(document.body, "data-pending", of.pending);
    draw(element("latch_mark"), latch[shown].draws);
    write(element("latch"), this.alone() ? latch[shown].word : text.robot_now(latch[shown].word));
    write(element("latch_by"), this.#line(state));
    this.#write_button(state);
    const [words, alarming] = this.#sentence(state);
    const says = element("stop_says");
    write(says, words);
    mark(says, "data-alarm", alarming);
    this.#write_slot(state);
    if (of.overdue && !this.#alarmed) {
      this.#alarmed = true;
      navigator.vibrate?.(alarm_ms);
    }
  }

  #clock(here_ms) { return clock(this.#time.at(here_ms)); }

  // Who, why and when.
  #line(state) {
    const of = this.#of;
    const told = this.#told;
    if (of.pending && state !== "unreachable") return text.asked(since_ms(of.asked.since));
    if (state === "unreachable" || state === "unknown") {
      return told ? text.last_heard(told.state, this.#clock(told.at)) : text.never_heard;
    }
    if (state === "running") {
      const names = of.state.guards.map(({ name }) => name);
      if (of.guarding) return text.guarded_here;
      return names.length > 0 ? text.guarded(names) : text.unguarded;
    }
    const { cause, source } = of.state;
    return text.stopped_at(this.#clock(told.began), causes[cause]?.(source) ?? String(cause));
  }

  #write_button(state) {
    const { pending } = this.#of;
    const wide = matchMedia("(hover: hover)").matches ? text.stop_keys : text.stop_print;
    let [word, note] = [text.stop, wide];
    if (state === "unreachable") {
      [word, note] = pending ? [text.not_sent, text.stop_waits] : [text.stop, text.stop_unreachable];
    } else if (pending) [word, note] = [text.stopping, text.stop_asks];
    else if (state === "stopped") [word, note] = [text.stopped, text.stop_again];
    write(element("stop_word"), word);
    write(element("stop_note"), note);
  }

  // The sentence below, and whether it is an alarm.
  #sentence(state) {
    const of = this.#of;
    const { asked } = of;
    if (state === "unreachable") return [text.press_waits, true];
    if (of.overdue) {
      const waited_ms = since_ms(asked.since);
      const { number, loops } = of.state ?? {};
      const late = of.stopped ? loops.filter(({ acknowledged }) => acknowledged !== number) : [];
      const names = late.map(({ name }) => name).join(", ");
      return [names ? text.not_observed(waited_ms, names) : text.not_acknowledged(waited_ms), true];
    }
    if (of.pending) return ["", false];
    if (state === "unknown") return [of.state ? text.press_goes : text.stop_asking, true];
    const ended = of.refused && (refusals[`guard_${of.refused}`] ?? refusals.guard_lost);
    const refused = this.#refused ?? ended;
    if (refused) return [refused, true];
    if (asked?.answer) {
      const words = narrow.matches ? text.acknowledged_short : text.acknowledged;
      return [words(asked.answer), false];
    }
    if (of.limited) return [text.only_stop, true];
    if (state !== "stopped") return [this.#alone ? text.moves_unguarded : text.moves_guarded, false];
    const silent = this.#silent;
    if (silent) return [text.guard_silent(silent.name), false];
    if (this.#lacks_guard) return [text.guards_none, false];
    return [this.#rights.has("reset") ? "" : text.who_resets, false];
  }

  // A guard of others that fell silent keeps it stopped.
  get #silent() { return this.#of.state?.guards.find(({ name, fresh }) => !fresh && name !== this.#of.name); }
  get #alone() { return this.#of.state.unguarded && this.#of.state.guards.length === 0; }
  get #lacks_guard() { return !this.#of.state.unguarded && this.#of.state.guards.length === 0; }

  // What one may do beside stopping: only what the role has a right to, and what leads somewhere now.
  #write_slot(state) {
    const of = this.#of;
    const acts = (state === "stopped" || state === "running") && !of.limited;
    const may = (right) => acts && this.#rights.has(right);
    const stopped = state === "stopped";
    const silent = stopped ? this.#silent : undefined;
    const dismiss = element("dismiss");
    dismiss.hidden = !silent || !may("reset");
    dismiss.value = silent?.name ?? "";
    write(dismiss, silent ? text.dismiss(silent.name) : "");
    const guard = element("guard");
    const was_hidden = guard.hidden;
    guard.hidden = !may("guard") || (stopped && !of.guarding && !this.#lacks_guard);
    if (was_hidden && !guard.hidden) this.#guard_came = moment();
    guard.disabled = since_ms(this.#guard_came) < aim_ms;
    mark(guard, "aria-pressed", of.guarding);
    write(guard, of.guarding ? text.guarding : text.guard);
    element("reset").hidden = !stopped || !may("reset") || !dismiss.hidden || this.#lacks_guard;
    write(element("reset_word"), this.#hold
      ? text.reset_hold(Math.max(1, Math.ceil((hold_ms - since_ms(this.#hold.since)) / 1000))) : text.reset);
  }

  #guard() {
    const of = this.#of;
    this.#act("guard", () => (of.guarding ? of.let_go() : of.guard()));
  }

  // What is refused is said until something else is asked for; a role that has no right is not asked again.
  async #act(what, ask) {
    this.#refused = null;
    try {
      const asked = ask();
      this.show();
      await asked;
    } catch ({ code, said }) {
      if (said === "role") this.#rights.lacks(what === "guard" ? "guard" : "reset");
      const known = refusals[`${what}_${said}`] ?? refusals[`guard_${said}`];
      const unsaid = refusals[what === "reset" ? "reset_lost" : "guard_lost"];
      this.#refused = code === "refused" && known ? known : unsaid;
    }
    this.show();
  }

  #press() {
    if (this.state === "none") return;
    this.#refused = null;
    this.#alarmed = this.#of.pending && this.#alarmed;
    this.#of.press();
    this.show();
  }

  #begin_hold() {
    if (this.#hold || !this.stopped || this.#of.limited) return;
    const { number } = this.#of.state;
    const timer = setTimeout(() => {
      const stood_still = since_ms(this.#shown) > stood_still_ms;  // the end of the hold may wait behind this
      this.#end_hold();
      if (stood_still) return;
      this.#act("reset", () => this.#of.reset(number));
    }, hold_ms);
    this.#hold = { number, timer, since: moment() };
    mark(element("reset"), "data-held", true);
    this.show();
  }

  #end_hold() {
    if (!this.#hold) return;
    clearTimeout(this.#hold.timer);
    this.#hold = null;
    element("reset").removeAttribute("data-held");
    this.show();
  }
}
