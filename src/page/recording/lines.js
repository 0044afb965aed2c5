// SPDX-License-Identifier: Apache-2.0
// Lines of JSON, as `rowe echo --json` prints them: {"topic": …, "msg": …}, with or without a `time`. They
// are looked through once, and then read again in parts, as chunks are.

import { damage, text_of } from "./bytes.js";

const step_bytes = 1 << 20;
const line_bytes_max = 16 << 20;
const unread_share_max = 0.5;   // what has more lines that say nothing is something else
const step_ms = 100;            // from line to line where they have no times

// {topic, msg, time_ms}, or null for a line that is none; `time_ms` undefined: it says none.
export function read_line(text) {
  let line;
  try {
    line = JSON.parse(text);
  } catch {
    return null;
  }
  const { topic, msg, time } = line ?? {};
  if (typeof topic !== "string" || msg === undefined) return null;
  const time_ms = typeof time === "number" ? time * 1000
    : typeof time === "string" ? Date.parse(time) : undefined;
  return Number.isNaN(time_ms) ? null : { topic, msg, time_ms };
}

// The lines of bytes that begin with one, each as [begin, end).
function* lines_of(bytes) {
  for (let at = 0; at < bytes.length;) {
    const found = bytes.indexOf(10, at);
    const end = found < 0 ? bytes.length : found;
    if (end > at) yield [at, end];
    at = end + 1;
  }
}

class topics {
  #ids = new Map();
  constructor(into) { this.into = into; }

  id_of(topic) {
    if (!this.#ids.has(topic)) {
      if (this.#ids.size > 65534) return null;
      this.#ids.set(topic, this.#ids.size + 1);
      this.into.add_channel({ id: this.#ids.size, schema: 0, topic, encoding: "json" });
    }
    return this.#ids.get(topic);
  }
}

// The part that whole lines are.
function part_of(bytes, at, first_line, names, found) {
  const part = { kind: "lines", at, bytes: bytes.length, plain_bytes: bytes.length, first_line, lines: 0,
    begin_ms: Infinity, end_ms: -Infinity, channels: [] };
  const seen = new Set();
  for (const [begin, end] of lines_of(bytes)) {
    const line = read_line(text_of(bytes.subarray(begin, end)));
    const number = first_line + part.lines;
    part.lines += 1;
    const id = line && names.id_of(line.topic);
    if (!id) {
      found.unread += 1;
      continue;
    }
    found.timed += line.time_ms === undefined ? 0 : 1;
    found.read += 1;
    const time_ms = line.time_ms ?? number * step_ms;
    part.begin_ms = Math.min(part.begin_ms, time_ms);
    part.end_ms = Math.max(part.end_ms, time_ms);
    seen.add(id);
  }
  part.channels = [...seen];
  return part;
}

// Fills `into`, as layout.
export async function read_lines(file, into, progress) {
  const names = new topics(into);
  const found = { read: 0, unread: 0, timed: 0 };
  let [at, line, want] = [0, 0, step_bytes];
  while (at < file.size) {
    const bytes = await file.read(at, Math.min(want, file.size - at));
    const last = at + bytes.length === file.size ? bytes.length : bytes.lastIndexOf(10) + 1;
    if (last === 0) {
      if (want >= line_bytes_max) throw new damage("a line is too long");
      want *= 4;
      continue;
    }
    const part = part_of(bytes.subarray(0, last), at, line, names, found);
    if (part.channels.length > 0) into.parts.push(part);
    [at, line, want] = [at + last, line + part.lines, step_bytes];
    progress(at / file.size);
    if (found.unread > 100 && found.unread > found.read * unread_share_max) break;
  }
  if (found.unread > found.read * unread_share_max) throw new damage("its lines have no topic and msg");
  const some_timed = found.timed > 0 && found.timed < found.read;
  if (some_timed) throw new damage("some of its lines have a time, and some have none");
  into.no_times = found.timed === 0;
  if (found.unread > 0) into.damaged.push({ at: 0, bytes: 0, why: "lines", lines: found.unread });
}

// The messages of a part, as list_messages() of records.js gives them.
export function list_lines(bytes, part, id_of) {
  const read = [];
  let number = part.first_line;
  const encoder = new TextEncoder();
  for (const [begin, end] of lines_of(bytes)) {
    const line = read_line(text_of(bytes.subarray(begin, end)));
    const time_ms = line?.time_ms ?? number * step_ms;
    number += 1;
    const id = line && id_of(line.topic);
    if (id) read.push({ id, time_ms, body: encoder.encode(JSON.stringify(line.msg)) });
  }
  const plain = new Uint8Array(read.reduce((sum, { body }) => sum + body.length, 0));
  const listed = { plain, times: Float64Array.from(read, ({ time_ms }) => time_ms),
    channels: Uint16Array.from(read, ({ id }) => id), at: new Uint32Array(read.length),
    lengths: Uint32Array.from(read, ({ body }) => body.length) };
  let at = 0;
  read.forEach(({ body }, index) => {
    plain.set(body, at);
    listed.at[index] = at;
    at += body.length;
  });
  return listed;
}
