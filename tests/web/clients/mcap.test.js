// SPDX-License-Identifier: Apache-2.0
// @mcap/core, unmodified: it reads our recordings, and we read all that its writer can make.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { crc32 } from "@foxglove/crc";
import lz4 from "@foxglove/wasm-lz4";
import zstd from "@foxglove/wasm-zstd";
import { McapIndexedReader, McapStreamReader, McapWriter, TempBuffer } from "@mcap/core";
import lz4js from "lz4js";

const limit = { timeout: 120000 };
const folder = mkdtempSync(join(tmpdir(), "rowe-mcap-"));
after(() => rmSync(folder, { recursive: true }));
before(() => Promise.all([lz4.isLoaded, zstd.isLoaded]));

const decompressHandlers = {
  lz4: (data, bytes) => lz4(data, Number(bytes)),
  zstd: (data, bytes) => zstd.decompress(data, Number(bytes)),
};
const compressions = {
  none: undefined,
  lz4: (data) => ({ compression: "lz4", compressedData: lz4js.compress(data) }),
  zstd: (data) => ({ compression: "zstd", compressedData: zstd.compress(data) }),
};

// ---- what is in a file, in the words of tests/recording/mcap_samples.cpp

// What the program says of each file, by its path.
function samples(...args) {
  const program = join(dirname(process.env.ROWE_BIN), "mcap_samples");
  const { status, stdout, stderr } = spawnSync(program, args, { encoding: "utf8", maxBuffer: 1 << 28 });
  assert.equal(status, 0, `${stderr}${stdout.slice(-1000)}`);
  return new Map(stdout.split(/^file /m).slice(1).map((part) => {
    const [path, ...lines] = part.trimEnd().split("\n");
    const of = (word) => lines.filter((line) => line.startsWith(`${word} `));
    return [path, {
      messages: of("message"), metadata: of("metadata"), attachments: of("attachment"),
      header: of("header")[0], summary: lines.includes("summary yes"), counts: of("counts")[0],
      damaged: of("damaged"), saved: of("saved")[0]?.slice("saved ".length),
    }];
  }));
}

const sum = (data) => `${data.length}:${crc32(data)}`;
const pairs = (map) => `{${[...map].sort().map(([name, value]) => `${name}=${value};`).join("")}}`;
const message_line = ({ topic, messageEncoding, metadata, schemaId }, schema, message) => {
  const described = schema ? `${schema.name} ${schema.encoding} ${sum(schema.data)}` : schemaId;
  const { logTime, publishTime, sequence, data } = message;
  return `message ${topic} ${messageEncoding} ${pairs(metadata)} (${described}) `
    + `${logTime} ${publishTime} ${sequence} ${sum(data)}`;
};
const metadata_line = ({ name, metadata }) => `metadata ${name} ${pairs(metadata)}`;
const attachment_line = ({ name, mediaType, logTime, createTime, data }) =>
  `attachment ${name} ${mediaType} ${logTime} ${createTime} ${sum(data)}`;

const time_of = (line) => BigInt(line.split(") ")[1].split(" ")[0]);
const by_time = (lines) => lines.map((line) => [time_of(line), line])
  .sort(([a], [b]) => (a < b ? -1 : Number(a > b))).map(([, line]) => line);

async function by_index(bytes) {
  const readable = new TempBuffer(bytes);
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const read = { messages: [], metadata: [], attachments: [], statistics: reader.statistics };
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    read.messages.push(message_line(channel, reader.schemasById.get(channel.schemaId), message));
  }
  for await (const one of reader.readMetadata()) read.metadata.push(metadata_line(one));
  for await (const one of reader.readAttachments({ validateCrcs: true })) {
    read.attachments.push(attachment_line(one));
  }
  return read;
}

// In the order of the file. `done`: it has an end.
function by_stream(bytes) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const read = { messages: [], metadata: [], attachments: [] };
  const [channels, schemas] = [new Map(), new Map()];
  reader.append(bytes);
  for (let record; (record = reader.nextRecord());) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Metadata") read.metadata.push(metadata_line(record));
    if (record.type === "Attachment") read.attachments.push(attachment_line(record));
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    read.messages.push(message_line(channel, schemas.get(channel.schemaId), record));
  }
  return { ...read, done: reader.done() };
}

// ---- ours, read by others

const cut = /\/cut\b/; // off behind a whole chunk

