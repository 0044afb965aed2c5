// SPDX-License-Identifier: Apache-2.0
// What is seen of the robot's stop, and the hands on it: STOP acts as it is pressed, the reset only once it
// was held for a while, since letting a robot go is to be meant.

import { write } from "./stats.js";
import { causes, clock, latch, refusals, text } from "./text.js";

const hold_ms = 2000;
const unknown_ms_max = 1000;    // nothing is shown for so long while it is not known whether there is a stop
const alarm_ms = [200, 100, 200, 100, 400];

const element = (id) => document.getElementById(id);
const is_press_key = ({ key }) => key === " " || key === "Enter";

export class stop_panel {
  constructor(of) {
    this.of = of;
    this.name = "";
    this.hold = null;       // {number, timer}: the reset is held
    this.alarmed = false;   // the device has shaken for this press
    const press = element("stop");
    press.onpointerdown = (event) => event.button === 0 && this.#press();
    press.onclick = (event) => event.detail === 0 && this.#press();  // keys, and what stands for them
    element("guard").onclick = () => this.#act(of.guarding ? () => of.let_go() : () => of.guard());
    element("dismiss").onclick = (event) => this.#act(() => of.dismiss(event.target.value));
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
  }

  // The robot says that it is stopped, and has not fallen silent since.
  get stopped() { return this.#state() === "stopped"; }

  // Writes what is known now; `name` is the robot's.
  show(name) {
    this.name = name;
    const state = this.#state();
    if (document.body.dataset.stop !== state) document.body.dataset.stop = state;
    if (state === "blank" || state === "none") return;
    const { of } = this;
    if (this.hold && (state !== "stopped" || of.state.number !== this.hold.number)) this.#end_hold();
    const by = state === "stopped" && of.state.cause === "request";
    write(element("latch_mark"), (latch[state] ?? latch.unknown).mark);
    write(element("latch"), by ? text.stopped_by(of.state.source) : (latch[state] ?? latch.unknown).word);
    write(element("latch_at"), state === "stopped" ? text.stopped_at(clock(of.began)) : "");
    this.#write_says(state);
    element("stop").setAttribute("aria-disabled", String(state === "unreachable"));
    element("reset").setAttribute("aria-disabled", String(state !== "stopped" || of.limited));
    write(element("reset"), this.hold ? text.reset_hold : text.reset);
    element("guard").setAttribute("aria-disabled", String(!this.#may_act(state)));
    element("guard").setAttribute("aria-pressed", String(of.guarding));
    write(element("guard"), of.guarding ? text.guarding : text.guard);
    this.#write_guards();
  }

  // blank, none, unreachable, unknown, running or stopped.
  #state() {
    const { of } = this;
    const connected = of.link.state === "open";
    const early = of.robot.attempt === 0 && performance.now() < unknown_ms_max;
    if (of.configured === null && early) return "blank";
    if (of.configured === false) return "none";
    if (!connected) return "unreachable";
    if (!of.known) return "unknown";
    return of.stopped ? "stopped" : "running";
  }

  // The one sentence below, and whether it is an alarm.
  #sentence(state) {
    const { of } = this;
    const { asked } = of;
    const waited_ms = performance.now() - (asked?.since ?? 0);
    if (of.pending && state === "unreachable") return [text.not_sent, true];
    if (of.overdue && asked.taken) {
      const late = (of.state?.loops ?? []).filter((loop) => loop.acknowledged !== of.state.number);
      return [text.not_observed(waited_ms, late.map((loop) => loop.name).join(", ")), true];
    }
    if (of.overdue) return [text.not_acknowledged(waited_ms), true];
    if (of.pending) return [text.stopping, false];
    if (state === "unreachable") return [text.stop_unreachable, true];
    if (state === "unknown") return [of.heard ? text.stop_silent : text.stop_asking, true];
    if (of.refused) return [refusals[of.refused] ?? of.refused, true];
    if (asked) return [text.acknowledged(this.name, asked.answer), false];
    if (of.limited) return [text.only_stop, true];
    if (state === "stopped") return [causes[of.state.cause]?.(of.state.source) ?? of.state.cause, false];
    const alone = of.state.unguarded && of.guards.length === 0;
    return [alone ? text.moves_unguarded : text.moves_guarded, alone];
  }

  #write_says(state) {
    const [words, alarming] = this.#sentence(state);
    const says = element("stop_says");
    write(says, words);
    if (says.dataset.alarm !== String(alarming)) says.dataset.alarm = String(alarming);
    if (this.of.overdue && !this.alarmed) {
      this.alarmed = true;
      navigator.vibrate?.(alarm_ms);
    }
  }

  #write_guards() {
    const { of } = this;
    const silent = of.guards.find((guard) => !guard.fresh && guard.name !== of.name);
    const named = of.guards.map(({ name, fresh }) => {
      if (name === of.name) return text.guard_this(name);
      return fresh ? name : text.guard_silent(name);
    });
    const nobody = of.state?.unguarded ? text.guards_unguarded : text.guards_none;
    const line = of.hidden ? text.guard_hidden : named.length > 0 ? text.guards(named) : nobody;
    write(element("guards"), of.state || of.hidden ? line : "");
    const dismiss = element("dismiss");
    dismiss.hidden = silent === undefined || !this.stopped || of.limited;
    dismiss.value = silent?.name ?? "";
    write(dismiss, silent ? text.dismiss(silent.name) : "");
  }

  // More than to stop.
  #may_act(state) {
    return (state === "stopped" || state === "running") && !this.of.limited;
  }

  #act(what) {
    if (!this.#may_act(this.#state())) return;
    what();
    this.show(this.name);
  }

  #press() {
    if (this.#state() === "unreachable" || this.#state() === "blank") return;
    this.alarmed = this.of.pending && this.alarmed;
    this.of.press();
    this.show(this.name);
  }

  #begin_hold() {
    if (this.hold || !this.stopped || this.of.limited) return;
    const { number } = this.of.state;
    const timer = setTimeout(() => {
      this.#end_hold();
      this.of.reset(number);
    }, hold_ms);
    this.hold = { number, timer };
    element("reset").dataset.held = "true";
    this.show(this.name);
  }

  #end_hold() {
    if (!this.hold) return;
    clearTimeout(this.hold.timer);
    this.hold = null;
    delete element("reset").dataset.held;
    this.show(this.name);
  }
}
