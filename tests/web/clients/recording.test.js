// SPDX-License-Identifier: Apache-2.0
// What the page makes of recordings: chunks that the real encoders packed, files of @mcap/core, unmodified,
// and files of ours.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import zstd from "@foxglove/wasm-zstd";
import { McapStreamReader, McapWriter, TempBuffer } from "@mcap/core";
import lz4js from "lz4js";
import { load } from "../page/load.js";

const { damage } = await load("recording/bytes.js");
const { find_losses, find_stops } = await load("recording/marks.js");
const { reading } = await load("recording/reading.js");
const { unpack_lz4 } = await load("recording/lz4.js");
const { unpack_zstd } = await load("recording/zstd.js");

const limit = { timeout: 240000 };
const folder = mkdtempSync(join(tmpdir(), "rowe-page-recording-"));
after(() => rmSync(folder, { recursive: true }));
before(() => zstd.isLoaded);

// Numbers that look random and are the same in each run.
function numbers(seed) {
  let state = seed;
  return () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
}

// ---- decoders

const next = numbers(7);
const shapes = {
  empty: Buffer.alloc(0),
  one: Buffer.from("x"),
  short: Buffer.from("hello hello hello hello hello world, here is a robot"),
  zeros: Buffer.alloc(700000),
  noise: Buffer.from(Array.from({ length: 300000 }, () => next() * 256)),
  few: Buffer.from(Array.from({ length: 200000 }, () => Math.abs(next() + next() + next() - 1.5) * 20)),
  text: Buffer.from(Array.from({ length: 20000 }, (_, n) =>
    `{"x":${Math.sin(n).toFixed(3)},"y":${n},"name":"robot"}`).join("\n")),
  numbers: Buffer.from(Array.from({ length: 300 }, (_, n) => `${n * n} `).join("")),
  period: Buffer.from(Array.from({ length: 90000 }, (_, n) => (n % 70000) * 7)),
};

test("what zstd packs is unpacked as it was, at each level", limit, () => {
  for (const [name, bytes] of Object.entries(shapes)) {
    for (const level of [-5, 1, 3, 7, 12, 19]) {
      const packed = zstd.compress(bytes, level);
      assert.deepEqual(Buffer.from(unpack_zstd(packed, bytes.length)), bytes, `${name} at ${level}`);
    }
  }
});

test("what lz4 packs is unpacked as it was", limit, () => {
  for (const [name, bytes] of Object.entries(shapes)) {
    const packed = lz4js.compress(bytes);
    assert.deepEqual(Buffer.from(unpack_lz4(packed, bytes.length)), bytes, name);
  }
});

const programs = [
  ["zstd", unpack_zstd, ["-1", "-19 --no-check", "--ultra -22 --long=27", "--fast=9", "-3 -B65536"]],
  ["lz4", unpack_lz4, ["-1", "-12", "-BD -B4", "-B5 -BX", "--no-frame-crc", "--content-size"]],
];
for (const [program, unpack, ways] of programs) {
  const missing = spawnSync(program, ["--version"]).error !== undefined && `${program} is not installed`;
  test(`what the program ${program} packs is unpacked as it was`, { ...limit, skip: missing }, () => {
    for (const [name, bytes] of Object.entries(shapes)) {
      const path = join(folder, "plain");
      writeFileSync(path, bytes);
      for (const how of ways) {
        const { stdout } = spawnSync(program, ["-cq", ...how.split(" "), path], { maxBuffer: 1 << 26 });
        assert.deepEqual(Buffer.from(unpack(stdout, bytes.length)), bytes, `${name} by ${how}`);
      }
    }
  });
}

// Whether it ends as it must: with what was packed, or with damage.
function ends(unpack, packed, length) {
  try {
    assert.equal(unpack(packed, length).length, length);
    return true;
  } catch (error) {
    assert.ok(error instanceof damage, error.stack);
    return false;
  }
}

test("what is cut off or turned over ends in damage, and never hangs", limit, () => {
  const random = numbers(11);
  const packers = [[unpack_zstd, (bytes) => zstd.compress(bytes, 19)],
    [unpack_lz4, (bytes) => lz4js.compress(bytes)]];
  const { short, text: long, numbers: digits, few } = shapes;
  for (const [unpack, pack] of packers) {
    for (const bytes of [short, digits, long.subarray(0, 9000), few.subarray(0, 3000)]) {
      const packed = Buffer.from(pack(bytes));
      for (let length = 0; length < packed.length - 4; length += 1) {  // the last four may be a checksum
        assert.equal(ends(unpack, packed.subarray(0, length), bytes.length), false, `cut at ${length}`);
      }
      for (let turn = 0; turn < 4000; turn += 1) {
        const turned = Buffer.from(packed);
        for (let flips = 0; flips <= turn % 3; flips += 1) {
          turned[Math.floor(random() * turned.length)] ^= 1 << (random() * 8);
        }
        ends(unpack, turned, bytes.length);
      }
      assert.equal(ends(unpack, packed, bytes.length + 1), false, "it is shorter than was said");
      assert.equal(ends(unpack, packed, bytes.length - 1), false, "it is longer than was said");
    }
  }
});

