// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.js";

const { read, remember, remembered, written } = await load("arranged.js");
const views = ["overview", "drive", "plot", "data"];
const usual = { view: "overview", topic: null, drive: null, plot: [], span: null, camera: null, front: null };

test("what is as usual is not said", () => {
  assert.equal(written(usual), "");
  assert.deepEqual(read("", views), usual);
});

test("whatever is arranged comes back from the words for it", () => {
  const all = { view: "plot", topic: "/a b&c#d+e", drive: "/base/cmd_vel",
    plot: ["/gps:pose.x", "/power:cells[0].volts"], span: 10,
    camera: "/front/compressed", front: "map" };
  const words = written(all);
  assert.ok(words.startsWith("#view=plot&topic=/a%20b%26c%23d%2Be&drive=/base/cmd_vel&plot=/gps:pose.x,"));
  assert.deepEqual(read(words, views), all);
});

test("a topic alone is read, and nonsense is as usual", () => {
  assert.deepEqual(read("#/gps/fix", views), { ...usual, topic: "/gps/fix" });
  for (const odd of ["#/%E0%A4%A", "#view=cellar", "#span=x&front=back", "#"]) {
    assert.deepEqual(read(odd, views), usual, odd);
  }
});

test("a browser that remembers nothing begins as usual", () => {
  const forbidden = () => { throw new Error("denied"); };
  remember(forbidden, "#view=data");
  assert.equal(remembered(forbidden), "");
  const kept = new Map();
  const setItem = (name, value) => kept.set(name, value);
  const storage = () => ({ setItem, getItem: (name) => kept.get(name) ?? null });
  assert.equal(remembered(storage), "");
  remember(storage, "#view=data");
  assert.equal(remembered(storage), "#view=data");
});
