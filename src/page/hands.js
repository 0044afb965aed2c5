// SPDX-License-Identifier: Apache-2.0
// What a person's hands ask of the robot: a stick on the screen, keys, a gamepad. Each says where it is,
// {forward, turn} between -1 and 1, or null while nobody holds it; nothing here knows a robot.
//
// Whatever lets go counts as letting go, and nothing counts twice: a key whose end went to another window, a
// finger that the system took away, a pad that was unplugged. A hold that ended for the person, because the
// robot stopped or the page was hidden, counts again only after the hand came back to the middle.

const middle = 0.12;             // of a pad's stick: it never rests at 0
const pad_frozen_ms_max = 1000;  // a stick that is out and says nothing new for so long is not held any more
const keys_of = {
  KeyW: [1, 0], ArrowUp: [1, 0], KeyS: [-1, 0], ArrowDown: [-1, 0],
  KeyA: [0, 1], ArrowLeft: [0, 1], KeyD: [0, -1], ArrowRight: [0, -1],
};
const typed = "input:not([type=range]), textarea, select";
const clamp = (value) => Math.min(1, Math.max(-1, value));

// Within a circle, and nothing in its middle.
function within(forward, turn, dead = 0) {
  const out = Math.hypot(forward, turn);
  if (out <= dead) return null;
  const share = Math.min(1, (out - dead) / (1 - dead)) / out;
  return { forward: forward * share, turn: turn * share };
}

// A stick on the screen. The pointer that took it holds it, wherever it goes.
export class stick {
  #at;
  #pointer = null;
  #where = null;

  constructor(at, changed) {
    this.#at = at;
    at.onpointerdown = (event) => {
      if (this.#pointer !== null || event.button !== 0) return;
      at.setPointerCapture(event.pointerId);
      this.#pointer = event.pointerId;
      this.#move(event);
      changed();
    };
    at.onpointermove = (event) => {
      if (event.pointerId !== this.#pointer) return;
      this.#move(event);
      changed();
    };
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      at.addEventListener(end, (event) => {
        if (event.pointerId !== this.#pointer) return;
        this.let_go();
        changed();
      });
    }
    at.oncontextmenu = (event) => event.preventDefault();
  }

  get where() { return this.#where; }
  // A finger that still rests on it is not held any more, and must come anew.
  let_go() { this.#pointer = this.#where = null; }

  #move({ clientX, clientY }) {
    const { left, top, width, height } = this.#at.getBoundingClientRect();
    const forward = clamp((top + height / 2 - clientY) / (height / 3));
    const turn = clamp((left + width / 2 - clientX) / (width / 3));
    this.#where = within(forward, turn, 0.05) ?? { forward: 0, turn: 0 };
  }
}

// The keys of arrows and W A S D, by their places, whatever is printed on them.
export class keys {
  #down = new Set();

  // `listens()` says whether keys drive now; not while somebody types, nor where arrows move something else.
  constructor(from, changed, listens) {
    from.addEventListener("keydown", (event) => {
      const { code, target } = event;
      // Who holds Meta or Ctrl means the browser; and where Meta is held, the end of a key is not told.
      if (event.ctrlKey || event.metaKey || event.altKey) return this.#end(changed);
      if (!keys_of[code] || !listens() || target?.closest?.(typed)) return;
      if (code.startsWith("Arrow") && target?.closest?.("input")) return;  // they move a slider there
      event.preventDefault();
      if (event.repeat) return;  // a key held from before is not pressed now
      this.#down.add(code);
      changed();
    });
    from.addEventListener("keyup", ({ code }) => this.#down.delete(code) && changed());
    // What the browser opens on the page gets the end of a key, and tells nobody.
    from.addEventListener("contextmenu", () => this.#end(changed), true);
    const opens = ({ target }) => target?.closest?.("select") && this.#end(changed);
    from.addEventListener("pointerdown", opens, true);
  }

  get where() {
    if (this.#down.size === 0) return null;
    const all = [...this.#down].map((code) => keys_of[code]);
    const sum = (at) => clamp(all.reduce((total, each) => total + each[at], 0));
    return within(sum(0), sum(1)) ?? { forward: 0, turn: 0 };
  }

  let_go() { this.#down.clear(); }

  #end(changed) {
    if (this.#down.size === 0) return;
    this.let_go();
    changed();
  }
}

// The left stick of the gamepad that is out: of several that are there, the one that a person pushes.
// Browsers tell nobody when a pad moves: it is to be looked at.
export class pad {
  #pads;
  #now;
  // Of each pad by its index {timestamp, at, armed}: what it said last, when that came, and whether its stick
  // was seen in the middle since somebody let go.
  #known = new Map();
  #last = null;  // the index of the one that counts
  where = null;
  frozen = false;
  count = 0;

  // `pads()` as navigator.getGamepads, `now()` in milliseconds.
  constructor(pads, now = () => performance.now()) {
    this.#pads = pads;
    this.#now = now;
  }

  let_go() {
    for (const one of this.#known.values()) one.armed = false;
    this.where = null;
  }

  look() {
    const all = [...(this.#pads() ?? [])].filter((one) => one?.connected && one.axes.length >= 2);
    const is_there = (wanted) => all.some(({ index }) => index === wanted);
    if (!is_there(this.#last)) this.let_go();  // nobody holds it any more
    for (const index of this.#known.keys()) if (!is_there(index)) this.#known.delete(index);
    const there = all.map((one) => this.#judge(one));
    this.count = there.length;
    const last = there.find(({ index }) => index === this.#last);
    if (last?.frozen && !this.frozen) this.let_go();  // nor this one
    const pushed = there.find(({ out, frozen }) => out && !frozen);
    const held = last?.out && !last.frozen ? last : pushed ?? last ?? there[0];
    this.#last = held?.index ?? null;
    this.frozen = held?.frozen ?? false;
    this.where = held && this.#known.get(held.index).armed ? held.out : null;
  }

  // Where its stick is, and whether that is old: a pad that fell silent, out of its radio's range or out of
  // power, still shows where its stick was.
  #judge({ index, timestamp, axes }) {
    let known = this.#known.get(index);
    if (!known) this.#known.set(index, known = { armed: false });
    if (known.timestamp !== timestamp) Object.assign(known, { timestamp, at: this.#now() });
    const out = within(-axes[1], -axes[0], middle);
    if (!out) known.armed = true;
    return { index, out, frozen: out !== null && this.#now() - known.at > pad_frozen_ms_max };
  }
}