test("a dictionary is refused in words", () => {
  const of_zstd = Uint8Array.of(0x28, 0xb5, 0x2f, 0xfd, 0x21, 7, 0, 1, 0, 0);
  assert.throws(() => unpack_zstd(of_zstd, 0), /dictionary/);
  const of_lz4 = Uint8Array.of(0x04, 0x22, 0x4d, 0x18, 0x61, 0x40, 7, 0, 0, 0, 0, 0, 0, 0, 0);
  assert.throws(() => unpack_lz4(of_lz4, 0), /dictionary/);
});

// ---- files

const text = (words) => new TextEncoder().encode(words);
const compressions = {
  none: undefined,
  lz4: (data) => ({ compression: "lz4", compressedData: lz4js.compress(data) }),
  zstd: (data) => ({ compression: "zstd", compressedData: zstd.compress(data) }),
};
const parts_of_a_file = ["useStatistics", "useSummaryOffsets", "useChunks", "repeatSchemas", "repeatChannels",
  "useMessageIndex", "useChunkIndex"];

// A file of 400 messages on three topics, some of them out of order, and of one in an encoding of others.
async function file_of({ compression = "none", chunkSize = 900, ...how } = {}) {
  const writable = new TempBuffer();
  const writer = new McapWriter({ writable, chunkSize, compressChunk: compressions[compression], ...how });
  const random = numbers(3);
  await writer.start({ profile: "", library: "npm" });
  const schema = { name: "nav_msgs/Odometry", encoding: "jsonschema", data: text("{}") };
  const schemaId = await writer.registerSchema(schema);
  const register = (topic, messageEncoding) =>
    writer.registerChannel({ topic, messageEncoding, schemaId, metadata: new Map() });
  const topics = ["/odom", "/scan", "/map"];
  const ids = [];
  for (const topic of topics) ids.push(await register(topic, "json"));
  const other = await register("/tf", "cdr");
  const written = [];
  for (let n = 0; n < 400; n += 1) {
    const which = n === 2 ? 2 : Math.floor(random() * 2);  // the map comes once
    const time_ms = 1.8e12 + n * 10 - (n % 7 === 0 ? Math.floor(random() * 300) : 0);
    const logTime = BigInt(time_ms) * 1000000n;
    const words = JSON.stringify({ n, on: topics[which], pad: "x".repeat(Math.floor(random() * 60)) });
    written.push({ topic: topics[which], time_ms, text: words });
    const add = (channelId, data) =>
      writer.addMessage({ channelId, sequence: n, logTime, publishTime: logTime, data });
    await add(ids[which], text(words));
    if (n % 50 === 0) await add(other, text("\u0001"));
  }
  await writer.addMetadata({ name: "rowe", metadata: new Map([["name", "ang-01"]]) });
  await writer.end();
  return { bytes: Buffer.from(writable.get()), written };
}

const opened = (bytes, bytes_max) => reading.open(new Blob([bytes]), () => {}, bytes_max);

// By looking at each message.
const latest_of = (written, topic, at_ms) => written
  .filter((one) => one.topic === topic && one.time_ms <= at_ms)
  .reduce((best, one) => (best && best.time_ms > one.time_ms ? best : one), null);
const between = (written, topics, from_ms, to_ms) => written
  .filter(({ topic, time_ms }) => topics.includes(topic) && time_ms > from_ms && time_ms <= to_ms)
  .sort((one, other) => one.time_ms - other.time_ms);
const brief = ({ topic, time_ms, text: words }) => `${topic} ${time_ms} ${words}`;

