// SPDX-License-Identifier: Apache-2.0
// Recordings on the page, as far as Node alone can show it: lines of JSON, the player, the words of the deck.
// Files of other writers and real encoders stand in clients/recording.test.js.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { beforeEach, test } from "node:test";
import { load } from "./load.js";

const { damage } = await load("recording/bytes.js");
const { feeds } = await load("feeds.js");
const { player } = await load("recording/player.js");
const { reading } = await load("recording/reading.js");
const { find_stops } = await load("recording/marks.js");
const { missing, since_begin, words } = await load("recording/words.js");
const { unpack_lz4 } = await load("recording/lz4.js");
const { unpack_zstd } = await load("recording/zstd.js");

// ---- decoders, by what the programs of their makers packed

const bytes_of = (base64) => Uint8Array.from(Buffer.from(base64, "base64"));
const short = "hello hello hello hello hello world, here is a robot";
const lines = Array.from({ length: 120 }, (_, n) => `{"x":${(n * n) % 97},"y":${(n * 7) % 31}}\n`).join("");
const packed = {
  zstd: [[short, "KLUv/SA0FQEA4GhlbGxvIHdvcmxkLCBoZXJlIGlzIGEgcm9ib3QBAAFLEQ=="], [lines,
    "KLUv/WBEBk0JAEZTKBGwV3J9wDB4NrlbVkRiKAeQQScAIQAhAEFGevFrnsTYN9mkoW4oTawevZLZ2MzSXlUEcBAGAg" +
    "oCBMJAAEGAQdOYPfJIUoMzWftUmzTCTCcThYOGIWR9GEvpbgN9jmFND2f7EGHZTOMjByXb03HkQJ6LsS6fR7lCpkvE" +
    "fPzm0GhGBX5MQcj4LG4i7TR+zZg1uqqgWzPfWsNOOpk4xxkmhlsFgKuoIJLvb2C3ZBkDEUQFqEDC89qvAwjzymJwiD" +
    "eV5iwHX0PAseNSv1dIiktjqprSrwHJjOkNAeanLgGQQ9RknoCmCkA9x3QCbA49qOVjZcEVCi1JteDAiXhIiFxUhBNs" +
    "4ojmPFhYhkcY6ZGM7GSZjXCUYHjI9OSiCCuxx/ArgpsBNzCSAg=="]],
  lz4: [[short, "BCJNGGBAgiIAAABvaGVsbG8gBgAF8Ad3b3JsZCwgaGVyZSBpcyBhIHJvYm90AAAAAA=="]],
};

test("a chunk that zstd or lz4 packed is unpacked", () => {
  for (const [text, base64] of packed.zstd) {
    assert.equal(Buffer.from(unpack_zstd(bytes_of(base64), text.length)).toString(), text);
  }
  for (const [text, base64] of packed.lz4) {
    assert.equal(Buffer.from(unpack_lz4(bytes_of(base64), text.length)).toString(), text);
  }
});

test("a chunk that is cut off anywhere is damage", () => {
  for (const [unpack, all] of [[unpack_zstd, packed.zstd], [unpack_lz4, packed.lz4]]) {
    for (const [text, base64] of all) {
      const whole = bytes_of(base64);
      for (let length = 0; length < whole.length; length += 1) {
        assert.throws(() => unpack(whole.subarray(0, length), text.length), damage, String(length));
      }
    }
  }
});

// ---- lines of JSON

const line = (topic, msg, time) => JSON.stringify({ topic, msg, time });
const opened = (text) => reading.open(new Blob([text]));