test("what is written here is read there, by the index and as a stream", limit, async () => {
  const written = samples("write", folder);
  assert.equal(written.size, 21);
  for (const [path, { messages, metadata }] of written) {
    const bytes = readFileSync(path);
    const ends = !cut.test(path);
    assert.deepEqual(by_stream(bytes), { messages, metadata, attachments: [], done: ends }, path);
    if (!ends) {
      await assert.rejects(by_index(bytes), /Expected MCAP magic/, path);
      continue;
    }
    const indexed = await by_index(bytes);
    assert.deepEqual(indexed.messages, by_time(messages), path);
    assert.deepEqual(indexed.metadata, metadata, path);
    assert.equal(indexed.statistics.messageCount, BigInt(messages.length), path);
    assert.equal(indexed.statistics.metadataCount, metadata.length, path);
  }
});

test("its checksums are there, and hold", limit, async () => {
  samples("write", folder);
  const bytes = readFileSync(join(folder, "many.mcap"));
  bytes[bytes.indexOf('{"text":"')] ^= 1;
  assert.throws(() => by_stream(bytes), /Incorrect chunk CRC/);
  await assert.rejects(by_index(bytes), /Incorrect chunk CRC/);
  bytes[bytes.lastIndexOf("test/Number")] ^= 1;
  await assert.rejects(by_index(bytes), /Incorrect summary CRC/);
});

// ---- others', read here

const switches = [
  "useChunks", "useMessageIndex", "useChunkIndex", "useSummaryOffsets", "useStatistics", "repeatSchemas",
  "repeatChannels", "useAttachmentIndex", "useMetadataIndex",
];
// All of it; of files without chunks once.
function* combinations() {
  for (let bits = 0; bits < 1 << switches.length; bits += 1) {
    const how = Object.fromEntries(switches.map((name, at) => [name, Boolean(bits >> at & 1)]));
    for (const compression of how.useChunks ? Object.keys(compressions) : ["none"]) {
      yield { name: `${bits.toString(2).padStart(switches.length, "0")}.${compression}`, how, compression };
    }
  }
}

const text = (words) => new TextEncoder().encode(words);
// Times of today, the first and the last possible ones, and equal ones.
const noon = 1760000000123456789n;
const times = [
  noon, noon + 5n, noon + 3n, noon + 3n, 0n, noon + 9n, noon - 1000n, noon + 3n, noon + 4n, 2n ** 64n - 1n,
  noon + 5n, noon + 6n, noon, noon + 2n,
];

// Writes what there is of everything; returns it.
async function write_all(writer) {
  const written = { messages: [], metadata: [], attachments: [] };
  await writer.start({ profile: "other", library: "npm" });
  const schema = { name: "test/Größe", encoding: "jsonschema", data: text('{"type":"object"}') };
  const schemaId = await writer.registerSchema(schema);
  await writer.registerSchema({ name: "unused", encoding: "", data: text("") });
  const channels = [
    { schemaId, topic: "/größe", messageEncoding: "json", metadata: new Map([["latched", "true"]]) },
    { schemaId, topic: "/b", messageEncoding: "json", metadata: new Map() },
    { schemaId: 0, topic: "/no/schema", messageEncoding: "", metadata: new Map([["b", "2"], ["a", "1"]]) },
  ];
  const ids = [];
  for (const one of channels) ids.push(await writer.registerChannel(one));
  await writer.registerChannel({ ...channels[0], topic: "/unused" });
  const add_metadata = async (one) => {
    await writer.addMetadata(one);
    written.metadata.push(metadata_line(one));
  };
  const add_attachment = async (one) => {
    await writer.addAttachment(one);
    written.attachments.push(attachment_line(one));
  };
  await add_metadata({ name: "robot", metadata: new Map([["name", "crawler"], ["arms", "2"]]) });
  for (const [n, logTime] of times.entries()) {
    const channel = channels[n % 3];
    const data = text("x,y;".repeat(n === 6 ? 300 : n * 5 % 21)); // one larger than a chunk, and empty ones
    const message = { channelId: ids[n % 3], sequence: n, logTime, publishTime: logTime / 2n, data };
    await writer.addMessage(message);
    written.messages.push(message_line(channel, channel.schemaId ? schema : undefined, message));
    if (n === 8) {
      await add_attachment({ name: "map.png", mediaType: "image/png", logTime, createTime: 7n, data });
      await add_metadata({ name: "nothing", metadata: new Map() });
    }
  }
  await add_attachment({ name: "empty", mediaType: "", logTime: 1n, createTime: 0n, data: text("") });
  await writer.end();
  return written;
}