async function assert_answers(recording, written, what) {
  const random = numbers(5);
  const topics = ["/odom", "/scan", "/map"];
  const { begin_ms, end_ms } = recording;
  for (let turn = 0; turn < 25; turn += 1) {
    const at_ms = turn === 0 ? end_ms : begin_ms + Math.floor(random() * (end_ms - begin_ms));
    const found = await recording.look(topics, at_ms);
    const wanted = topics.map((topic) => latest_of(written, topic, at_ms)).filter(Boolean);
    assert.deepEqual(found.map(brief), wanted.map(brief), `${what} at ${at_ms}`);
    const to_ms = at_ms + Math.floor(random() * 700);
    const span = await recording.span([["/odom", 0], ["/map", 0]], at_ms, to_ms, { parts_max: 1000 });
    const those = between(written, ["/odom", "/map"], at_ms, to_ms);
    // Of messages of one time the last one stands for all.
    const last = those.filter(({ topic, time_ms }, index) =>
      !those.slice(index + 1).some((one) => one.topic === topic && one.time_ms === time_ms));
    assert.deepEqual(span.map(brief).sort(), last.map(brief).sort(), `${what} from ${at_ms}`);
    const times = written.map(({ time_ms }) => time_ms);
    const later = Math.min(...times.filter((each) => each > at_ms));
    assert.equal(await recording.next(at_ms), later === Infinity ? null : later, what);
    const earlier = Math.max(...times.filter((each) => each < at_ms));
    assert.equal(await recording.before(at_ms), earlier === -Infinity ? null : earlier, what);
  }
}

test("answers are those of who looks at each message, however the file is written", limit, async () => {
  for (const compression of Object.keys(compressions)) {
    for (let bits = 0; bits < 1 << parts_of_a_file.length; bits += 1) {
      const how = Object.fromEntries(parts_of_a_file.map((name, bit) => [name, !(bits >> bit & 1)]));
      if (compression !== "none" && !how.useChunks) continue;
      const { bytes, written } = await file_of({ compression, ...how });
      const recording = await opened(bytes);
      const what = `${compression} without ${parts_of_a_file.filter((name) => !how[name]).join()}`;
      const topics = recording.topics.map(({ topic, encoding, shown }) => `${topic} ${encoding} ${shown}`);
      const known = ["/map json true", "/odom json true", "/scan json true", "/tf cdr false"];
      assert.deepEqual(topics.sort(), known, what);
      assert.equal(recording.layout.metadata.get("rowe").get("name"), "ang-01", what);
      assert.deepEqual(recording.layout.damaged, [], what);
      if (bits % 8 === 0) await assert_answers(recording, written, what);
    }
  }
});

test("nothing but the end and what is asked for is read of a file with an index", limit, async () => {
  const { bytes } = await file_of({ compression: "zstd", chunkSize: 2000 });
  let read = 0;
  const file = { size: bytes.length, slice: (at, end) => {
    read += end - at;
    return new Blob([bytes.subarray(at, end)]);
  } };
  const recording = await reading.open(file, () => {});
  const before_it = read;
  await recording.look(["/odom"], (recording.begin_ms + recording.end_ms) / 2);
  assert.ok(read - before_it < bytes.length / 4, `${read - before_it} of ${bytes.length}`);
  assert.ok(recording.parts.unpacked <= 3);
});

test("what is kept of unpacked chunks has a bound, and answers stay the same", limit, async () => {
  const { bytes, written } = await file_of({ compression: "lz4" });
  const recording = await opened(bytes, 4000);
  await assert_answers(recording, written, "little room");
  assert.ok(recording.parts.bytes < 8000, String(recording.parts.bytes));
});

// The messages of whole chunks, as @mcap/core reads what is left of a file.
function whole_of(bytes) {
  const decompressHandlers = { zstd: (data, size) => zstd.decompress(data, Number(size)) };
  const reader = new McapStreamReader({ decompressHandlers });
  const messages = [];
  reader.append(bytes);
  try {
    for (let record; (record = reader.nextRecord());) if (record.type === "Message") messages.push(record);
  } catch {
    return messages;
  }
  return messages;
}

test("of a file that was cut off anywhere, all whole chunks are shown", limit, async () => {
  const { bytes } = await file_of({ compression: "zstd" });
  for (let length = 0; length < bytes.length; length += 71) {
    const left = bytes.subarray(0, length);
    const whole = whole_of(left);
    if (whole.length === 0) {
      await opened(left).catch((error) => assert.ok(error instanceof damage, error.stack));
      continue;
    }
    const recording = await opened(left);
    assert.equal(recording.layout.indexed, false);
    const topics = ["/odom", "/scan", "/map"].map((topic) => [topic, 0]);
    const found = await recording.span(topics, 0, 2e12, { parts_max: 1e6 });
    const keys = new Set(whole.filter(({ data }) => data[0] === 0x7b)
      .map(({ channelId, logTime }) => `${channelId} ${logTime}`));
    assert.equal(found.length, keys.size, `cut at ${length}`);
  }
});