test("lines of JSON are a recording, with times as numbers or as texts", async () => {
  const text = [line("/a", { n: 1 }, 100), "", line("/b", [2], "1970-01-01T00:01:41Z"),
    line("/a", { n: 3 }, 102)];
  const recording = await opened(text.join("\n"));
  assert.deepEqual([recording.begin_ms, recording.end_ms], [100000, 102000]);
  assert.deepEqual(recording.topics.map(({ topic, shown }) => [topic, shown]), [["/a", true], ["/b", true]]);
  const found = await recording.look(["/a", "/b"], 101500);
  assert.deepEqual(found.map(({ text: said }) => said), ['{"n":1}', "[2]"]);
});

test("lines without times come ten times a second, and it is known that they are made up", async () => {
  const recording = await opened([1, 2, 3].map((n) => line("/a", n)).join("\n"));
  assert.deepEqual([recording.begin_ms, recording.end_ms], [0, 200]);
  assert.equal(recording.layout.no_times, true);
});

test("a line that is none is counted, and a file of them is no recording", async () => {
  const recording = await opened(`${line("/a", 1, 1)}\n{"no\n${line("/a", 2, 2)}\n${line("/a", 3, 3)}\n`);
  assert.equal(recording.layout.damaged[0].lines, 1);
  await assert.rejects(opened('{"a":1}\n{"b":2}\n'), /its lines have no topic and msg/);
  await assert.rejects(opened(`${line("/a", 1, 1)}\n${line("/a", 2)}`), /some have none/);
  await assert.rejects(opened("\u0001\u0002"), /neither MCAP nor lines of JSON/);
  await assert.rejects(opened(""), damage);
});

test("many lines are read in parts, and each seek reads one", async () => {
  const pad = "x".repeat(80);
  const text = Array.from({ length: 30000 }, (_, n) => line("/a", { n, pad }, n)).join("\n");
  const recording = await opened(text);
  assert.ok(recording.layout.parts.length > 2);
  const [found] = await recording.look(["/a"], 20000500);
  assert.equal(JSON.parse(found.text).n, 20000);
  assert.equal(recording.parts.unpacked, 1);
});

test("a stop that began before the recording lasts from its begin", async () => {
  const stop = { state: "stopped", number: 3, cause: "request", source: "x", since_ms: 5000 };
  const later = { ...stop, since_ms: 6000 };
  const text = [line("/rowe/stop/state", stop, 100), line("/rowe/stop/state", later, 101)];
  const [one, ...others] = await find_stops(await opened(text.join("\n")));
  assert.deepEqual([one.begin_ms, one.end_ms, one.source, others.length], [100000, 101000, "x", 0]);
});

// ---- the player

const settled = () => new Promise((done) => setTimeout(done, 20));
const page = Object.assign(new EventTarget(), { hidden: false });
let recording, source, shown;
beforeEach(async () => {
  const text = Array.from({ length: 101 }, (_, n) =>
    [line("/a", { n }, n / 10), n % 10 ? "" : line("/b", n, n / 10)]);
  recording = await opened(text.flat().filter(Boolean).join("\n"));
  const ask = async (what, question) => {
    if (what === "look") return recording.look(question.topics, question.at_ms);
    const { wanted, from_ms, to_ms } = question;
    if (what === "span" || what === "past") return recording.span(wanted, from_ms, to_ms);
    return recording[what]?.(question.at_ms) ?? null;
  };
  const { topics, begin_ms, end_ms } = recording;
  const facts = { topics, begin_ms, end_ms, metadata: {} };
  source = new player(ask, facts, words.cannot_show);
  shown = new feeds(source, page);
});
async function turn(...passed) {
  for (const each of passed) {
    source.turn(each);
    await settled();
  }
}

test("whoever subscribes gets the latest message at once, and with it what came before", async () => {
  const got = [];
  const [past, last] = [[], []];
  shown.want("/a", ({ n }) => past.push(n), 10, { past_ms: 1000, jumped: () => (past.length = 0) });
  shown.want("/b", (n) => last.push(n), 10);
  source.seek(5050);
  await turn(0);
  assert.deepEqual(past, [41, 42, 43, 44, 45, 46, 47, 48, 49, 50]);
  assert.deepEqual(last, [50]);
  shown.want("/a", ({ n }) => got.push(n), 10);
  await turn(0);
  assert.deepEqual(got, [50]);
});

