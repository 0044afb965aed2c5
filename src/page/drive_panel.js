// SPDX-License-Identifier: Apache-2.0
// Driving: who drives, taking and letting go of the controls, how fast, and the hands that hold them.
//
// The client repeats a command twenty times a second while it is held, drops it when the robot is stopped or
// the page stood still, and sends one zero when it ends. What it dropped never comes back by itself: the
// person must let go first. This part only says what is held now.

import { choose_from, element, mark, write } from "./dom.js";
import { keys, pad, stick } from "./hands.js";
import { moment, since_ms } from "../../clients/js/src/link.js";
import { control_refusals, losses_of_control, text } from "./text.js";

const service = "/rowe/control";
const state_topic = "/rowe/control/state";
const state_hz = 10;
const turn_max = 1;                             // rad/s of a stick that is out
const own_limit = { max: 1, value: 0.5 };       // m/s, of a robot that names none
const usual_share = 0.5;                        // of what a robot allows
const aim_ms = 500;                             // a hand that aimed at the button meant what it said before
const limit_least = 0.05;

// Messages that say how fast, by the names of their types; one of unknown type is taken for the first.
const shapes = [
  [/^(geometry_msgs\/(msg\/)?Twist)?$/, (twist) => twist],
  [/^geometry_msgs\/(msg\/)?TwistStamped$/, (twist) => ({ twist })],
];
const shape_of = (type = "") => shapes.find(([known]) => known.test(type))?.[1];

export class drive_panel {
  #robot;
  #rights;
  #base = null;    // the driven topic, as the client has it
  #said = null;    // why control was not taken, or is lost
  #keeps = () => null;
  #types = new Map();  // of the robot's topics
  #shape = null;
  #wanted = null;  // the topic that somebody chose
  #limit_max = own_limit.max;
  #held = false;   // a command is held by a hand
  #spent = false;  // a command ended before the hand did
  #last = null;    // the hand that was said last
  driver = null;   // who drives any of them, also where this role may not
  #looked = moment();
  #chosen = false; // somebody moved the slider
  #takes_over_since = moment();  // since when its button says so
  #hands;
  #off = false;    // a recording is shown: nobody drives by it
  changed = () => {};

