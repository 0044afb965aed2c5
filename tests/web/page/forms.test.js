// SPDX-License-Identifier: Apache-2.0
// The values of a message, and a form for one of a type. A form's fields are browsers' work: here only what
// is in it before anybody has typed.
import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.js";

const { at_path, leaves_max, leaves_of, shown_value } = await load("tree.js");
const { blank_of } = await load("forms.js");
const { ask_types } = await load("settings_view.js");

test("each value of a message has its path, and the path leads to it", () => {
  const message = { pose: { x: 1.5, frame: "odom" }, arms: [{ up: true }], none: null };
  assert.deepEqual(leaves_of(message),
    [["pose.x", 1.5], ["pose.frame", "odom"], ["arms[0].up", true], ["none", null]]);
  for (const [path, value] of leaves_of(message)) assert.equal(at_path(message, path), value);
  assert.equal(at_path(message, "pose.gone.deep"), undefined);
});

test("a name may have in it what paths are made of", () => {
  const message = { "base.link": { "a,b": 1, "50%": [2], "[x]": 3, "t:u": 4, "%2E": 5, plain: 6 } };
  const leaves = leaves_of(message);
  assert.deepEqual(leaves.map(([path]) => path), ["base%2Elink.a%2Cb", "base%2Elink.50%25[0]",
    "base%2Elink.%5Bx%5D", "base%2Elink.t%3Au", "base%2Elink.%252E", "base%2Elink.plain"]);
  for (const [path, value] of leaves) assert.equal(at_path(message, path), value, path);
});

test("a long list is one value, and a message without end is not shown without end", () => {
  const scan = { ranges: Array(17).fill(1) };
  assert.equal(leaves_of(scan).length, 1);
  assert.deepEqual(leaves_of(scan, new Set(["ranges"])).at(-1), ["ranges[16]", 1], "until it is opened");
  const wide = Object.fromEntries(Array.from({ length: 5000 }, (_, index) => [`m${index}`, index]));
  assert.equal(leaves_of(wide).length, leaves_max);
});

test("numbers are shown with the digits that count", () => {
  assert.deepEqual([-0.123456, 1234.5678, 1e-9, 7, null, [1, 2], "a", false].map(shown_value),
    ["\u22120.1235", "1234.6", "1.00e\u22129", "7", "\u2013", "2 items", "a", "false"]);
});

test("a type has a value before anybody has filled one in", () => {
  const members = [
    { name: "speed", is: "float64" }, { name: "on", is: "boolean" }, { name: "name", is: "text" },
    { name: "mode", is: "uint8", names: [["slow", 3], ["fast", 4]], by_name: true },
    { name: "gear", is: "uint8", names: [["low", 3]] },
    { name: "inner", is: "object", object: { members: [{ name: "x", is: "int32" }] } },
    { name: "list", is: "array", of: { is: "int32" } }, { name: "maybe", is: "optional", of: {} },
  ];
  assert.deepEqual(blank_of({ is: "object", object: { members } }), {
    speed: 0, on: false, name: "", mode: "slow", gear: 3, inner: { x: 0 }, list: [], maybe: null,
  });
});

test("types are asked for page after page, and not for ever", async () => {
  const pages = {
    0: { types: [{ parameter: "/a" }], next: 3 }, 3: { types: [{ service: "/b" }], next: null },
  };
  const { parameters, services } = await ask_types({ call: async (_, { from }) => pages[from] });
  assert.deepEqual([[...parameters.keys()], [...services.keys()]], [["/a"], ["/b"]]);
  let asked = 0;
  await ask_types({ call: async () => ({ types: [], next: asked++ < 100 ? 3 : null }) });
  assert.equal(asked, 2, "the second page ends where it begins");
});