test("a chunk that is damaged is passed over and counted, and the others are shown", limit, async () => {
  const { bytes, written } = await file_of({ compression: "zstd" });
  const whole = await opened(bytes);
  const part = whole.layout.parts[4];
  bytes.fill(0x55, part.at + 80, part.at + part.bytes);
  const recording = await opened(bytes);
  const topics = ["/odom", "/scan", "/map"].map((topic) => [topic, 0]);
  const found = await recording.span(topics, 0, 2e12, { parts_max: 1e6 });
  assert.ok(found.length > written.length * 0.8 && found.length < written.length);
  assert.equal(recording.layout.damaged.length, 1);
  assert.equal(recording.layout.damaged[0].at, part.at);
});

test("behind a head that is damaged it goes on with the next chunk, without an index", limit, async () => {
  const { bytes } = await file_of({ compression: "zstd" });
  const in_file = ({ layout }) => layout.parts.map(({ at }) => at).sort((one, other) => one - other);
  const places = in_file(await opened(bytes));
  const left = Buffer.from(bytes.subarray(0, places.at(-1) + 20));  // in the middle of the last chunk
  left.fill(0xee, places[2], places[2] + 9);
  left.fill(0, places[5], places[6]);
  const recording = await opened(left);
  const lost = [places[2], places[5], places.at(-1)];
  assert.deepEqual(in_file(recording), places.filter((at) => !lost.includes(at)));
  assert.deepEqual(recording.layout.damaged.map(({ at, why }) => [at, why]),
    [[lost[0], "damaged"], [lost[1], "damaged"], [lost[2], "cut"]]);
});

test("bytes turned over anywhere never hang or end in anything but damage", limit, async () => {
  const random = numbers(17);
  const { bytes } = await file_of({ compression: "lz4" });
  for (let turn = 0; turn < 200; turn += 1) {
    const turned = Buffer.from(bytes);
    for (let flips = 0; flips <= turn % 4; flips += 1) {
      turned[Math.floor(random() * turned.length)] ^= 1 << (random() * 8);
    }
    try {
      const recording = await opened(turned);
      await recording.look(["/odom", "/scan"], recording.end_ms);
      await recording.span([["/odom", 0]], recording.begin_ms, recording.end_ms);
    } catch (error) {
      assert.ok(error instanceof damage, error.stack);
    }
  }
});

// ---- files of ours

test("all that our writer makes is read here, with its end or not", limit, async () => {
  const program = join(dirname(process.env.ROWE_BIN), "mcap_samples");
  const { status, stdout } = spawnSync(program, ["write", folder], { encoding: "utf8", maxBuffer: 1 << 28 });
  assert.equal(status, 0);
  for (const [, path] of stdout.matchAll(/^file (.*)$/gm)) {
    const recording = await opened(readFileSync(path)).catch((error) => error);
    const said = stdout.split(`file ${path}\n`)[1].split(/^file /m)[0];
    const messages = (said.match(/^message /gm) ?? []).length;
    if (recording instanceof Error) {
      assert.equal(messages, 0, `${path}: ${recording.stack}`);
      continue;
    }
    let count = 0;
    for (const part of recording.layout.parts) count += (await recording.parts.get(part))?.times.length ?? 0;
    assert.equal(count, messages, path);
  }
});

// ---- stops and losses

async function file_of_stops() {
  const writable = new TempBuffer();
  const writer = new McapWriter({ writable, chunkSize: 400 });
  await writer.start({ profile: "", library: "npm" });
  const described = { messageEncoding: "json", schemaId: 0, metadata: new Map() };
  const register = (topic) => writer.registerChannel({ ...described, topic });
  const [stop, lost] = [await register("/rowe/stop/state"), await register("/rowe/record/lost")];
  const add = (channelId, at_ms, msg) => {
    const logTime = BigInt(at_ms) * 1000000n;
    const data = text(JSON.stringify(msg));
    return writer.addMessage({ channelId, sequence: 0, logTime, publishTime: logTime, data });
  };
  const stops = [[20000, 20800, "request"], [61000, 61040, "loop"], [61100, 90000, "guard"]];
  for (let at_ms = 0; at_ms < 120000; at_ms += 20) {
    const begun = stops.filter(([begin]) => begin <= at_ms);
    const now = begun.find(([, end]) => at_ms < end);
    const state = now ? "stopped" : "running";
    const since = now ? now[0] : begun.at(-1)?.[1] ?? 0;
    const cause = now?.[2] ?? null;
    const number = 3 + begun.length;
    await add(stop, at_ms, { state, number, cause, source: "x", since_ms: at_ms - since });
    if (at_ms === 30000) await add(lost, at_ms, { topic: "/scan", messages: 7 });
  }
  await writer.end();
  return { bytes: Buffer.from(writable.get()), stops };
}

