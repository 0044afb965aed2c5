// SPDX-License-Identifier: Apache-2.0
// The hands that drive, against elements, keys and pads of our own: what lets go, counts as letting go.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { load } from "./load.js";

const { keys, pad, stick } = await load("hands.js");
const near = (where, forward, turn) => {
  const off = Math.hypot(where.forward - forward, where.turn - turn);
  assert.ok(off < 1e-9, JSON.stringify(where));
};

// ---- the stick

let at, changes, made;
class fake_element extends EventTarget {
  getBoundingClientRect() { return { left: 0, top: 0, width: 120, height: 120 }; }
  setPointerCapture(id) { this.captured = id; }
}
const pointer = (type, more) => {
  const event = { pointerId: 1, button: 0, clientX: 60, clientY: 60, ...more };
  at[`on${type}`]?.(event);
  at.dispatchEvent(Object.assign(new Event(type), event));
};
beforeEach(() => {
  at = new fake_element();
  changes = 0;
  made = new stick(at, () => (changes += 1));
});

test("a stick that nobody holds asks for nothing", () => assert.equal(made.where, null));

test("a stick held up drives forward, held to the left turns left, and not faster than its edge", () => {
  pointer("pointerdown");
  near(made.where, 0, 0);
  pointer("pointermove", { clientY: 0 });
  near(made.where, 1, 0);
  pointer("pointermove", { clientX: 0 });
  near(made.where, 0, 1);
  pointer("pointermove", { clientX: 0, clientY: -500 });
  assert.ok(Math.hypot(made.where.forward, made.where.turn) < 1 + 1e-9);
  assert.equal(changes, 4);
});

for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
  test(`${end} lets go of the stick`, () => {
    pointer("pointerdown", { clientY: 0 });
    pointer(end, { pointerId: 2 });
    near(made.where, 1, 0);
    pointer(end);
    assert.equal(made.where, null);
    assert.equal(changes, 2);
  });
}

test("a second finger does not move the stick, nor let go of it", () => {
  pointer("pointerdown", { clientY: 0 });
  pointer("pointerdown", { pointerId: 2, clientY: 120 });
  pointer("pointermove", { pointerId: 2, clientY: 120 });
  near(made.where, 1, 0);
});

test("a finger that rests on a stick that was let go for it does not count until it comes anew", () => {
  pointer("pointerdown", { clientY: 0 });
  made.let_go();
  pointer("pointermove", { clientY: 10 });
  assert.equal(made.where, null);
  pointer("pointerdown", { clientY: 0 });
  near(made.where, 1, 0);
});

// ---- keys

const from = new EventTarget();
let listens = true;
const pressed = new keys(from, () => (changes += 1), () => listens);
const key = (type, code, more) => from.dispatchEvent(Object.assign(new Event(type), { code, ...more }));
beforeEach(() => {
  pressed.let_go();
  listens = true;
});

test("keys drive while they are held, two of them together", () => {
  key("keydown", "KeyW");
  near(pressed.where, 1, 0);
  key("keydown", "ArrowLeft");
  near(pressed.where, Math.SQRT1_2, Math.SQRT1_2);
  key("keyup", "KeyW");
  near(pressed.where, 0, 1);
  key("keyup", "ArrowLeft");
  assert.equal(pressed.where, null);
});

test("opposite keys stand still", () => {
  key("keydown", "KeyW");
  key("keydown", "KeyS");
  near(pressed.where, 0, 0);
});

test("keys that repeat, browser's keys, and keys while nobody drives do not count", () => {
  key("keydown", "KeyW", { repeat: true });
  key("keydown", "KeyW", { ctrlKey: true });
  listens = false;
  key("keydown", "KeyW");
  key("keydown", "KeyQ");
  assert.equal(pressed.where, null);
});

test("Meta lets go of all keys: where it is held, no end of a key is told", () => {
  key("keydown", "KeyW");
  key("keydown", "MetaLeft", { metaKey: true });
  assert.equal(pressed.where, null);
});

