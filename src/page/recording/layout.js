// SPDX-License-Identifier: Apache-2.0
// What is where in a recording, as far as one has to know before anything is shown: its parts with their
// times and channels, and what describes those. It is read from the end of the file; a file without its end,
// or one whose end does not say it all, is looked through (walk.js), and so are lines of JSON (lines.js).

import { check, crc32, damage, reader, text_of } from "./bytes.js";
import { file_bytes } from "./file.js";
import { read_lines } from "./lines.js";
import {
  chunk_head_bytes, footer_bytes, has_magic, head_bytes, magic, op, packed_bytes_max, plain_bytes_max,
  read_channel, read_chunk_index, read_metadata, read_schema, read_statistics, records_in,
} from "./records.js";
import { walk } from "./walk.js";

const tail_bytes = head_bytes + footer_bytes + magic.length;
// What a file may make this page remember: a page that ran out of memory would take STOP with it.
const summary_bytes_max = 64 << 20;
const parts_max = 500000;
const entries_max = 1 << 23;             // channels of all parts
const described_chars_max = 32 << 20;    // of all names
const metadata_max = 64;
const damaged_max = 1000;
const metadata_bytes_max = 1 << 20;
const unlisted_records_max = 2 * 65535;  // as many schemas and channels as there can be

export class layout {
  parts = [];
  schemas = new Map();   // id → {name, encoding}
  channels = new Map();  // id → {topic, encoding, schema}
  counts = null;         // channel → messages, where the file says so
  metadata = new Map();  // name → Map
  damaged = [];          // {at, bytes, why}
  indexed = true;        // the end of the file says what is where
  ended = true;          // its program came to its end
  lines = false;         // of JSON
  no_times = false;      // it has none, so they were made up

  #described = 0;