async function files_of_all_combinations() {
  const files = new Map();
  for (const { name, how, compression } of combinations()) {
    const writable = new TempBuffer();
    const compressChunk = compressions[compression];
    const writer = new McapWriter({ ...how, writable, chunkSize: 200, compressChunk });
    const written = await write_all(writer);
    const path = join(folder, `${name}.mcap`);
    const bytes = writable.get();
    writeFileSync(path, bytes);
    files.set(path, { how, written, bytes });
  }
  return files;
}

function assert_same(read, written, path) {
  assert.deepEqual(read.messages, by_time(written.messages), path);
  assert.deepEqual(read.metadata, written.metadata, path);
  assert.deepEqual(read.attachments, written.attachments, path);
  assert.ok(read.counts.startsWith(`counts ${times.length} `) && read.counts.endsWith(" 2 2"), path);
  assert.equal(read.header, "header other npm", path);
}

test("what is written there is read here, however it is written, with its end or not", limit, async () => {
  const files = await files_of_all_combinations();
  assert.equal(files.size, 256 + 3 * 256);
  const read = samples("read", ...files.keys());
  for (const [path, { how, written, bytes }] of files) {
    assert_same(read.get(path), written, path);
    assert.deepEqual(read.get(path).damaged, [], path);
    // Only a summary that says it all takes the place of looking through the file.
    const { useMessageIndex, useSummaryOffsets, ...needed } = how;
    assert.equal(read.get(path).summary, Object.values(needed).every(Boolean), path);
    writeFileSync(path, bytes.subarray(0, -1));
  }
  const without_end = samples("read", ...files.keys());
  for (const [path, { written }] of files) {
    assert_same(without_end.get(path), written, path);
    assert.equal(without_end.get(path).summary, false, path);
  }
});

test("what was cut off and repaired here is whole there, by the index and as a stream", limit, async () => {
  const files = await files_of_all_combinations();
  for (const path of samples("write", folder).keys()) files.set(path, { bytes: readFileSync(path) });
  [...files].forEach(([path, { bytes }], n) => {
    files.get(path).cut = bytes.subarray(0, bytes.length * (5 + n % 95) / 100);
    writeFileSync(path, files.get(path).cut);
  });
  for (const [path, { saved }] of samples("repair", ...files.keys())) {
    const { done, ...left } = by_stream(files.get(path).cut);
    const bytes = readFileSync(saved);
    const { statistics, ...indexed } = await by_index(bytes);
    assert.deepEqual(indexed, { ...left, messages: by_time(left.messages) }, saved);
    assert.deepEqual(by_stream(bytes), { ...left, done: true }, saved);
    assert.equal(statistics.messageCount, BigInt(left.messages.length), saved);
  }
});

test("what is appended there is read here, in a chunk and without one", limit, async () => {
  for (const useChunks of [true, false]) {
    const written = samples("write", folder);
    const more = { sequence: 1, logTime: 1n, publishTime: 2n, data: text("{}") };
    const channel = { schemaId: 0, topic: "/more", messageEncoding: "json", metadata: new Map() };
    for (const path of written.keys()) {
      if (cut.test(path)) continue;
      const file = new TempBuffer(readFileSync(path));
      const writer = await McapWriter.InitializeForAppending(file, { useChunks });
      await writer.addMessage({ ...more, channelId: await writer.registerChannel(channel) });
      await writer.end();
      writeFileSync(path, file.get());
    }
    for (const [path, { messages, summary }] of samples("read", ...written.keys())) {
      const added = cut.test(path) ? [] : [message_line(channel, undefined, more)];
      assert.deepEqual(messages, by_time([...written.get(path).messages, ...added]), path);
      assert.equal(summary, useChunks && !cut.test(path), path);
    }
  }
});

test("a message there is read here that fills more than a block of its compression", limit, async () => {
  const data = new Uint8Array(9e6).map((_, n) => n * n % 251 & n >> 12);
  for (const compressChunk of Object.values(compressions)) {
    const writable = new TempBuffer();
    const writer = new McapWriter({ writable, compressChunk });
    await writer.start();
    const channel = { schemaId: 0, topic: "/camera", messageEncoding: "json", metadata: new Map() };
    const one = { sequence: 0, logTime: 1n, publishTime: 1n, data };
    await writer.addMessage({ ...one, channelId: await writer.registerChannel(channel) });
    await writer.end();
    const path = join(folder, "camera.mcap");
    writeFileSync(path, writable.get());
    assert.deepEqual(samples("read", path).get(path).messages, [message_line(channel, undefined, one)]);
  }
});