test("what the browser opens on the page lets go of all keys, for it gets their ends", () => {
  key("keydown", "KeyW");
  key("contextmenu");
  assert.equal(pressed.where, null);
  key("keydown", "KeyW");
  const inside = new Event("pointerdown");
  Object.defineProperty(inside, "target", { value: { closest: (of) => of === "select" } });
  from.dispatchEvent(inside);
  assert.equal(pressed.where, null);
});

// ---- pads

let pads, now, held;
const is_at = (turn, forward, more) => {
  pads = [{ index: 0, connected: true, timestamp: (now += 16), axes: [-turn, -forward], ...more }];
  held.look();
};
beforeEach(() => {
  [now, pads] = [1000, []];
  held = new pad(() => pads, () => now);
});

test("a pad's stick counts once it was seen in the middle", () => {
  is_at(0, 1);
  assert.equal(held.where, null);
  is_at(0, 0.05);
  assert.equal(held.where, null);
  is_at(0, 1);
  near(held.where, 1, 0);
});

test("a pad that is unplugged lets go, and does not count when it is back with its stick out", () => {
  is_at(0, 0);
  is_at(0, 1);
  pads = [null];
  held.look();
  assert.equal(held.where, null);
  is_at(0, 1);
  assert.equal(held.where, null);
  is_at(0, 0, { connected: false });
  assert.equal(held.count, 0);
});

test("a pad that is frozen with its stick out lets go, and says so", () => {
  is_at(0, 0);
  is_at(0, 1);
  now += 1000;
  held.look();
  near(held.where, 1, 0);
  now += 1;
  held.look();
  assert.equal(held.where, null);
  assert.ok(held.frozen);
  is_at(0, 1);
  assert.ok(!held.frozen);
  assert.equal(held.where, null, "it must come back to the middle");
  is_at(0, 0);
  is_at(0, 1);
  near(held.where, 1, 0);
});

test("a pad that rests may be silent for as long as it likes", () => {
  is_at(0, 0);
  now += 60000;
  held.look();
  assert.ok(!held.frozen);
});

test("another pad does not take the place of one that is gone, stick out", () => {
  is_at(0, 0);
  is_at(0, 1, { index: 1 });
  assert.equal(held.where, null);
});

test("of two pads the one that is pushed drives, whichever is listed first", () => {
  const both = (first, second) => {
    pads = [first, second].map((forward, index) =>
      ({ index, connected: true, timestamp: (now += 16), axes: [0, -forward] }));
    held.look();
    return held.where?.forward ?? null;
  };
  assert.deepEqual([both(0, 0), both(0, 1), both(0, 0), both(1, 0), both(1, 1)], [null, 1, null, 1, 1]);
});

test("a pad that has been silent with its stick out does not drive when another one is let go", () => {
  const both = (first, second, at) => {
    pads = [{ index: 0, connected: true, timestamp: (now += 16), axes: [0, -first] },
      { index: 1, connected: true, timestamp: at, axes: [0, -second] }];
    held.look();
    return held.where;
  };
  both(0, 0, 1);
  both(1, 1, 2);
  now += 5000;
  near(both(1, 1, 2), 1, 0);
  assert.equal(both(0, 1, 2), null);
});

test("a pad that died with its stick out keeps no other one from driving", () => {
  const both = (second) => {
    pads = [{ index: 0, connected: true, timestamp: 2, axes: [0, -1] },
      { index: 1, connected: true, timestamp: (now += 16), axes: [0, -second] }];
    held.look();
    return held.where?.forward ?? null;
  };
  const dies = (second) => {
    pads = [{ index: 0, connected: true, timestamp: (now += 16), axes: [0, 0] }];
    held.look();
    assert.equal(both(second), 1);
    now += 5000;
  };
  dies(0);
  assert.deepEqual([both(0), held.frozen, both(0), both(1), held.frozen, both(0)],
    [null, true, null, 1, false, null]);
  dies(1);
  assert.deepEqual([both(1), both(1), both(0), both(1)], [null, null, null, 1], "who was out comes anew");
});

test("a browser without pads has none", () => {
  const none = new pad(() => undefined, () => now);
  none.look();
  assert.equal(none.where, null);
  assert.equal(none.count, 0);
});
