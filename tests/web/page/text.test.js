// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import { test } from "node:test";
import { load } from "./load.js";

const { address, age, count, duration, fixed, metres, period_ms, rate, short } = await load("numbers.js");
const { causes, control_refusals, latch, losses, refusals, states, text, thinned } = await load("text.js");
const all_files = await readdir(new URL("../../../src/page/", import.meta.url));
const files = all_files.filter((name) => name.endsWith(".js"));
const source = (path) => readFile(new URL(`../../../src/${path}`, import.meta.url), "utf8");

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

test("a cycle has three decimals while that says something", () => {
  assert.deepEqual([1003.519, 5, 42123.4, 500000, undefined].map(period_ms),
    ["1.004", "0.005", "42.1", "500", "\u2013"]);
});

test("durations have two units at most", () => {
  assert.equal(duration(0.4), "0 s");
  assert.equal(duration(59.9), "59 s");
  assert.equal(duration(3600), "1 h 0 min");
  assert.equal(duration(2 * 86400 + 7230), "2 d 2 h");
});

test("what is not live says since when, and what is done about it", () => {
  const at = { heard_at: "09:14:05", topic: "/odom", age_ms: 3200, retry_in_ms: 2900 };
  assert.equal(states.stale.veil(at), "Data is 3.2 s old");
  assert.equal(states.stale.about({ ...at, answers: true }),
    "The link is open, /odom is silent since 09:14:05");
  assert.equal(states.stale.about(at), "The robot says nothing since 09:14:05");
  assert.equal(states.disconnected.about(at), "Last heard 09:14:05, trying again in 3 s");
  assert.equal(states.disconnected.about({ ...at, heard_at: "", retry_in_ms: 0 }),
    "Not heard yet, trying now");
});

test("a time to the acknowledgment is parted into the robot's own and the network's", () => {
  const said = (took_ms, own_ms) => text.acknowledged({ took_ms, own_ms }).replaceAll("\u00a0", " ");
  assert.equal(said(4.2, 0.34), "4.2 ms: robot 0.34 ms, network 3.9 ms");
  assert.equal(said(4.2, -3), "4.2 ms: it had stopped before");
});

test("who stopped it is shown without the port of the connection", () => {
  assert.equal(causes.request("10.0.0.23:51234"), "by 10.0.0.23");
  assert.equal(address("[::1]:51234"), "[::1]");
  assert.equal(address("desk:1"), "desk:1");
});

test("short times have the decimals that matter", () => {
  assert.deepEqual([0.344, 4.24, 99.94, 120, 1200].map((ms) => short(ms).replace("\u00a0", " ")),
    ["0.34 ms", "4.2 ms", "99.9 ms", "120 ms", "1.2 s"]);
});

// The texts of a list of names in the robot's sources.
const names_of = async (path, list) => {
  const [, body] = (await source(path)).match(new RegExp(`${list}\\{([^}]*)\\}`));
  return [...body.matchAll(/"(\w+)"/g)].map(([, name]) => name);
};

test("every cause and every refusal of the stop has its words", async () => {
  const rules = "service/threads/stop_rules.cpp";
  assert.deepEqual((await names_of(rules, "cause_names")).sort(), Object.keys(causes).sort());
  const told = new Set(Object.keys(refusals).map((name) => name.split("_")[1]));
  // "lost" is the page's own: no answer came.
  assert.deepEqual([...await names_of(rules, "refusal_names"), "lost"].sort(), [...told].sort());
});

test("every refusal of control has its words", async () => {
  const names = await names_of("service/control/driver_rules.cpp", "refusal_names");
  assert.deepEqual([...names, "lost"].sort(), Object.keys(control_refusals).sort());
});

test("states that alarm differ from the others by their mark, not only by colour", () => {
  assert.equal(new Set([states.live, states.stale, states.disconnected].map(({ draws }) => draws)).size, 3);
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

const page = (name) => source(`page/${name}`);
const names_in = (html) => [...html.matchAll(/data-(?:text|label|hint)="(\w+)"/g)].map(([, name]) => name);

test("every word of the page is in the table, and nothing is there that nobody shows", async () => {
  const html = await page("index.html");
  const named = names_in(html);
  for (const name of named) assert.equal(typeof text[name], "string", name);
  const scripts = (await Promise.all(files.filter((name) => name !== "text.js").map(page))).join("");
  const used = new Set([...scripts.matchAll(/\b(?:text|words)\.(\w+)/g)].map(([, name]) => name));
  const of_own = new Set([...(await page("text.js")).matchAll(/text\.(\w+)/g)].map(([, name]) => name));
  for (const name of Object.keys(text)) {
    assert.ok(named.includes(name) || used.has(name) || of_own.has(name), `${name} is shown nowhere`);
  }
});

test("the words of the page's own are in the table alone", async () => {
  const html = await page("index.html");
  const body = html.replace(/<noscript>.*?<\/noscript>|<!--.*?-->|<head>.*?<\/head>/gs, "");
  assert.equal(body.replace(/<[^>]*>|&nbsp;/g, "").trim(), states.connecting.word);
});

// Each as a person may read it: what takes something is given what it may get.
function* sentences(table, path = "") {
  for (const [name, each] of Object.entries(table)) {
    const at = path ? `${path}.${name}` : name;
    if (typeof each === "string") yield [at, each];
    else if (typeof each === "function") yield [at, String(each)];
    else if (each && typeof each === "object") yield* sentences(each, at);
  }
}

test("no sentence shouts, is empty, or says what only programmers say", () => {
  const all = { text, states, latch, causes, refusals, control_refusals, losses, thinned };
  for (const [name, words] of sentences(all)) {
    assert.ok(words.length > 0, name);
    if (words.includes("=>")) continue;
    assert.ok(!/!|undefined|null|NaN|error|invalid/i.test(words), `${name}: ${words}`);
  }
});
