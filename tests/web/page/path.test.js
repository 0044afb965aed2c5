// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.js";

const { round_length, trail } = await load("path.js");

const xs_of = (path) => Array.from({ length: path.size }, (_, index) => path.xs[path.at(index)]);

test("a robot that stands still uses no memory up", () => {
  const path = new trail(4);
  for (let index = 0; index < 100; index += 1) path.add(1, 1 + (index % 2) * 0.004, false);
  assert.equal(path.size, 1);
});

test("the newest points remain when the memory is full", () => {
  const path = new trail(4);
  for (let x = 0; x < 11; x += 1) path.add(x, 0, false);
  assert.deepEqual(xs_of(path), [7, 8, 9, 10]);
});

test("a path with a gap in time is broken there, and only there", () => {
  const path = new trail(4);
  path.add(0, 0, false);
  path.add(1, 0, true);
  path.add(2, 0, false);
  assert.deepEqual([...path.broken.slice(0, 3)], [0, 1, 0]);
});

test("a path that leaps is broken", () => {
  const path = new trail(4);
  path.add(0, 0, false);
  path.add(80, 0, false);
  assert.equal(path.broken[1], 1);
});

test("a point that overwrites the place of a break is not broken itself", () => {
  const path = new trail(2);
  path.add(0, 0, true);
  for (const x of [1, 2, 3]) path.add(x, 0, false);
  assert.deepEqual([...path.broken], [0, 0]);
});

test("scale bars have round lengths", () => {
  assert.deepEqual([0.0234, 0.5, 0.99, 1, 3.3, 49.9, 70].map(round_length), [0.02, 0.5, 0.5, 1, 2, 20, 50]);
});