test("stops are found by halving, each as long as it was, and losses with their numbers", limit, async () => {
  const { bytes, stops } = await file_of_stops();
  const recording = await opened(bytes);
  const found = await find_stops(recording);
  assert.deepEqual(found.map(({ begin_ms, end_ms, cause }) => [begin_ms, end_ms, cause]), stops);
  assert.ok(recording.layout.parts.length > 1000);
  const { unpacked } = recording.parts;
  assert.ok(unpacked < 120, `${unpacked} of ${recording.layout.parts.length}`);
  assert.deepEqual(await find_losses(recording), [{ at_ms: 30000, topic: "/scan", messages: 7 }]);
});

// ---- files that mean harm: each is sound record by record

const u16 = (value) => Buffer.from(Uint16Array.of(value).buffer);
const u32 = (value) => Buffer.from(Uint32Array.of(value).buffer);
const u64 = (value) => Buffer.from(BigUint64Array.of(BigInt(value)).buffer);
const words = (said) => Buffer.concat([u32(Buffer.byteLength(said)), Buffer.from(said)]);
const record = (op, ...parts) => {
  const content = Buffer.concat(parts);
  return Buffer.concat([Buffer.from([op]), u64(content.length), content]);
};
const magic = Buffer.from("\x89MCAP0\r\n", "latin1");
const start = Buffer.concat([magic, record(1, words(""), words(""))]);
const channel_record = (id, topic) => record(4, u16(id), u16(0), words(topic), words("json"), u32(0));
const message_record = (id, time, body) =>
  record(5, u16(id), u32(0), u64(time), u64(time), Buffer.from(body));
const chunk_record = (time, plain) =>
  record(6, u64(time), u64(time), u64(plain.length), u32(0), words(""), u64(plain.length), plain);

test("many topics in many parts that do not say what is in them are opened", limit, async () => {
  const topics = Array.from({ length: 20000 }, (_, id) => channel_record(id + 1, `/t${id}`));
  const chunks = Array.from({ length: 20000 }, (_, at) =>
    chunk_record(at + 1, message_record(1, at + 1, "{}")));
  const made = await reading.open(new Blob([start, ...topics, ...chunks]));
  assert.equal(made.topics.length, 20000);
  assert.deepEqual((await made.look(["/t0"], 1)).map(({ text }) => text), ["{}"]);
});

test("of messages that come in hundreds of thousands an answer has some", limit, async () => {
  const body = '{"state":"stopped","number":';
  const chunks = Array.from({ length: 4 }, (_, part) => chunk_record(1 + part, Buffer.concat(
    Array.from({ length: 60000 }, (_, each) =>
      message_record(1, 1 + part, `${body}${part * 60000 + each}}`)))));
  const made = await reading.open(new Blob([start, channel_record(1, "/rowe/stop/state"), ...chunks]));
  const found = await made.span([["/rowe/stop/state", 0]], 0, 1);
  assert.ok(found.length <= (32 << 20) / 256 + 1, String(found.length));
  assert.ok((await find_stops(made)).length <= 2000);
});

test("a message that would keep the page from all else is left out, and counted", limit, async () => {
  const long = JSON.stringify({ text: "x".repeat(5 << 20) });
  const plain = Buffer.concat([message_record(1, 1, '{"n":1}'), message_record(2, 2, long)]);
  const made = await reading.open(new Blob([start, channel_record(1, "/a"), channel_record(2, "/b"),
    chunk_record(2, plain)]));
  assert.deepEqual((await made.look(["/a", "/b"], 3)).map(({ topic }) => topic), ["/a"]);
  assert.equal(made.too_long, 1);
});

test("what is damaged again and again, and notes without end, are cut off", limit, async () => {
  const notes = Array.from({ length: 5000 }, (_, at) => record(12, words(`n${at}`), u32(0)));
  const torn = Array.from({ length: 5000 }, (_, at) =>
    Buffer.concat([Buffer.alloc(9), chunk_record(at + 1, message_record(1, at + 1, "{}"))]));
  const made = await reading.open(new Blob([start, channel_record(1, "/a"), ...notes, ...torn]));
  assert.ok(made.layout.metadata.size <= 64);
  assert.ok(made.layout.damaged.length <= 1001);
});
