// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { load } from "./load.js";

const { age, count, duration, fixed, losses, metres, rate, states, thinned } = await load("text.js");

test("a number keeps its decimals and gets a minus sign as wide as a digit", () => {
  assert.equal(fixed(1.5, 3), "1.500");
  assert.equal(fixed(-1.5, 1), "\u22121.5");
});

test("a negative number that rounds to zero has no sign", () => assert.equal(fixed(-0.0001, 3), "0.000"));

test("what is not a number is a dash", () => {
  for (const value of [NaN, undefined, null, Infinity, "3"]) assert.equal(fixed(value, 1), "\u2013");
  for (const write of [count, rate, duration, metres]) assert.equal(write(undefined), "\u2013");
});

test("a length stays within seven characters up to ten kilometres", () => {
  for (const value of [-0.5, -99.9994, -999.994, -9999.94]) {
    assert.ok(metres(value).length <= 7, metres(value));
  }
});

test("counts are parted by thousands", () => {
  assert.equal(count(0), "0");
  assert.equal(count(999), "999");
  assert.equal(count(1234567), "1\u202f234\u202f567");
});

test("no loss is written as a plain zero", () => {
  assert.equal(rate(0), "0");
  assert.equal(rate(0.5), "0.5");
  assert.equal(rate(999.8), "999.8");
});

test("ages are written in the unit that suits them", () => {
  assert.equal(age(18.4), "18 ms");
  assert.equal(age(2400), "2.4 s");
  assert.equal(age(185000), "3 min 5 s");
});

test("durations have two units at most", () => {
  assert.equal(duration(0.4), "0 s");
  assert.equal(duration(59.9), "59 s");
  assert.equal(duration(3600), "1 h 0 min");
  assert.equal(duration(2 * 86400 + 7230), "2 d 2 h");
});

test("the state is a sentence", () => {
  assert.equal(states.live.sentence({ age_ms: 18 }), "live, 18 ms old");
  assert.equal(states.stale.sentence({ age_ms: 2400 }), "STALE 2.4 s");
  assert.equal(states.disconnected.sentence({ retry_in_ms: 2000 }), "disconnected, retrying in 2 s");
  assert.equal(states.disconnected.sentence({ retry_in_ms: 0 }), "disconnected, trying now");
});

test("states that alarm differ from the others by their mark, not only by colour", () => {
  assert.equal(new Set([states.live, states.stale, states.disconnected].map(({ mark }) => mark)).size, 3);
});

test("every counter of a loss has its words", async () => {
  const counters = await readFile(new URL("../../../src/service/base/counters.hpp", import.meta.url), "utf8");
  const named = (group) =>
    [...counters.matchAll(new RegExp(`X\\((\\w+), ${group},`, "g"))].map(([, name]) => name);
  assert.ok(named("loss").length > 9);
  assert.deepEqual(named("loss").sort(), Object.keys(losses).sort());
  assert.deepEqual(named("chosen").sort(), Object.keys(thinned).sort());
});

test("no counter is both a loss and thinning on purpose", () => {
  for (const name of Object.keys(thinned)) assert.ok(!(name in losses), name);
});
