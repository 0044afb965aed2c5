// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.js";

const { peak_meter, rate_meter } = await load("meters.js");

test("one sample is no rate", () => assert.ok(Number.isNaN(new rate_meter().rate(1, 5))));

test("a count that grows evenly has its rate", () => {
  const meter = new rate_meter();
  let shown;
  for (let tick = 0; tick < 100; tick += 1) shown = meter.rate(tick / 10, tick * 3);
  assert.ok(Math.abs(shown - 30) < 1e-9, String(shown));
});

test("what happened long ago is no rate any more", () => {
  const meter = new rate_meter();
  meter.rate(0, 0);
  for (let tick = 1; tick < 50; tick += 1) meter.rate(tick / 10, 7);
  assert.equal(meter.rate(5, 7), 0);
});

test("an endpoint that started anew does not lose a negative number of messages", () => {
  const meter = new rate_meter();
  meter.rate(100, 1000);
  assert.ok(Number.isNaN(meter.rate(0.1, 0)));
  assert.equal(meter.rate(1.1, 5), 5);
});

test("the memory of a meter is bounded", () => {
  const meter = new rate_meter();
  for (let tick = 0; tick < 10000; tick += 1) meter.rate(tick / 10000, tick);
  assert.ok(meter.samples.length <= 64);
});

test("the largest value is held for two seconds, then the next largest", () => {
  const meter = new peak_meter();
  const shown = [1, 9, 3, 2, 1].map((value, second) => meter.peak(second, value));
  assert.deepEqual(shown, [1, 9, 9, 3, 2]);
});

test("a peak of a former life of the endpoint is forgotten", () => {
  const meter = new peak_meter();
  meter.peak(100, 50);
  assert.equal(meter.peak(0.1, 2), 2);
});
