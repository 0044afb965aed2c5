// SPDX-License-Identifier: Apache-2.0
// The deck below what a recording shows: play and pause, how fast, a line of time with marks for stops and
// losses, and the way back to the robot.

import { element, make, mark, write } from "../dom.js";
import { missing, since_begin, words } from "./words.js";

const speeds = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const thumb_px = 28;           // the line's ends lie half a thumb inside
const drawing = { play: "running", pause: "pause", forward: "step", backward: "step", next: "flag" };

const svg = "http://www.w3.org/2000/svg";
function icon(name) {
  const made = document.createElementNS(svg, "svg");
  const use = document.createElementNS(svg, "use");
  made.setAttribute("class", "i");
  made.setAttribute("aria-hidden", "true");
  use.setAttribute("href", `#i-${drawing[name]}`);
  made.append(use);
  return made;
}

const button = (id, name, label, act) => make("button",
  { id, type: "button", className: "b", ariaLabel: label, title: label, onclick: act }, icon(name));

export class deck {
  #player = null;
  #stops = [];
  #losses = [];
  #searching = true;
  #damage = null;
  #drawn = "";

  // `back()`: to the robot.
  constructor(back) {
    const select = make("select", { id: "pace", className: "field", ariaLabel: words.speed });
    select.append(...speeds.map((each) => new Option(words.times(each), each)));
    select.value = 1;
    select.onchange = () => (this.#player.speed = Number(select.value));
    this.#make_line();
    this.time = make("p", { id: "deck_time" });
    this.says = make("p", { id: "deck_says", className: "quiet", role: "status" });
    this.play = button("play", "play", words.play, () => this.#player.play(!this.#player.playing));
    this.next = button("next_mark", "next", words.next_mark, () => this.#to_next_mark());
    this.next.hidden = true;
    this.hands = make("div", { className: "hands" }, this.play,
      button("step_back", "backward", words.step_back, () => this.#player.step(false)),
      button("step", "forward", words.step, () => this.#player.step(true)), select, this.next);
    this.back = make("button", { id: "back", type: "button", className: "b", textContent: words.cancel,
      onclick: back });
    this.at = make("section", { className: "deck", ariaLabel: words.deck }, this.line, this.hands,
      make("div", { className: "about" }, make("div", {}, this.time, this.says), this.back));
    this.line.hidden = this.hands.hidden = true;
    element("note").parentElement.before(this.at);
    document.body.toggleAttribute("data-deck", true);
  }

  #make_line() {
    this.seek = make("input",
      { id: "seek", type: "range", min: 0, value: 0, step: "any", ariaLabel: words.seek });
    this.seek.oninput = () => this.#seek(true);
    this.seek.onchange = () => this.#seek(false);
    this.marks = make("canvas", { ariaHidden: "true" });
    this.line = make("div", { className: "line" }, this.marks, this.seek);
  }

  #seek(rough) {
    const player = this.#player;
    player.seek(player.facts.begin_ms + Number(this.seek.value), rough);
    this.show();
  }

  progress(share) { write(this.says, words.reading(share)); }

  // The recording is open.
  begin(player) {
    this.#player = player;
    const { begin_ms, end_ms } = player.facts;
    this.seek.max = Math.max(1, end_ms - begin_ms);
    this.line.hidden = this.hands.hidden = false;
    write(this.back, words.back);
    this.show();
  }

  end() {
    this.at.remove();
    document.body.removeAttribute("data-deck");
  }

  stops(stops) {
    this.#stops = stops;
    this.#drawn = "";
  }
  losses(losses) {
    this.#losses = losses;
    this.#searching = false;
    this.#drawn = "";
  }
  damage(damage) { this.#damage = damage; }

  get #mark_times() {
    return [...this.#stops.map(({ told_ms }) => told_ms), ...this.#losses.map(({ at_ms }) => at_ms)]
      .sort((one, other) => one - other);
  }

  #to_next_mark() {
    const times = this.#mark_times;
    this.#player.seek(times.find((each) => each > this.#player.aim_ms + 1) ?? times[0]);
  }

  // Writes what holds now.
  show() {
    if (!this.#player) return;
    const { facts, aim_ms, playing } = this.#player;
    const length_ms = facts.end_ms - facts.begin_ms;
    const at_ms = aim_ms - facts.begin_ms;
    if (Number(this.seek.value) !== at_ms) this.seek.value = at_ms;
    this.seek.style.setProperty("--at", `${length_ms > 0 ? (100 * at_ms) / length_ms : 100}%`);
    mark(this.seek, "aria-valuetext", words.position_spoken(at_ms, length_ms));
    write(this.time, words.position(since_begin(at_ms), since_begin(length_ms)));
    mark(this.play.querySelector("use"), "href", `#i-${playing ? drawing.pause : drawing.play}`);
    const act = playing ? words.pause : words.play;
    mark(this.play, "aria-label", act);
    mark(this.play, "title", act);
    this.next.hidden = this.#stops.length + this.#losses.length === 0;
    write(this.says, this.#words());
    this.#draw(length_ms);
  }

  #words() {
    const { facts, fault, unreadable } = this.#player;
    const messages = this.#losses.reduce((sum, each) => sum + (each.messages ?? 0), 0);
    return [
      fault ?? "", missing(facts, this.#damage, unreadable),
      words.marks(this.#stops.length, messages, this.#losses.length), this.#searching ? words.searching : "",
    ].filter(Boolean).join(" \u00b7 ");
  }

  // Stops as long as they lasted, losses as marks that point at their time.
  #draw(length_ms) {
    const { marks: canvas } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const drawn = [width, height, devicePixelRatio, dark].join();
    if (drawn === this.#drawn || width === 0) return;
    this.#drawn = drawn;
    Object.assign(canvas, { width: width * devicePixelRatio, height: height * devicePixelRatio });
    const pen = canvas.getContext("2d");
    pen.scale(devicePixelRatio, devicePixelRatio);
    const style = getComputedStyle(canvas);
    const left_of = (at_ms) => thumb_px / 2 +
      ((width - thumb_px) * (at_ms - this.#player.facts.begin_ms)) / Math.max(1, length_ms);
    pen.fillStyle = style.getPropertyValue("--stop-word").trim();
    for (const { begin_ms, end_ms } of this.#stops) {
      const left = left_of(begin_ms);
      pen.fillRect(left, 4, Math.max(3, left_of(end_ms) - left), 6);
      pen.fillRect(left, 4, 3, height - 8);
    }
    pen.fillStyle = style.getPropertyValue("--warn").trim();
    pen.strokeStyle = style.getPropertyValue("--warn-ink").trim();
    for (const { at_ms } of this.#losses) {
      const left = left_of(at_ms);
      pen.beginPath();
      pen.moveTo(left, height - 14);
      pen.lineTo(left + 6, height - 3);
      pen.lineTo(left - 6, height - 3);
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
  }
}