  add_schema({ id, ...more }) { this.#describe(this.schemas, id, more, more.name); }
  add_channel({ id, ...more }) { this.#describe(this.channels, id, more, more.topic); }
  #describe(all, id, what, name) {
    if (all.has(id)) return;
    this.#described += name.length + what.encoding.length;
    check(this.#described <= described_chars_max, "its topics have names that are too long");
    all.set(id, what);
  }

  add_metadata({ name, values }) {
    if (this.metadata.size < metadata_max) this.metadata.set(name, values);
  }
  // False: so much is damaged that nobody looks on.
  add_damage(one) { return this.damaged.push(one) < damaged_max; }

  // Of `entries` more channels in parts.
  has_room(entries) { return this.parts.length < parts_max && (this.#entries += entries) <= entries_max; }
  #entries = 0;

  // Of all parts.
  get begin_ms() { return this.parts.reduce((least, { begin_ms }) => Math.min(least, begin_ms), Infinity); }
  get end_ms() { return this.parts.reduce((most, { end_ms }) => Math.max(most, end_ms), -Infinity); }
}

async function read_record(file, at, bytes, wanted) {
  check(bytes >= head_bytes && bytes <= metadata_bytes_max, "a record is too large");
  const from = new reader(await file.read(at, bytes));
  check(from.u8() === wanted && from.u64() === bytes - head_bytes, "there is no record where one was");
  return from;
}

// A part that nobody could read is damage, and not looked into.
function add_chunk(into, chunk, file) {
  const { at, bytes, plain_bytes, begin_ms, end_ms } = chunk;
  if (plain_bytes === 0) return;
  const sound = at >= magic.length && bytes >= head_bytes && bytes <= packed_bytes_max &&
    bytes <= file.size - at && plain_bytes <= plain_bytes_max && begin_ms <= end_ms;
  check(into.has_room(chunk.channels?.length ?? 0), "it has too many parts");
  if (sound) into.parts.push(chunk);
  else into.damaged.push({ at, bytes, why: "its place or its size cannot be" });
}

// The records of a summary. What it counts: {attachments, metadata: their places; statistics}.
function read_summary_records(bytes, end, into, file) {
  const found = { others: [], metadata: [], statistics: null, chunks: [] };
  for (const { what, at, end: behind } of records_in(bytes, 0, end)) {
    const from = new reader(bytes, at, behind);
    if (what === op.schema) into.add_schema(read_schema(from));
    else if (what === op.channel) into.add_channel(read_channel(from));
    else if (what === op.statistics) found.statistics = read_statistics(from);
    else if (what === op.attachment_index) found.others.push({ at: from.u64(), bytes: from.u64() });
    else if (what === op.metadata_index) found.metadata.push({ at: from.u64(), bytes: from.u64() });
    else if (what === op.chunk_index) {
      const chunk = read_chunk_index(from);
      found.chunks.push({ at: chunk.at, bytes: chunk.bytes + chunk.index_bytes });
      add_chunk(into, chunk, file);
    }
  }
  return found;
}

// Whether all messages in front of the summary lie in the chunks that it lists: what lies between all that it
// lists is little, and describes channels.
async function lists_all(file, end, places) {
  let at = magic.length;
  let left = unlisted_records_max;
  const listed = [...places, { at: end, bytes: 0 }].sort((one, other) => one.at - other.at);
  for (const place of listed) {
    while (at < place.at) {
      if ((left -= 1) < 0 || end - at < head_bytes) return false;
      if (!file.holds(at, head_bytes)) await file.move(at, head_bytes);
      const from = file.near(at, head_bytes);
      const what = from.u8();
      const bytes = from.u64();
      if (what === op.message || what === op.chunk || bytes > end - at - head_bytes) return false;
      at += head_bytes + bytes;
    }
    if (at !== place.at) return false;
    at += place.bytes;
  }
  return at <= file.size;
}

// Whether what is listed is all that is counted, and each channel with messages is described.
function says_all({ statistics, chunks, metadata, others }, into) {
  if (!statistics || statistics.chunks !== chunks.length || statistics.metadata !== metadata.length ||
    statistics.attachments !== others.length) return false;
  return [...statistics.counts].every(([id, count]) => count === 0 || into.channels.has(id));
}

// Null: there is no summary, or it does not say it all.
async function read_summary(file) {
  if (file.size < magic.length + tail_bytes) return null;
  const tail = await file.read(file.size - tail_bytes, tail_bytes);
  if (!has_magic(tail.subarray(tail_bytes - magic.length))) return null;
  const from = new reader(tail);
  if (from.u8() !== op.footer || from.u64() !== footer_bytes) return null;
  const begin = from.u64();
  from.u64();
  const crc = from.u32();
  const end = file.size - tail_bytes;
  if (begin < magic.length || begin > end || end - begin > summary_bytes_max) return null;
  const bytes = await file.read(begin, file.size - magic.length - 4 - begin);
  if (crc !== 0 && crc !== crc32(bytes)) return null;
  const into = new layout();
  const found = read_summary_records(bytes, end - begin, into, file);
  if (!says_all(found, into)) return null;
  if (!await lists_all(file, begin, [...found.chunks, ...found.others, ...found.metadata])) return null;
  for (const { at, bytes: length } of found.metadata.slice(0, metadata_max)) {
    into.add_metadata(read_metadata(await read_record(file, at, length, op.metadata)));
  }
  into.counts = found.statistics.counts;
  return into;
}

async function lay_out_mcap(file, progress) {
  try {
    const found = await read_summary(file);
    if (found) return found;
  } catch (error) {
    if (!(error instanceof damage)) throw error;  // of the disk, say
  }
  const into = new layout();
  into.indexed = false;
  await walk(file, into, progress);
  return into;
}

// `file` as File; progress(share) is told now and then. What is no recording is `damage` with `kind`.
export async function lay_out(file, progress = () => {}) {
  const bytes = new file_bytes(file);
  const first = await bytes.read(0, Math.min(bytes.size, Math.max(chunk_head_bytes, 64)));
  if (has_magic(first)) return [await lay_out_mcap(bytes, progress), bytes];
  if (/^\s*[{[]/.test(text_of(first).replace(/^\ufeff/, ""))) {
    const into = new layout();
    into.indexed = false;
    into.lines = true;
    await read_lines(bytes, into, progress);
    return [into, bytes];
  }
  throw Object.assign(new damage("it is neither MCAP nor lines of JSON"), { kind: "foreign" });
}