test("time goes on as fast as somebody wants, and ends at the end", async () => {
  const got = [];
  const feed = shown.want("/a", ({ n }) => got.push(n), 10);
  await turn(0);
  source.play(true);
  source.speed = 2;
  await turn(100, 100, 100);
  assert.equal(source.now_ms, 600);
  assert.ok(got.length >= 4 && got.at(-1) === 6, String(got));
  assert.equal(feed.age_ms, 0);
  source.speed = 10;
  await turn(...Array(8).fill(250));
  assert.equal(source.now_ms, 10000);
  assert.equal(source.playing, false);
});

test("a jump says so before anything comes from there", async () => {
  const said = [];
  shown.want("/a", ({ n }) => said.push(n), 10, { jumped: () => said.push("jumped") });
  await turn(0);
  source.seek(7000);
  await turn(0);
  source.seek(1000, true);
  await turn(0);
  assert.deepEqual(said.slice(-4), ["jumped", 70, "jumped", 10]);
});

test("steps lead from message to message", async () => {
  await turn(0);
  await source.step(true);
  await turn(0);
  assert.equal(source.now_ms, 100);
  await source.step(false);
  await turn(0);
  assert.equal(source.now_ms, 0);
});

test("topics are listed with their rates at the time that is shown", async () => {
  let listed;
  shown.want("/rowe/stats", (stats) => (listed = stats), 10, { listing: true });
  source.seek(5000);
  await turn(0, 0);
  assert.deepEqual(listed.topics.map(({ topic, rate_hz }) => [topic, rate_hz]), [["/a", 10], ["/b", 1]]);
  assert.equal(listed.unknown, true, "the robot told nothing of itself");
});

test("views that are given another source forget what they had of the first one", async () => {
  const said = [];
  const other = { now_ms: 0, subscribe: (topic, fn) => {
    said.push(`${topic} anew`);
    return { unsubscribe: () => said.push("ended") };
  } };
  shown.want("/a", () => {}, 10, { jumped: () => said.push("jumped") });
  await turn(0);
  said.length = 0;
  shown.from(other);
  assert.deepEqual(said, ["jumped", "/a anew"]);
  shown.from(source);
  assert.deepEqual(said.slice(2), ["ended", "jumped"]);
});

// ---- words

test("a time of the recording is written to a tenth of a second", () => {
  assert.deepEqual([0, 2200, 59999, 60000, 3723400, -5].map(since_begin),
    ["0:00.0", "0:02.2", "0:59.9", "1:00.0", "1:02:03.4", "0:00.0"]);
});

test("every word of the deck is shown", async () => {
  const source = (name) => readFile(new URL(`../../../src/page/${name}`, import.meta.url), "utf8");
  const names = ["recording.js", "recording/deck.js", "recording/words.js"];
  const scripts = (await Promise.all(names.map(source))).join("");
  const used = new Set([...scripts.matchAll(/\bwords\.(\w+)/g)].map(([, name]) => name));
  for (const name of Object.keys(words)) assert.ok(used.has(name), name);
});

test("what is missing is said in sentences, and nothing where nothing is", () => {
  const whole = { indexed: true, ended: true, no_times: false, lines: false };
  assert.equal(missing(whole, { parts: 0, cut_bytes: 0, lines: 0 }, 0), "");
  assert.equal(missing(whole, { parts: 2, why: "a chunk is too large", cut_bytes: 0, lines: 0 }, 0),
    "2 parts cannot be read (a chunk is too large)");
  assert.equal(missing({ ...whole, indexed: false, ended: false }, { parts: 0, cut_bytes: 2e6, lines: 0 }, 0),
    "Its program did not come to its end; the last 2.0 MB cannot be read");
});