  // `feeds` as in feeds.js; `keeps()` names what keeps a person from driving now.
  constructor(robot, rights, feeds, keeps) {
    this.#robot = robot;
    this.#rights = rights;
    this.#keeps = keeps;
    feeds.want(state_topic, ({ topics }) => this.#take(topics ?? []), state_hz);
    const changed = () => this.#command();
    this.#hands = {
      stick: new stick(element("stick"), changed),
      keys: new keys(window, changed, () => this.drives && this.#seen),
      pad: new pad(() => navigator.getGamepads?.()),
    };
    element("take").onclick = () => this.#ask();
    element("driven").onchange = ({ target }) => this.#choose(target);
    const limit = element("limit");
    limit.oninput = () => {
      this.#chosen = true;
      this.#command();
    };
    limit.onpointerup = () => limit.blur();  // so that arrows drive again
    robot.on("turned", () => this.#turn());
    // The client itself stands still then; the hands are let go, wherever they are.
    addEventListener("blur", () => this.#drop());
    document.addEventListener("visibilitychange", () => document.hidden && this.leave());
    this.#allow(own_limit.value);
  }

  get drives() { return this.#base?.held ?? false; }
  get topic() { return this.#base?.topic ?? null; }
  // The role may drive, and there is something to drive.
  get offered() { return !this.#off && this.topic !== null && this.#may(this.topic); }

  // Off: who drives stands still and lets go.
  off(off) {
    this.#off = off;
    if (off) this.leave();
  }
  #may(topic) { return this.#rights.has("publish", topic) && this.#rights.has("call", service); }
  get #seen() { return element("stick").offsetParent !== null; }

  // What a link carries.
  get arranged() { return { drive: this.#wanted }; }
  arrange({ drive }) { this.#wanted = drive; }

  // `topics` as listed in /rowe/stats.
  listed(topics) { this.#types = new Map(topics.map(({ topic, type }) => [topic, type])); }

  // The fastest that the robot allows, by its parameter.
  fastest(speed) {
    if (typeof speed !== "number" || !(speed >= 0) || speed === this.#limit_max) return;
    this.#limit_max = speed;
    // What somebody chose, or drives by, never rises by itself.
    const stays = this.#chosen || this.drives;
    this.#allow(stays ? Math.min(Number(element("limit").value), speed) : usual_share * speed);
  }

  #allow(value) {
    const slider = element("limit");
    Object.assign(slider, { min: limit_least, max: this.#limit_max, step: 0.05, value });
    this.#write_limit();
  }

  // Who leaves stands still, others may drive, and nothing is asked any more until somebody sees this page.
  leave() {
    this.#drop();
    this.#base?.close().catch(() => {});
    this.#base = null;
  }

  #take(topics) {
    if (this.#off) return;
    this.driver = topics.find(({ driver }) => driver)?.driver ?? null;
    // What is driven stays while it is not known, after a cut, what this role may do.
    const may = topics.map(({ topic }) => topic).filter((topic) => typeof topic === "string" &&
      shape_of(this.#types.get(topic)) && (topic === this.topic || this.#may(topic)));
    const topic = [this.#wanted, this.topic, ...may].find((each) => may.includes(each)) ?? null;
    choose_from(element("driven"), may, topic);
    if (topic === this.topic && (topic === null || shape_of(this.#types.get(topic)) === this.#shape)) return;
    this.#begin(topic);
  }

  #choose(choice) {
    choice.blur();  // so that arrows drive again
    this.#wanted = choice.value;
    this.#begin(choice.value);
    this.changed();
  }

  // Drives another topic from now on, or none: what was driven stands still.
  #begin(topic) {
    this.leave();
    if (topic === null) return;
    this.#shape = shape_of(this.#types.get(topic));
    this.#said = null;
    this.#base = this.#robot.drive(topic, { zero: this.#message(0, 0) });
    this.#base.on("lost", ({ reason, ...more }) => {
      this.#said = losses_of_control[reason]?.(more) ?? String(reason);
      this.#drop();
    });
  }

  #message(speed, turn) { return this.#shape({ linear: { x: speed }, angular: { z: turn } }); }

  async #ask() {
    const base = this.#base;
    if (!base) return;
    this.#said = null;
    try {
      await base[element("take").value]();  // what the button said when it was pressed
      this.#drop();  // what is out already was not meant for this robot
    } catch ({ code, said, answer }) {
      if (code === "closed") return;
      const words = control_refusals[code === "refused" ? said : "lost"] ?? control_refusals.lost;
      this.#said = words(answer ?? {});
    }
    this.show();
  }

  get #hand() {
    const { stick: on_screen, keys: pressed, pad: held } = this.#hands;
    return this.#seen ? on_screen.where ?? pressed.where ?? held.where : null;
  }

  #let_go() { for (const hand of Object.values(this.#hands)) hand.let_go(); }

  // Whatever hands hold does not count until they were let go.
  #drop() {
    this.#let_go();
    if (this.#held && this.#base?.commanding) this.#base.halt();
    this.#held = false;
    this.show();
  }

  // Says what is held now, if that may drive.
  #command() {
    const base = this.#base;
    const hand = this.#hand;
    if (!hand) this.#spent = false;
    // A page that stood still for longer than a command lasts does not know how old this hand is.
    else if (this.drives && since_ms(this.#looked) > base.lease_ms) this.#spent = true;
    if (!this.drives || !hand || this.#keeps() || this.#spent) {
      if (this.#held) base?.halt();
      if (this.#held && hand) this.#spent = true;
      this.#held = false;
    } else if (this.#held && !base.commanding) {
      this.#held = false;  // the client dropped it: the robot was stopped, or this page stood still
      this.#spent = true;
    } else {
      // What is held as it was is repeated by the client.
      if (this.#held && this.#is_last(hand)) return this.show();
      this.#last = { ...hand, limit: this.limit };
      base.set(this.#message(hand.forward * this.limit, hand.turn * turn_max));
      this.#held = base.commanding;
    }
    this.show();
  }

  #is_last({ forward, turn }) {
    const last = this.#last;
    return forward === last.forward && turn === last.turn && this.limit === last.limit;
  }

  get limit() { return Math.min(Number(element("limit").value), this.#limit_max); }

  #turn() {
    this.#hands.pad.look();
    if (!this.#seen) this.#let_go();
    if (this.drives) this.#command();
    this.#looked = moment();
  }

  // --- words

  show() {
    const base = this.#base;
    mark(document.body, "data-drive", !this.offered ? "none" : this.drives ? "mine" : "others");
    if (!this.offered) return;
    const keeps = this.#keeps();
    write(element("driver"), this.drives ? text.you_drive
      : base.driver ? text.drives(base.driver) : text.nobody_drives);
    write(element("driver_says"), this.#line(keeps));
    mark(element("driver_says"), "aria-live", this.#held ? "off" : "polite");  // speeds are not read out
    const take = element("take");
    const over = !this.drives && base.driver !== null;
    take.hidden = over && !this.#rights.has("take_over");
    if (over && take.value !== "take_over") this.#takes_over_since = moment();
    take.value = this.drives ? "release" : over ? "take_over" : "take";
    take.disabled = over && since_ms(this.#takes_over_since) < aim_ms;
    write(take, this.drives ? text.release : over ? text.take_over(base.driver) : text.take);
    this.#write_stick(keeps);
    this.#write_limit();
    const { count, frozen } = this.#hands.pad;
    write(element("keys"), `${text.keys} \u00b7 ${frozen ? text.pad_frozen : text.pads(count)}`);
  }

  #line(keeps) {
    if (keeps) return text.no_driving[keeps] ?? "";
    if (!this.drives) return this.#said ?? (this.#base.driver ? text.changes_hands : "");
    if (this.#spent) return text.let_go_first;
    if (this.#hands.pad.frozen) return text.pad_frozen;
    const hand = this.#held && this.#hand;
    return hand ? text.commands(hand.forward * this.limit, hand.turn * turn_max) : text.standstill;
  }

  #write_stick(keeps) {
    const at = element("stick");
    const hand = this.#hand;
    mark(at, "aria-disabled", !this.drives || keeps !== null || this.#spent);
    mark(at, "data-on", this.#held);
    const reach = at.clientWidth / 3;
    const { forward = 0, turn = 0 } = hand ?? {};
    element("knob").style.transform = `translate(${-turn * reach}px, ${-forward * reach}px)`;
  }

  #write_limit() {
    const slider = element("limit");
    const value = text.limit_value(this.limit);
    write(element("limit_value"), value);
    mark(slider, "aria-valuetext", value);
    const share = (this.limit - limit_least) / (this.#limit_max - limit_least);
    slider.style.setProperty("--at", `${(share * 100).toFixed(1)}%`);
  }
}
