// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.js";

const { points_of, reach_of } = await load("scan.js");
const { grid_of } = await load("grid.js");
const { bytes_of, pixels_of } = await load("camera.js");

const step = Math.PI / 2;
const scan = { angle_min: 0, angle_increment: step, range_min: 0.1, range_max: 10, ranges: [1, 2, 3, 4] };

test("the beams of a scan go round against the clock from its first angle", () => {
  const points = points_of(scan).map((each) => Math.round(each * 1e9) / 1e9 + 0);
  assert.deepEqual(points, [1, 0, 0, 2, -3, 0, 0, -4]);
});

test("beams that met nothing, and what is no number, are left out", () => {
  assert.equal(points_of({ ...scan, ranges: [0.05, 11, null, "2", 4] }).length, 2);
  assert.equal(points_of({ ...scan, range_max: null, ranges: [1e4, 1e6] }).length, 2);
  const odds = [null, 3, {}, { ranges: [1] }, { ...scan, ranges: "1" }, { ...scan, angle_increment: null }];
  for (const odd of odds) {
    assert.deepEqual(points_of(odd), []);
  }
});

test("of a scan with very many beams some are drawn", () => {
  const points = points_of({ ...scan, angle_increment: 1e-4, ranges: Array(50001).fill(1) });
  assert.ok(points.length > 2000 && points.length <= 4000, `${points.length}`);
});

test("one beam through an open door does not make the view wide", () => {
  const ranges = [...Array(99).fill(2), 90];
  const points = points_of({ ...scan, angle_increment: 0.01, range_max: 100, ranges });
  assert.equal(reach_of(points), 2);
  assert.equal(reach_of([]), 0);
});

const origin = { position: { x: -1, y: 2 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
const map = (more) => ({
  info: { width: 2, height: 2, resolution: 0.5, origin }, data: [0, 100, -1, 50], ...more,
});

test("a map has its place and its cells", () => {
  const { x, y, heading, width, height, resolution, cells } = grid_of(map());
  assert.deepEqual([x, y, heading, width, height, resolution], [-1, 2, 0, 2, 2, 0.5]);
  assert.deepEqual(cells, [0, 100, -1, 50]);
});

test("what is no map, has not its cells, or is huge is not drawn", () => {
  for (const odd of [null, {}, map({ data: [1] }), map({ info: { width: 2, height: 2, resolution: 0 } }),
    map({ info: { width: 1e5, height: 1e5, resolution: 1 }, data: { length: 1e10 } }),
    map({ info: { width: 0.5, height: 2, resolution: 1, origin }, data: [0] }),
    map({ info: { width: -2, height: -2, resolution: 1, origin } }),
    map({ info: { width: "2", height: "2", resolution: 1, origin } }),
    map({ data: { length: 4 } }), map({ info: { width: 2, height: 2, resolution: 1e9, origin } }),
    map({ info: { width: 2, height: 2, resolution: 1, origin: { position: { x: 1e15, y: 0 } } } }),
    map({ info: { width: 2, height: 2, resolution: 1, origin: { position: { x: null, y: 0 } } } })]) {
    assert.equal(grid_of(odd), null);
  }
});

test("an image is base64 or a list of numbers, and nothing else", () => {
  assert.deepEqual([...bytes_of({ data: "AAEC/w==" })], [0, 1, 2, 255]);
  assert.deepEqual([...bytes_of({ data: [1, 2] })], [1, 2]);
  for (const odd of [null, undefined, {}, { data: 3 }, { data: "no base64!" }, { data: "A".repeat(9e6) },
    { data: [{ toString: 1, valueOf: 1 }] }, { data: [1.5] }]) {
    assert.equal(bytes_of(odd), null);
  }
});

test("the head of an image says how many pixels it has", () => {
  const bytes = (...hex) => Uint8Array.from(hex.join("").match(/../g), (each) => parseInt(each, 16));
  assert.equal(pixels_of(bytes("89504e470d0a1a0a", "0000000d49484452", "00007530", "00000002")), 60000);
  const [start, table, other] = ["ffd8", "ffc4000400ff", "ffe0000601020304"];
  const frame = "ffc0000b08" + "0004" + "0006" + "01000000";
  assert.equal(pixels_of(bytes(start, other, table, frame)), 24);
  for (const odd of ["", "47494638", "ffd8", "ffd8ffe0", "ffd8ffe00000ffe0000000000000000000"]) {
    assert.ok(!(pixels_of(odd ? bytes(odd) : new Uint8Array(0)) <= 1e9), odd);
  }
});
